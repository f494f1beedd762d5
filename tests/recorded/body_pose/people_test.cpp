// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "nodes/body_pose/body_detector.hpp"
#include "nodes/body_pose/floor.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "tests/recorded/recording.hpp"
#include "tests/unit/body_pose/skeletons.hpp"

using namespace takt;
using namespace takt::body_pose;
using takt::test::kWithoutEnd;
using takt::test::recording;
using takt::test::shipped;

TEST_CASE("five people in a Kinect's image, two and two beside one another: all found, and nobody else") {
  const auto file = recording("clouds/human/five_people_depth_mm.png");
  const cv::Mat depth = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  REQUIRE(depth.type() == CV_16UC1);
  std::vector<Point> points;
  for (int v = 0; v < depth.rows; ++v)
    for (int u = 0; u < depth.cols; ++u)
      if (const float z = depth.at<uint16_t>(v, u) / 1000.0f; z > 0)
        points.push_back({(static_cast<float>(u) - 319.5f) * z / 525, (static_cast<float>(v) - 239.5f) * z / 525, z});
  const auto mount = find_floor(points, {});
  REQUIRE(mount);
  const mapping_3d::Affine in_floor = mapping_3d::to_affine(*mount);
  for (Point& p : points) {
    const auto [x, y, z] = mapping_3d::transformed(in_floor, p.x, p.y, p.z);
    p = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  }
  BodyDetector detector(shipped("human"), {}, points.size());
  const auto bodies = detector.run(points, eye_of(*mount), kWithoutEnd);
  CHECK(bodies.size() == 5);
  for (const DetectedBody& body : bodies) {
    // Heads in the image; column and depth of each.
    constexpr double kHeads[][2] = {{85, 2.2}, {180, 2.5}, {345, 2.9}, {418, 2.7}, {545, 1.9}};
    const double x = body.fit.ends[0].x(), y = body.fit.ends[0].y();
    CHECK(std::any_of(std::begin(kHeads), std::end(kHeads), [&](const auto& head) {
      return std::hypot(x - (head[0] - 319.5) * head[1] / 525, y - head[1]) < 0.25;
    }));
  }
}
