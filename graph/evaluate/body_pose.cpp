// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"
#include "nodes/body_pose/evaluate.hpp"
#include "nodes/body_pose/floor.hpp"
#include "nodes/body_pose/picture.hpp"
#include "nodes/picture/image_file.hpp"
#include "rt/image_file/image_file.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using namespace body_pose;
using Json = nlohmann::ordered_json;

constexpr double kReserve_ms = 5;  ///< what the node leaves of its budget (its parameter `reserve`)

Skeleton skeleton_of(const EvalBodyPoseOptions& options) {
  return read_skeleton(options.skeleton.empty() ? shipped("graph/skeletons/human.txt") : options.skeleton);
}

void write(const std::string& file, const cv::Mat& picture) { require_written(picture::write_image(file, picture)); }

// A Kinect's depth image ---------------------------------------------------------------------------------------------

/// Of the Kinect, as its data are given: X = (u - 319.5) z / 525.
constexpr CameraModel kKinect{525, 319.5, 239.5, 0};

std::vector<Point> points_of(const cv::Mat& depth_mm) {
  std::vector<Point> points;
  for (int v = 0; v < depth_mm.rows; ++v)
    for (int u = 0; u < depth_mm.cols; ++u) {
      const double z = depth_mm.at<uint16_t>(v, u) / 1000.0;
      if (z > 0)
        points.push_back({static_cast<float>((u - kKinect.cu_px) * z / kKinect.focal_px),
                          static_cast<float>((v - kKinect.cv_px) * z / kKinect.focal_px), static_cast<float>(z)});
    }
  return points;
}

std::vector<Point> moved(std::vector<Point> points, const Transform& camera_in_floor) {
  const mapping_3d::Affine a = mapping_3d::to_affine(camera_in_floor);
  for (Point& p : points) {
    const auto along = [&, q = p](int row) {
      return static_cast<float>(a.r[3 * row] * q.x + a.r[3 * row + 1] * q.y + a.r[3 * row + 2] * q.z + a.t[row]);
    };
    p = {along(0), along(1), along(2)};
  }
  return points;
}

Json measure_depth(const EvalBodyPoseOptions& options) {
  const cv::Mat depth = read_values(options.depth);
  if (depth.type() != CV_16UC1)
    throw std::runtime_error(options.depth.string() + ": must be an image of one channel of 16 bit, depth in mm");
  const std::vector<Point> points = points_of(depth);
  const auto camera_in_floor = find_floor(points, {});
  if (!camera_in_floor) throw std::runtime_error(options.depth.string() + ": shows no floor");
  const std::vector<Point> in_floor = moved(points, *camera_in_floor);
  BodyDetector detector(skeleton_of(options), {}, in_floor.size());
  const int64_t start = thread_cpu_ns();
  const auto bodies = detector.run(in_floor, eye_of(*camera_in_floor), [] { return true; });
  const double time_ms = static_cast<double>(thread_cpu_ns() - start) / 1e6;
  if (!options.picture.empty()) {
    cv::Mat image;
    if (!options.colour.empty()) image = read_image(options.colour, Channels::colour);
    if (image.size() != depth.size()) {
      depth.convertTo(image, CV_8U, 255.0 / 6000);
      cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
    }
    write(options.picture, draw_bodies(image, kKinect, *camera_in_floor, in_floor, detector.skeleton(), bodies));
  }
  Json list = Json::array();
  for (const DetectedBody& body : bodies) {
    const Body told = to_message(detector.skeleton(), body);
    Json missing = Json::array();
    for (size_t i = 1; i < detector.skeleton().links.size(); ++i)
      if (!body.fit.fitted[i]) missing.push_back(detector.skeleton().links[i].name);
    list.push_back({{"x_m", told.joints[0].x},
                    {"y_m", told.joints[0].y},
                    {"top_m", told.top_m},
                    {"error", told.error},
                    {"valid", told.valid != 0},
                    {"pose", detector.skeleton().poses[body.fit.pose].name},
                    {"missing", missing}});
  }
  return {{"people", bodies.size()},
          {"candidates", detector.candidates().size()},
          {"camera_height_m", camera_in_floor->z},
          {"points", points.size()},
          {"time_ms", time_ms},
          {"bodies", list}};
}

