// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/ego_motion.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "nodes/ego_motion/evaluate.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/node.hpp"

namespace takt {
void register_ego_motion(NodeTypes& types);
}

using namespace takt::ego_motion;
using takt::CameraModel;

namespace {

/// A textured wall at depth z(t), seen by a synthetic stereo rig: exact images of a known motion.
struct Wall {
  static constexpr int width = 320, height = 240;
  CameraModel camera{250, 159.5, 119.5, 0.20};
  std::vector<uint8_t> left, right;
  std::vector<int16_t> disparity;

  static double texture(double x, double y) {
    return 128 + 40 * std::sin(9 * x + 2 * std::sin(5 * y)) + 40 * std::sin(11 * y + 3 * std::sin(4 * x)) +
           30 * std::sin(23 * x + 19 * y);
  }
  // Wall at depth z with a second one at half the depth in the lower part of the image, camera shifted by x.
  void render(double x_m, double z_m, int brightness = 0) {
    left.assign(static_cast<size_t>(width * height), 0);
    right = left;
    disparity.assign(left.size(), -1);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        const auto i = static_cast<size_t>(v * width + u);
        const double plane = v < height / 2 ? 4.0 : 2.5;
        const double Z = plane - z_m;
        const double X = (u - camera.cu_px) * Z / camera.focal_px + x_m, Y = (v - camera.cv_px) * Z / camera.focal_px;
        left[i] = static_cast<uint8_t>(std::lround(texture(X, Y)) / 2 + brightness + 30);
        right[i] = static_cast<uint8_t>(std::lround(texture(X + camera.baseline_m, Y)) / 2 + brightness + 30);
        disparity[i] = static_cast<int16_t>(std::lround(camera.focal_px * camera.baseline_m / Z));
      }
  }
  Frame frame(int64_t stamp_ns) const {
    return {{left.data(), width, height},
            {right.data(), width, height},
            {disparity.data(), width, height},
            camera,
            stamp_ns};
  }
};

}  // namespace

TEST_CASE("a known motion is measured from images, in each mode") {
  struct Mode {
    std::string name;
    Parameters parameters;
    double tolerance_m;
  };
  Parameters velocity, parabola, window, plain;
  velocity.predict = Predict::constant_velocity;
  velocity.r_const = 40;
  parabola.subpixel = Subpixel::parabola;
  window.predict = Predict::none;
  window.corner_candidates = true;
  window.r_const = 30;
  window.flow_filter = true;
  plain.brightness = false;
  for (const Mode& mode :
       {Mode{"default", {}, 0.003}, Mode{"constant velocity", velocity, 0.003}, Mode{"parabola", parabola, 0.008},
        Mode{"window", window, 0.003}, Mode{"as bright as they are", plain, 0.003}}) {
    CAPTURE(mode.name);
    Wall wall;
    EgoMotion ego;
    ego.configure(Wall::width, Wall::height, mode.parameters);
    wall.render(0, 0);
    const Result first = ego.step(wall.frame(0));
    CHECK(first.keyframe);
    CHECK(first.corners > 50);
    Result r;
    for (int i = 1; i <= 4; ++i) {
      // The exposure drifts as well, where the refinement can bear it (a parabola through SAD costs cannot).
      wall.render(0.02 * i, 0.05 * i, mode.parameters.subpixel == Subpixel::lucas_kanade ? 3 * i : 0);
      r = ego.step(wall.frame(i * 100'000'000));
      CHECK(r.valid);
      CHECK_FALSE(r.keyframe);
      CHECK(std::abs(r.camera_in_previous.transform.x - 0.02) < mode.tolerance_m);
      CHECK(std::abs(r.camera_in_previous.transform.y) < mode.tolerance_m);
      CHECK(std::abs(r.camera_in_previous.transform.z - 0.05) < mode.tolerance_m);
    }
    CHECK(std::abs(r.pose.transform.z - 0.20) < 4 * mode.tolerance_m);
  }
}

TEST_CASE("gain and offset that change from frame to frame and between the cameras cost little") {
  Wall wall;
  EgoMotion ego;
  ego.configure(Wall::width, Wall::height, {});
  for (int i = 0; i <= 4; ++i) {
    wall.render(0.02 * i, 0.05 * i);
    const double gain = i % 2 == 0 ? 1 : 1.4;
    for (uint8_t& v : wall.left) v = static_cast<uint8_t>(std::min(255.0, gain * v + 6 * i));
    for (uint8_t& v : wall.right) v = static_cast<uint8_t>(std::min(255.0, 0.8 * gain * v + 20));
    const Result r = ego.step(wall.frame(i * 100'000'000));
    CHECK(r.valid);
    if (i == 0) continue;
    CHECK(std::abs(r.camera_in_previous.transform.x - 0.02) < 0.003);
    CHECK(std::abs(r.camera_in_previous.transform.z - 0.05) < 0.003);
  }
}

