// SPDX-License-Identifier: Apache-2.0
#include "rt/transform/transform_buffer.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/nanoseconds.hpp"

using namespace takt;
using test::kMs;

namespace {

UncertainPose at_x(double x, double variance = 0) {
  UncertainPose pose;
  pose.transform.x = x;
  for (size_t i = 0; i < 36; i += 7) pose.covariance[i] = variance;
  return pose;
}

UncertainPose yaw(double angle) {
  UncertainPose pose;
  pose.transform.qw = std::cos(angle / 2);
  pose.transform.qz = std::sin(angle / 2);
  return pose;
}

}  // namespace

TEST_CASE("a track answers at the stamp asked for, or says why not") {
  PoseTrack track(3, 100 * kMs);
  CHECK(track.at(5).error().problem == TransformProblem::empty);
  CHECK(track.insert(100 * kMs, at_x(1, 4)) == InsertResult::inserted);
  CHECK(track.at(100 * kMs)->transform.x == 1);
  CHECK(track.at(99 * kMs).error().problem == TransformProblem::too_old);
  CHECK(track.at(101 * kMs).error().problem == TransformProblem::too_new);
  CHECK(track.insert(200 * kMs, at_x(3, 8)) == InsertResult::inserted);
  const auto middle = track.at(150 * kMs);
  REQUIRE(middle);
  CHECK(middle->transform.x == doctest::Approx(2));
  CHECK(middle->covariance[0] == doctest::Approx(6));
  CHECK(track.insert(301 * kMs, at_x(5)) == InsertResult::inserted);
  const auto gap = track.at(250 * kMs);
  REQUIRE_FALSE(gap);
  CHECK(gap.error().problem == TransformProblem::gap_too_long);
  CHECK(gap.error().oldest_ns == 200 * kMs);
  CHECK(gap.error().newest_ns == 301 * kMs);
  CHECK(track.at(301 * kMs)->transform.x == 5);  // a measured pose needs no neighbour
}

TEST_CASE("a full track drops its oldest pose and nothing newer") {
  PoseTrack track(3, 1000);
  for (int64_t stamp : {10, 20, 30, 40}) track.insert(stamp, at_x(static_cast<double>(stamp)));
  CHECK(track.size() == 3);
  CHECK(track.at(15).error().problem == TransformProblem::too_old);
  CHECK(track.at(20)->transform.x == 20);
  CHECK(track.insert(19, at_x(19)) == InsertResult::out_of_range);
  CHECK(track.insert(35, at_x(35)) == InsertResult::inserted);  // 20 makes room for a late one
  CHECK(track.at(35)->transform.x == 35);
  CHECK(track.at(30)->transform.x == 30);
  CHECK(track.at(29).error().problem == TransformProblem::too_old);
  CHECK(track.insert(35, at_x(36)) == InsertResult::replaced);
  CHECK(track.at(35)->transform.x == 36);
  CHECK(track.size() == 3);
}

TEST_CASE("poses that are no poses are refused") {
  PoseTrack track(3, 1000);
  UncertainPose bad;
  bad.transform.qw = 0;
  CHECK(track.insert(1, bad) == InsertResult::invalid);
  bad.transform.qw = 1;
  bad.covariance[7] = std::numeric_limits<double>::quiet_NaN();
  CHECK(track.insert(1, bad) == InsertResult::invalid);
  bad.covariance[7] = 0;
  bad.transform.y = std::numeric_limits<double>::infinity();
  CHECK(track.insert(1, bad) == InsertResult::invalid);
  CHECK(track.size() == 0);
  UncertainPose scaled = yaw(1.0);
  scaled.transform.qw *= 3;
  scaled.transform.qz *= 3;
  track.insert(1, scaled);
  CHECK(track.at(1)->transform.qw == doctest::Approx(std::cos(0.5)));
}

TEST_CASE("rotation is interpolated along the shorter arc") {
  PoseTrack track(4, 1000);
  track.insert(0, yaw(3.0));
  UncertainPose other = yaw(-3.0);  // 0.283 rad further on, over pi
  track.insert(100, other);
  const auto middle = track.at(50);
  REQUIRE(middle);
  CHECK(std::abs(middle->transform.qz) == doctest::Approx(1));  // pi
}