// Generated scenes ---------------------------------------------------------------------------------------------------

Json to_json(const Figures& f) {
  return {{"trials", f.trials},
          {"found", f.found},
          {"extra", f.extra},
          {"right_pct", f.right_pct()},
          {"misses",
           {{"no_candidate", f.misses.no_candidate},
            {"refused", f.misses.refused},
            {"arm_missing", f.misses.arm_missing},
            {"other_arm", f.misses.other_arm},
            {"elsewhere", f.misses.elsewhere},
            {"arm_hidden_in_these", f.misses.hidden}}},
          {"arm_fitted", f.angle_deg.size()},
          {"angle_median_deg", quantile(f.angle_deg, 0.5)},
          {"angle_p90_deg", quantile(f.angle_deg, 0.9)},
          {"joint_median_m", quantile(f.joint_m, 0.5)},
          {"missing_pct", f.links == 0 ? 0 : 100.0 * f.missing / f.links},
          {"valid", f.valid},
          {"searched_pct", f.trials == 0 ? 0 : 100 * f.searched / f.trials},
          {"time_ms", quantile(f.time_ms, 0.5)},
          {"time_max_ms", quantile(f.time_ms, 1)}};
}

Json measure_generated(const EvalBodyPoseOptions& options) {
  const Skeleton skeleton = skeleton_of(options);
  DetectorParameters p;
  p.fit.search_m = options.search_m;
  SceneCamera camera;
  camera.noise_px = options.noise_px;
  camera.disparity_step_px = options.step_px;
  camera.tilt_rad = options.tilt_rad;
  if (skeleton.links[0].name != "head")
    return to_json(measure_any(skeleton, p.fit, camera, options.seed, options.people));
  BodyDetector detector(skeleton, p, static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height));
  if (!options.picture.empty()) {
    const GeneratedScene scene = make_person(skeleton, camera, options.seed, 0);
    const cv::Mat image(scene.height, scene.width, CV_8UC3, const_cast<uint8_t*>(scene.image.data()));
    cv::Mat large;
    cv::resize(image, large, {}, camera.step_px, camera.step_px, cv::INTER_NEAREST);
    const auto bodies = detector.run(scene.in_floor, eye_of(scene.camera_in_floor), [] { return true; });
    write(options.picture, draw_bodies(large, scene.camera, scene.camera_in_floor, scene.in_floor, skeleton, bodies));
  }
  const double search_ms =
      options.budget_ms > 0 ? options.budget_ms - kReserve_ms : std::numeric_limits<double>::infinity();
  Json out = to_json(measure_people(detector, camera, options.seed, options.people, search_ms));
  out["seed"] = options.seed;
  out["budget_ms"] = options.budget_ms;
  out["thesis"] = {{"right_pct", 80.2}, {"angle_median_deg", 6.8}, {"time_ms", 150}};
  return out;
}

void print(const Json& out) {
  for (const auto& [key, value] : out.items())
    if (value.is_array())
      for (const Json& row : value) std::printf("  %s\n", row.dump().c_str());
    else
      std::printf("%-20s %s\n", key.c_str(),
                  value.is_number_float() ? std::to_string(value.get<double>()).c_str() : value.dump().c_str());
}

}  // namespace

int evaluate(const EvalBodyPoseOptions& options) {
  const Json out = options.depth.empty() ? measure_generated(options) : measure_depth(options);
  if (options.json) std::printf("%s\n", out.dump(2).c_str());
  else print(out);
  return kOk;
}

}  // namespace takt::command