TEST_CASE("the faithful mode works on whole pixels") {
  Wall wall;
  EgoMotion ego;
  ego.configure(Wall::width, Wall::height, Parameters::faithful());
  wall.render(0, 0);
  ego.step(wall.frame(0));
  wall.render(0.04, 0);
  const Result r = ego.step(wall.frame(100'000'000));
  CHECK(std::abs(r.camera_in_previous.transform.x - 0.04) < 0.043);  // the thesis's own median error
  CHECK(r.matched > 50);
}

TEST_CASE("without texture the motion is predicted at constant velocity over the actual interval") {
  Wall wall;
  EgoMotion ego;
  ego.configure(Wall::width, Wall::height, {});
  wall.render(0, 0);
  ego.step(wall.frame(0));
  wall.render(0, 0.05);
  const Result measured = ego.step(wall.frame(100'000'000));
  REQUIRE(measured.valid);
  std::fill(wall.left.begin(), wall.left.end(), uint8_t{90});
  std::fill(wall.right.begin(), wall.right.end(), uint8_t{90});
  const Result predicted = ego.step(wall.frame(300'000'000));
  CHECK_FALSE(predicted.valid);
  CHECK(predicted.camera_in_previous.transform.z ==
        doctest::Approx(2 * measured.camera_in_previous.transform.z).epsilon(1e-6));
  wall.render(0, 0.20);
  CHECK_FALSE(ego.step(wall.frame(400'000'000)).valid);  // no corners in the blank frame
  wall.render(0, 0.25);
  CHECK(ego.step(wall.frame(500'000'000)).valid);
  ego.reset();
  CHECK(ego.step(wall.frame(600'000'000)).keyframe);
}

TEST_CASE("a refused motion says so, and the uncertainty of the pose grows by what nobody saw") {
  Wall wall;
  EgoMotion ego;
  ego.configure(Wall::width, Wall::height, {});
  const auto sigma = [](const takt::UncertainPose& pose) { return std::sqrt(pose.covariance[14]); };  // of z
  wall.render(0, 0);
  CHECK(sigma(ego.step(wall.frame(0)).pose) == 0);
  wall.render(0, 0.05);
  const Result measured = ego.step(wall.frame(100'000'000));
  CHECK(measured.valid);
  CHECK(sigma(measured.pose) > 0);
  CHECK(sigma(measured.pose) < 0.003);
  std::fill(wall.left.begin(), wall.left.end(), uint8_t{90});
  std::fill(wall.right.begin(), wall.right.end(), uint8_t{90});
  for (int i = 2; i <= 5; ++i) {
    const Result blind = ego.step(wall.frame(i * 100'000'000));
    CHECK_FALSE(blind.valid);
    CHECK_FALSE(blind.estimate.has_value());
    // Constant acceleration of 1 m/s^2 from the middle of the last measured interval on: a t (t + m) / 2.
    const double t = 0.1 * (i - 1);
    const double grown = 0.5 * t * (t + 0.1);
    CHECK(sigma(blind.pose) == doctest::Approx(std::hypot(grown, sigma(measured.pose))).epsilon(0.01));
  }
}

TEST_CASE("no motion is invented, in any mode: from a blank image, from noise, from another place") {
  Parameters parabola, window;
  parabola.subpixel = Subpixel::parabola;
  window.predict = Predict::none;
  for (const Parameters& p : {Parameters{}, parabola, window, Parameters::faithful()}) {
    Wall wall;
    const auto after = [&](auto change) {
      EgoMotion ego;
      ego.configure(Wall::width, Wall::height, p);
      wall.render(0, 0);
      ego.step(wall.frame(0));
      wall.render(0, 0.01);
      change();
      return ego.step(wall.frame(100'000'000));
    };
    std::mt19937 random(4);
    CHECK(after([] {}).valid);
    CHECK_FALSE(after([&] { std::fill(wall.left.begin(), wall.left.end(), uint8_t{90}); }).valid);
    CHECK_FALSE(after([&] {
                  for (auto* image : {&wall.left, &wall.right})
                    for (uint8_t& v : *image) v = static_cast<uint8_t>(random() % 256);
                }).valid);
    CHECK_FALSE(after([&] { wall.render(40, 0); }).valid);
  }
}

