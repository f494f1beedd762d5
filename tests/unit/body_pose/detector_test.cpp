// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "nodes/body_pose/evaluate.hpp"
#include "nodes/body_pose/floor.hpp"
#include "nodes/body_pose/picture.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/point.hpp"
#include "tests/unit/body_pose/skeletons.hpp"

using namespace takt;
using namespace takt::body_pose;
using test::kWithoutEnd;
using test::shipped;

namespace {

const Eigen::Vector3f kEye(0, 0, 1.2f);

}  // namespace

TEST_CASE("equal seeds give equal scenes, others do not") {
  const Skeleton skeleton = shipped("human");
  const SceneCamera camera;
  const GeneratedScene a = make_person(skeleton, camera, 3, 1), b = make_person(skeleton, camera, 3, 1),
                       c = make_person(skeleton, camera, 3, 2);
  REQUIRE(a.points.size() == b.points.size());
  CHECK(std::equal(a.points.begin(), a.points.end(), b.points.begin(),
                   [](const Point& p, const Point& q) { return p.x == q.x && p.y == q.y && p.z == q.z; }));
  CHECK((a.body.joints[5] - c.body.joints[5]).norm() > 0.01);
  const Link& arm = skeleton.links[5];
  const double ratio = (a.body.joints[5] - a.body.joints[arm.parent]).norm() / arm.length_m;
  CHECK(ratio >= 0.85);
  CHECK(ratio <= 1.15);
}

