// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <random>
#include <vector>

#include "nodes/body_pose/body_detector.hpp"
#include "nodes/body_pose/fitter.hpp"
#include "nodes/body_pose/generated_scene.hpp"
#include "nodes/body_pose/segmentation.hpp"
#include "rt/msg/point.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::body_pose;

namespace {

Skeleton shipped(const std::string& name) {
  return read_skeleton(std::string(TAKT_SOURCE_DIR) + "/graph/skeletons/" + name + ".txt");
}

const auto kWithoutEnd = [] { return true; };

void check_equal(const Fit& fast, const Fit& slow) {
  CHECK(fast.error == slow.error);
  CHECK(fast.pose == slow.pose);
  CHECK(fast.yaw_rad == slow.yaw_rad);
  CHECK(fast.fitted == slow.fitted);
  CHECK(fast.hidden == slow.hidden);
  for (size_t i = 0; i < kMostJoints; ++i)
    if (slow.fitted[i]) CHECK(fast.ends[i] == slow.ends[i]);
}

/// A cluster of a generated body, thinned so that the obvious way stays affordable.
std::vector<Point> thinned_body(const GeneratedScene& scene, size_t every) {
  std::vector<Point> points;
  size_t n = 0;
  const Eigen::Vector3d head = scene.body.joints[0];
  for (const Point& p : scene.in_floor) {
    const double x = p.x - head.x(), y = p.y - head.y();
    if (p.z > 0.08 && x * x + y * y < 0.9 && n++ % every == 0) points.push_back(p);
  }
  return points;
}

}  // namespace

TEST_CASE("the fit that does nothing twice is the one that does everything, bit by bit") {
  SceneCamera camera;
  for (const std::string name : {"human", "human_thesis", "crane"}) {
    const Skeleton skeleton = shipped(name);
    for (uint64_t seed = 1; seed <= test::rounds(name == "human" ? 4u : 2u); ++seed) {
      FitParameters p;
      p.rotations = static_cast<int>(1 + seed % 3);
      p.search_m = 0.1 + 0.1 * static_cast<double>(seed % 4);
      p.density_min = 0.15 * static_cast<double>(seed % 3);
      const GeneratedScene scene = name == "human" ? make_person(skeleton, camera, test::seed(seed), 0)
                                                   : make_any(skeleton, camera, test::seed(seed), 0);
      const std::vector<Point> points = thinned_body(scene, name == "crane" ? 4 : 12);
      REQUIRE(points.size() > 50);
      const Cluster cluster{points, scene.body.joints[0].cast<float>(), reference_density(points, p.tube_m),
                            eye_of(scene.camera_in_floor)};
      Fitter fitter(skeleton, p, points.size());
      const Fit slow = fit_reference(skeleton, p, cluster);
      check_equal(fitter.fit(cluster, kWithoutEnd), slow);
      check_equal(fitter.fit(cluster, kWithoutEnd), slow);  // and leaves nothing behind
    }
  }
}

TEST_CASE("the same in noise: points without any shape") {
  const Skeleton skeleton = shipped("human");
  std::mt19937_64 random(test::seed(7));
  std::uniform_real_distribution<float> across(-0.7f, 0.7f), up(0.1f, 1.8f);
  for (int round = 0; round < test::rounds(4); ++round) {
    FitParameters p;
    p.rotations = 2;
    p.density_min = 0.1 * round;
    std::vector<Point> points(static_cast<size_t>(60 + 80 * round));
    for (Point& q : points) q = {across(random), 2 + across(random), up(random)};
    const Cluster cluster{points, {0, 2, 1.6f}, reference_density(points, p.tube_m), {0.3f, 0, 1.2f}};
    Fitter fitter(skeleton, p, 400);
    check_equal(fitter.fit(cluster, kWithoutEnd), fit_reference(skeleton, p, cluster));
  }
}

TEST_CASE("regions grow from all heads at once as if every point asked every other in every round") {
  const Skeleton skeleton = shipped("human");
  SceneCamera camera;
  camera.step_px = 4;
  SegmentationParameters p;
  p.points_min = 40;
  p.density_min = 20;
  p.grow_m = 0.12;
  size_t candidates = 0;
  for (uint64_t seed = 1; seed <= test::rounds(6u); ++seed) {
    std::vector<Point> points;
    for (uint64_t person = 0; person < 2; ++person) {  // two whose regions touch
      for (Point q : make_person(skeleton, camera, test::seed(seed), person, false).in_floor) {
        q.x += person == 0 ? 0.0f : 0.3f;
        points.push_back(q);
      }
    }
    Segmentation segmentation(points.size(), p);
    const auto found = segmentation.run(points);
    candidates += found.size();
    const auto labels = grow_reference(p, segmentation.reduced(), segmentation.seeds());
    for (const Candidate& candidate : found) {
      size_t label = 0;
      while (segmentation.seeds()[label].head.x != candidate.head.x ||
             segmentation.seeds()[label].head.y != candidate.head.y)
        ++label;
      std::vector<Point> expected;
      for (size_t i = 0; i < labels.size(); ++i)
        if (labels[i] == static_cast<int32_t>(label)) expected.push_back(segmentation.reduced()[i]);
      REQUIRE(expected.size() == candidate.count);
      for (size_t i = 0; i < expected.size(); ++i)
        CHECK(squared_distance(expected[i], segmentation.points()[candidate.first + i]) == 0);
    }
  }
  CHECK(candidates >= test::at_scale(6));
}