TEST_CASE("odometry answers where the images say nothing, and centres the search") {
  Parameters p;
  p.predict = Predict::odometry;
  p.r_const = 12;  // +-6 px around the prediction; the motion below is about 19 px
  Wall wall;
  EgoMotion ego;
  ego.configure(Wall::width, Wall::height, p);
  wall.render(0, 0);
  ego.step(wall.frame(0));
  wall.render(0.25, 0);
  Frame frame = wall.frame(100'000'000);
  frame.odometry = Rigid{Eigen::Matrix3d::Identity(), {0.26, 0, 0.01}};
  const Result found = ego.step(frame);
  CHECK(found.valid);
  CHECK(std::abs(found.camera_in_previous.transform.x - 0.25) < 0.003);

  std::fill(wall.left.begin(), wall.left.end(), uint8_t{90});
  frame = wall.frame(200'000'000);
  frame.odometry = Rigid{Eigen::Matrix3d::Identity(), {0.1, 0, 0}};
  const Result blind = ego.step(frame);
  CHECK_FALSE(blind.valid);
  CHECK(blind.camera_in_previous.transform.x == doctest::Approx(0.1));
  CHECK(std::sqrt(blind.camera_in_previous.covariance[0]) == doctest::Approx(0.1 * 0.1 + 0.002));

  EgoMotion lost;
  lost.configure(Wall::width, Wall::height, p);
  wall.render(0, 0);
  lost.step(wall.frame(0));
  wall.render(0.25, 0);
  CHECK_FALSE(lost.step(wall.frame(100'000'000)).valid);  // outside the window around where it was
}

TEST_CASE("a resumed pose goes on with the uncertainty of the gap") {
  Wall wall;
  EgoMotion ego;
  ego.configure(Wall::width, Wall::height, {});
  takt::UncertainPose known{{1, 2, 3}, {}};
  known.covariance[0] = 0.04;
  ego.resume(known, 1'000'000'000);
  wall.render(0, 0);
  const Result first = ego.step(wall.frame(1'500'000'000));
  CHECK_FALSE(first.valid);
  CHECK_FALSE(first.keyframe);
  CHECK(first.pose.transform.y == 2);
  CHECK(first.pose.covariance[0] == doctest::Approx(0.04 + 0.25 * 0.25));  // (a t^2)^2 with t = 0.5 s
  wall.render(0, 0.05);
  CHECK(ego.step(wall.frame(1'600'000'000)).valid);
}

TEST_CASE("colour and grey images give the same motion up to rounding; same input, same bits") {
  Wall a, b;
  a.render(0, 0);
  b.render(0.02, 0.03);
  const auto run = [&](bool colour) {
    EgoMotion ego;
    ego.configure(Wall::width, Wall::height, {});
    Result r;
    std::vector<uint8_t> left, right;
    int64_t stamp = 0;
    for (const Wall* wall : {&a, &b}) {
      Frame frame = wall->frame(stamp += 100'000'000);
      if (colour) {
        left.clear(), right.clear();
        for (uint8_t v : wall->left) left.insert(left.end(), 3, v);
        for (uint8_t v : wall->right) right.insert(right.end(), 3, v);
        frame.left = {left.data(), Wall::width, Wall::height, 3};
        frame.right = {right.data(), Wall::width, Wall::height, 3};
      }
      r = ego.step(frame);
    }
    return r;
  };
  const Result grey = run(false), again = run(false), colour = run(true);
  for (const Result& other : {again, colour}) {
    CHECK(std::memcmp(&grey.pose.transform, &other.pose.transform, sizeof(takt::Transform)) == 0);
    CHECK(grey.pose.covariance == other.pose.covariance);
  }
}

TEST_CASE("a step allocates nothing, in any mode, the first one included") {
  if (!takt::counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  Parameters planar = Parameters::faithful(), robust_planar;
  robust_planar.estimator.model = Model::planar;
  robust_planar.corner_candidates = true;
  Wall wall;
  for (const Parameters& p : {Parameters{}, planar, robust_planar}) {
    EgoMotion ego;
    ego.configure(Wall::width, Wall::height, p);
    for (int i = 0; i < 3; ++i) {
      wall.render(0.02 * i, 0.03 * i);
      const Frame frame = wall.frame(i * 100'000'000);
      const uint64_t before = takt::thread_memory_use().allocations;
      const Result r = ego.step(frame);
      CHECK(takt::thread_memory_use().allocations == before);
      CHECK(r.corners > 50);
    }
  }
}

TEST_CASE("parameters out of range are named with their value") {
  Parameters p;
  p.n_search = 8;
  CHECK(p.error().find("n_search is 8") == 0);
  CHECK_THROWS_WITH_AS(EgoMotion().configure(640, 480, p), doctest::Contains("n_search"), std::invalid_argument);
  CHECK_THROWS_WITH_AS(EgoMotion().configure(100, 480, {}), doctest::Contains("100 x 480"), std::invalid_argument);
}

TEST_CASE("the node type registers with its ports") {
  takt::NodeTypes types;
  takt::register_ego_motion(types);
  const auto* type = types.find("ego_motion");
  REQUIRE(type);
  const auto node = type->make();
  REQUIRE(node->inputs().size() == 4);
  CHECK(node->inputs()[0]->name() == "pair");
  CHECK(node->inputs()[1]->name() == "disparity");
  CHECK(node->inputs()[2]->name() == "odometry");
  REQUIRE(node->outputs().size() == 3);
  CHECK(node->outputs()[0]->name() == "motion");
  CHECK(node->outputs()[1]->name() == "pose");
  CHECK(node->outputs()[2]->name() == "robot_motion");
}
