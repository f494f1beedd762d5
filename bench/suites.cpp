// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "bench/suite.hpp"

namespace takt::bench {

std::vector<Row> run_transport(const Options&);
std::vector<Row> run_publish(const Options&);
std::vector<Row> run_release(const Options&);
std::vector<std::string> release_conditions();
std::vector<Row> run_release_loads(const Options&);
std::vector<std::string> release_loads_conditions();
std::vector<Row> run_graph(const Options&);
std::vector<Row> run_trace(const Options&);
std::vector<Row> run_record(const Options&);
std::vector<Row> run_cloud(const Options&);
std::vector<Row> run_registration(const Options&);
std::vector<Row> run_stereo(const Options&);
std::vector<Row> run_rectify(const Options&);
std::vector<Row> run_ego_motion(const Options&);
std::vector<Row> run_signs(const Options&);
std::vector<Row> run_sift(const Options&);
std::vector<Row> run_objects(const Options&);
std::vector<Row> run_detection(const Options&);
std::vector<Row> run_objects_3d(const Options&);
std::vector<Row> run_mapping(const Options&);
std::vector<Row> run_semantic(const Options&);
std::vector<Row> run_semantic_link(const Options&);
std::vector<Row> run_ground(const Options&);
std::vector<Row> run_fusion(const Options&);
std::vector<Row> run_world(const Options&);

std::span<const Suite> suites() {
  static const auto list = std::to_array<Suite>({
      {"transport", "one message from output to input: one worker, threads, processes", run_transport},
      {"publish", "what a reader that never comes, or keeps all it gets, costs a writer", run_publish},
      {"release", "lateness of the five rates against clock_nanosleep, idle and under load", run_release,
       release_conditions},
      {"release_loads", "the same per rate, policy and load, next to cyclictest; ten minutes", run_release_loads,
       release_loads_conditions},
      {"graph", "ten nodes, seven hops: in one process, as ten processes, and over other libraries", run_graph},
      {"trace", "what tracing costs a job and a run, against the same without", run_trace},
      {"record", "what recording two stereo cameras of 1280x960 costs, against the same run without", run_record},
      {"cloud", "outlier removal, interpolation, smoothing, reduction; against a kd-tree and hash maps", run_cloud},
      {"registration", "generations of genetic ICP, 1000 + 1000 points; against a kd-tree", run_registration},
      {"stereo", "dense disparity at 640x480, 150 disparities, against OpenCV's matchers", run_stereo},
      {"rectify", "debayering and rectification of a 640x480 pair, against OpenCV's", run_rectify},
      {"ego_motion", "a step at 640x480, against OpenCV's corners and optical flow", run_ego_motion},
      {"signs", "seven cascades over a scene of 640x480, against OpenCV's detector", run_signs},
      {"sift", "objects in a scene: the colour stage against OpenCV's SIFT", run_sift},
      {"objects", "histogram cascade at 640x480: stages on all windows against brute force, the whole", run_objects},
      {"detection", "the same as objects", run_detection},
      {"objects_3d", "things on a table: growing regions against a kd-tree, the whole", run_objects_3d},
      {"mapping", "scan matching: search, refinement against brute force; occupancy map, pose filter", run_mapping},
      {"semantic", "network queries, insertion and plans against the size of the network", run_semantic},
      {"semantic_link", "a scan to a client elsewhere, over UDP and D-Bus; against a bare socket", run_semantic_link},
      {"ground", "the ground map at 640x480: stages against brute force and OpenCV, a whole image", run_ground},
      {"fusion", "median fusion of depth images against its plain definition; a cloud's way into the map", run_fusion},
      {"world", "messages as CDR for other programs: JPEG against bare libjpeg-turbo, a cloud against a copy",
       run_world},
  });
  return list;
}

}  // namespace takt::bench
