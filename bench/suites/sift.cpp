// SPDX-License-Identifier: Apache-2.0
// The baseline that the thesis dropped beside what it took instead, one thread, CPU time: is any of the four objects of
// graph/objects (8 views each) in a scene of 640 x 480? OpenCV's SIFT with ratio test and homography at the scene's own
// size, against the windows of the colour stage.
#include <cstdio>
#include <opencv2/core.hpp>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "graph/cli/outcome.hpp"
#include "nodes/object_detection/detector.hpp"
#include "nodes/object_detection/scenes.hpp"
#include "nodes/sift/sift_match.hpp"

namespace takt::bench {

std::vector<Row> run_sift(const Options& options);

namespace {

using namespace object_detection;

constexpr size_t kScenes = 8;

cv::Mat image_of(const ReferenceView& view) {
  return {view.side_px, view.side_px, CV_8UC3, const_cast<uint8_t*>(view.pixels.data())};
}

}  // namespace

std::vector<Row> run_sift(const Options& options) {
  cv::setNumThreads(1);
  const auto database = read_database(command::shipped("graph/objects"), 48, TestViews::read);
  std::vector<Scene> scenes;
  for (uint64_t i = 0; i < kScenes; ++i) scenes.push_back(make_scene(database, {}, 1, i));
  sift::Matcher matcher;
  std::vector<sift::Features> views;
  for (const DatabaseObject& object : database)
    for (const ReferenceView& view : object.views) views.push_back(matcher.features(image_of(view)));
  DetectorParameters p;
  p.last = Stage::colour;
  Detector detector(scenes[0].width, scenes[0].height, database, p);
  std::fprintf(stderr, "sift: %zu views, %zu scenes in turn\n", views.size(), scenes.size());
  size_t ours = 0, theirs = 0;
  Compared figures = compare(
      static_cast<size_t>(options.rounds_or(60)),
      [&] {
        Scene& scene = scenes[theirs++ % kScenes];
        return cpu_ms([&] {
          const sift::Features image =
              matcher.features(cv::Mat(scene.height, scene.width, CV_8UC3, scene.pixels.data()));
          for (const sift::Features& view : views) matcher.match(view, image);
        });
      },
      [&] { return cpu_ms([&] { detector.run(scenes[ours++ % kScenes].view()); }); });
  std::vector<Row> rows;
  Row row{"sift/colour_stage_640x480", "ms", 0, std::move(figures.changed), {}, {}, {}, "one thread, 32 views"};
  add_pair(rows, std::move(row), "OpenCV SIFT, ratio test, homography", figures.pairs);
  return rows;
}

}  // namespace takt::bench