TEST_CASE("a chain is composed at one stamp, in both directions and sideways") {
  TransformBuffer buffer;
  const FrameId map = buffer.frame("map"), robot = buffer.frame("robot"), head = buffer.frame("head"),
                laser = buffer.frame("laser");
  CHECK(buffer.frame("robot") == robot);
  buffer.add(map, robot, 8, 100);
  buffer.add(robot, head, 8, 100);
  UncertainPose mount = at_x(0.5);
  buffer.add_fixed(robot, laser, mount);
  UncertainPose turned = yaw(M_PI / 2);
  turned.transform.x = 10;
  CHECK(buffer.insert(robot, 0, turned) == InsertResult::inserted);
  CHECK(buffer.insert(robot, 50, turned) == InsertResult::inserted);
  CHECK(buffer.insert(head, 0, at_x(1)) == InsertResult::inserted);
  CHECK(buffer.insert(head, 50, at_x(2)) == InsertResult::inserted);
  const auto head_in_map = buffer.lookup(map, head, 25);
  REQUIRE(head_in_map);
  CHECK(head_in_map->transform.x == doctest::Approx(10));
  CHECK(head_in_map->transform.y == doctest::Approx(1.5));
  const auto map_in_head = buffer.lookup(head, map, 25);
  REQUIRE(map_in_head);
  CHECK(map_in_head->transform.x == doctest::Approx(-1.5));
  CHECK(map_in_head->transform.y == doctest::Approx(10));
  const auto head_in_laser = buffer.lookup(laser, head, 25);
  REQUIRE(head_in_laser);
  CHECK(head_in_laser->transform.x == doctest::Approx(1.0));
  CHECK(buffer.lookup(head, head, -99)->transform.x == 0);
  CHECK(buffer.lookup(robot, laser, 1 << 30)->transform.x == doctest::Approx(0.5));  // a fixed pose is always known
}

TEST_CASE("an error names the pair at fault") {
  TransformBuffer buffer;
  const FrameId map = buffer.frame("map"), robot = buffer.frame("robot"), head = buffer.frame("head"),
                moon = buffer.frame("moon");
  buffer.add(map, robot, 8, 100);
  buffer.add(robot, head, 8, 100);
  buffer.insert(robot, 1'000'000'000, at_x(0));
  buffer.insert(head, 1'200'000'000, at_x(0));
  const auto missing = buffer.lookup(map, head, 1'200'000'000);
  REQUIRE_FALSE(missing);
  CHECK(missing.error().problem == TransformProblem::too_new);
  CHECK(missing.error().child == robot);
  CHECK(missing.error().parent == map);
  CHECK(buffer.describe(missing.error()) == "robot in map at 1.200000 s: too new, the newest pose is from 1.000000 s");
  CHECK(buffer.lookup(map, moon, 0).error().problem == TransformProblem::unknown_frame);
  CHECK(buffer.lookup(map, 99, 0).error().problem == TransformProblem::unknown_frame);
  CHECK(buffer.describe(buffer.lookup(map, moon, 0).error()).find("moon in map") == 0);
  CHECK(buffer.insert(moon, 0, at_x(0)) == InsertResult::invalid);
}

TEST_CASE("frames form a forest") {
  TransformBuffer buffer;
  const FrameId a = buffer.frame("a"), b = buffer.frame("b"), c = buffer.frame("c");
  buffer.add(a, b, 1, 1);
  buffer.add(b, c, 1, 1);
  CHECK_THROWS_AS(buffer.add(c, a, 1, 1), std::invalid_argument);
  CHECK_THROWS_AS(buffer.add(a, c, 1, 1), std::invalid_argument);
  CHECK_THROWS_AS(buffer.add(a, a, 1, 1), std::invalid_argument);
  const FrameId d = buffer.frame("d");
  CHECK_THROWS_AS(buffer.add(a, d, 0, 1), std::invalid_argument);
  CHECK_THROWS_AS(buffer.add(a, d, 1, 0), std::invalid_argument);
  CHECK_THROWS_AS(buffer.add(a, 77, 1, 1), std::invalid_argument);
}