TEST_CASE("generated people are found among furniture, and most point where they do") {
  SceneCamera camera;
  BodyDetector detector(shipped("human"), {}, 100'000);
  const Figures figures = measure_people(detector, camera, 5, 20);
  CHECK(figures.trials == 20);
  CHECK(figures.found >= 18);
  CHECK(figures.extra <= 2);
  CHECK(figures.right >= 14);  // 15 were measured, 19 found, 2 extra
}

TEST_CASE("heads are told apart whose people stand shoulder to shoulder") {
  const Skeleton skeleton = shipped("human");
  constexpr float kApart_m = 0.36f;  // the reach of a head that was looked at as a ball took in the other one
  BodyDetector detector(skeleton, {}, 200'000);
  int both = 0;
  for (uint64_t i = 0; i < 10; ++i) {
    const GeneratedScene scene = make_person(skeleton, {}, 11, i, false);
    std::vector<Point> points = scene.in_floor;
    for (const Point& p : scene.in_floor) points.push_back({p.x + kApart_m, p.y, p.z});
    detector.run(points, eye_of(scene.camera_in_floor), [] { return false; });
    const auto is_seed = [&](float beside_m) {
      const Eigen::Vector3d& head = scene.body.joints[0];
      const auto seeds = detector.segmentation().seeds();
      return std::any_of(seeds.begin(), seeds.end(), [&](const Seed& seed) {
        return std::hypot(seed.head.x - head.x() - beside_m, seed.head.y - head.y()) < 0.15;
      });
    };
    both += is_seed(0) && is_seed(kApart_m) ? 1 : 0;
  }
  CHECK(both >= 8);
}

TEST_CASE("a crane is fitted by the same code: its jib as it stands, hardly a link missing") {
  FitParameters p;
  p.search_m = 0.5;  // its links are longer than those of a person
  const Figures figures = measure_any(shipped("crane"), p, {}, 1, 10);
  CHECK(figures.found == 10);
  CHECK(figures.right == 10);
  CHECK(*std::max_element(figures.angle_deg.begin(), figures.angle_deg.end()) < 20);
  CHECK(figures.links == 50);
  CHECK(figures.missing <= 3);
}

TEST_CASE("an empty room, an empty cloud and points that are not finite hold nobody") {
  BodyDetector detector(shipped("human"), {}, 1000);
  CHECK(detector.run({}, kEye, kWithoutEnd).empty());
  CHECK(detector.searched() == 1);
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  const std::vector<Point> points{{nan, 1, 1}, {1, infinite, 1}, {1, 1, nan}, {0, 2, 1.5f}};
  CHECK(detector.run(points, kEye, kWithoutEnd).empty());
  std::vector<Point> wall;
  for (int i = 0; i < 900; ++i)
    wall.push_back({static_cast<float>(i % 30) * 0.03f, 2, static_cast<float>(i) * 0.002f + 0.1f});
  CHECK(detector.run(wall, kEye, kWithoutEnd).empty());
}

TEST_CASE("more points than there is memory for are left out; nothing is allocated") {
  const GeneratedScene scene = make_person(shipped("human"), {}, 1, 0);
  BodyDetector detector(shipped("human"), {}, scene.in_floor.size() / 2), whole(shipped("human"), {}, 200'000);
  detector.run(scene.in_floor, eye_of(scene.camera_in_floor), kWithoutEnd);
  const uint64_t before = thread_memory_use().allocations;
  whole.run(scene.in_floor, eye_of(scene.camera_in_floor), kWithoutEnd);
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
}

TEST_CASE("time that ends leaves candidates out and says how much was tried") {
  const Skeleton skeleton = shipped("human");
  BodyDetector detector(skeleton, {}, 200'000);
  const GeneratedScene scene = make_person(skeleton, {}, 1, 2);
  detector.run(scene.in_floor, eye_of(scene.camera_in_floor), [] { return false; });
  REQUIRE_FALSE(detector.candidates().empty());
  CHECK(detector.searched() == doctest::Approx(1.0 / 11 / static_cast<double>(detector.candidates().size())));
}

TEST_CASE("the floor is found with the camera's height and tilt; a wall is no floor") {
  for (const double tilt : {-0.5, -0.2, 0.0}) {
    SceneCamera camera;
    camera.tilt_rad = tilt;
    const GeneratedScene scene = make_person(shipped("human"), camera, 2, 0);
    const auto found = find_floor(scene.points, {});
    REQUIRE(found);
    CHECK(found->z == doctest::Approx(camera.height_m).epsilon(0.03));
    const mapping_3d::Affine a = mapping_3d::to_affine(*found), b = mapping_3d::to_affine(scene.camera_in_floor);
    for (int i = 0; i < 9; ++i) CHECK(a.r[i] == doctest::Approx(b.r[i]).epsilon(0.03).scale(1));
  }
  std::vector<Point> wall;
  for (int i = 0; i < 900; ++i) wall.push_back({static_cast<float>(i % 30) * 0.03f, static_cast<float>(i) * 0.001f, 2});
  CHECK_FALSE(find_floor(wall, {}));
  CHECK_FALSE(find_floor({}, {}));
}

TEST_CASE("a message says what is missing; a pointing ray begins at the shoulder") {
  const Skeleton skeleton = shipped("human");
  DetectedBody body;
  for (size_t i = 0; i < 16; ++i) body.fit.ends[i] = {static_cast<float>(i), 2, 1}, body.fit.fitted[i] = i != 7;
  body.fit.hidden[4] = true;
  body.valid = true;
  const Body told = to_message(skeleton, body);
  CHECK(told.joints[3].fitted == 1);
  CHECK(told.joints[3].x == 3);
  CHECK(told.joints[4].fitted == 0.5f);
  CHECK(told.joints[4].x == 4);
  CHECK(told.joints[7].fitted == 0);
  CHECK(told.joints[7].x == 0);
  const size_t side = skeleton.pointers[0].to == 7 ? 1 : 0;  // the arm that is all there
  CHECK(told.pointing[side].x == static_cast<float>(skeleton.pointers[side].from));
  CHECK(std::abs(told.pointing[side].dx) == 1);
  CHECK((skeleton.pointers[1 - side].to != 7 || told.pointing[1 - side].dx == 0));
}

TEST_CASE("the picture shows a skeleton over image and cloud") {
  const Skeleton skeleton = shipped("human");
  const GeneratedScene scene = make_person(skeleton, {}, 1, 0);
  DetectedBody body;
  for (size_t i = 0; i < 16; ++i) body.fit.ends[i] = scene.body.joints[i].cast<float>(), body.fit.fitted[i] = true;
  const cv::Mat image(480, 640, CV_8UC3, cv::Scalar(0, 0, 0));
  const auto draw = [&](std::span<const DetectedBody> bodies) {
    return draw_bodies(image, scene.camera, scene.camera_in_floor, scene.in_floor, skeleton, bodies);
  };
  const cv::Mat with = draw({&body, 1}), without = draw({});
  CHECK(with.size() == cv::Size(640 + 480, 480));
  CHECK(cv::norm(with.colRange(0, 640), without.colRange(0, 640)) > 0);
  CHECK(cv::norm(with.colRange(640, 1120), without.colRange(640, 1120)) > 0);
}
