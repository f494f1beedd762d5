// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_pose/pose_filter.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>

#include "rt/memory/memory_use.hpp"
#include "tests/unit/robot_pose/generated_drive.hpp"

using namespace takt;
using namespace takt::robot_pose;
using takt::test::Arrival;
using takt::test::GeneratedDrive;
using takt::test::normalised_error_squared;

namespace {

// Slow turns: over 10 s the errors stay small enough for first order.
FilterParameters calm() {
  FilterParameters p;
  p.acceleration = 0.2;
  p.turn_acceleration = 0.2;
  p.begin_turn_rad_s = 0.2;
  return p;
}

struct Consistency {
  double nees = 0, error_m = 0;  ///< means over the drives, at their end
  size_t rejected = 0, used = 0;
};

/// `heard`: whether a measurement arrives.
Consistency drive(const std::function<bool(const Arrival&)>& heard, size_t drives = 100) {
  Consistency out;
  for (size_t seed = 1; seed <= drives; ++seed) {
    const GeneratedDrive drive(seed, 10, calm());
    PoseFilter filter(calm());
    for (const Arrival& arrival : drive.arrivals) {
      if (!heard(arrival)) continue;
      const Taken taken = filter.add(arrival.measured);
      out.rejected += taken == Taken::rejected;
      out.used += taken == Taken::used;
    }
    const Estimate end = filter.newest();
    const PlanarPose& truth = drive.at(end.stamp_ns);
    out.nees += normalised_error_squared(end, truth) / static_cast<double>(drives);
    out.error_m +=
        std::hypot(end.robot_in_map.x_m - truth.x_m, end.robot_in_map.y_m - truth.y_m) / static_cast<double>(drives);
  }
  return out;
}

bool from(const Arrival& arrival, Source source) { return arrival.measured.source == source; }

}  // namespace

// The mean of 100 normalised errors of three degrees of freedom has a standard deviation of sqrt(6 / 100) = 0.24; the
// band is 3 +-3.3 of them.
TEST_CASE("consistency: the error is as large as the covariance says, whoever is heard; more sensors, less error") {
  const Consistency all = drive([](const Arrival&) { return true; });
  const Consistency wheels = drive([](const Arrival& a) { return from(a, Source::wheels); });
  const Consistency no_wheels = drive([](const Arrival& a) { return !from(a, Source::wheels); });
  const Consistency scans = drive([](const Arrival& a) { return from(a, Source::scans); });
  const Consistency wheels_lost =
      drive([](const Arrival& a) { return !from(a, Source::wheels) || a.arrives_ns < 4'000'000'000; });
  const Consistency others_lost =
      drive([](const Arrival& a) { return from(a, Source::wheels) || a.arrives_ns < 4'000'000'000; });
  const Consistency third_lost = drive([](const Arrival& a) {  // those of the beginning apart, where the pose is known
    return a.measured.to_ns <= 200'000'000 || a.measured.to_ns / 7'000'000 % 3 != 0;
  });
  for (const Consistency* c : {&all, &wheels, &no_wheels, &scans, &wheels_lost, &others_lost, &third_lost}) {
    MESSAGE("nees ", c->nees, ", error m ", c->error_m, ", used ", c->used, ", rejected ", c->rejected);
    CHECK(c->nees > 2.2);
    CHECK(c->nees < 3.8);
    // Once in a thousand, and a hundredth of all is far from that.
    CHECK(static_cast<double>(c->rejected) < 0.01 * static_cast<double>(c->used));
  }
  CHECK(all.error_m < 0.8 * wheels.error_m);
  CHECK(no_wheels.error_m < wheels.error_m);
  CHECK(all.error_m < 1.25 * no_wheels.error_m);
}

TEST_CASE("speed and turn rate come out of the motions, and predict the pose") {
  PoseFilter filter({});
  for (int i = 0; i < 100; ++i) {
    const int64_t from_ns = i * 100'000'000LL;
    const PlanarPose arc{-0.05 * std::sin(0.025) * 1, 0.05 * std::cos(0.025), 0.05};  // 0.5 m/s, 0.5 rad/s
    filter.add({Source::wheels, from_ns, from_ns + 100'000'000, arc, 1e-6 * Covariance::Identity()});
  }
  const Estimate now = filter.newest();
  CHECK(now.stamp_ns == 10'000'000'000);
  CHECK(now.speed_m_s == doctest::Approx(0.5).epsilon(0.02));
  CHECK(now.turn_rad_s == doctest::Approx(0.5).epsilon(0.02));
  // A circle of 1 m about (-1, 0), begun along y.
  CHECK(now.robot_in_map.x_m == doctest::Approx(std::cos(5) - 1).epsilon(0.03));
  CHECK(now.robot_in_map.y_m == doctest::Approx(std::sin(5)).epsilon(0.03));
  const Estimate later = filter.predicted(now.stamp_ns + 200'000'000);
  CHECK(later.robot_in_map.y_m == doctest::Approx(std::sin(5.1)).epsilon(0.03));
  CHECK(later.covariance(0, 0) > now.covariance(0, 0));
}

TEST_CASE("a motion that cannot be is rejected; after a second without any that could be, it is believed") {
  PoseFilter filter({});
  const auto standing = [&](int i) {
    const int64_t from_ns = i * 100'000'000LL;
    return Measured{Source::scans, from_ns, from_ns + 100'000'000, {}, 1e-6 * Covariance::Identity()};
  };
  for (int i = 0; i < 10; ++i) filter.add(standing(i));
  Measured jump = standing(10);
  jump.robot_in_previous = {2, 0, 0};
  CHECK(filter.add(jump) == Taken::rejected);
  CHECK(std::abs(filter.newest().robot_in_map.x_m) < 0.01);
  CHECK(filter.add(standing(11)) == Taken::used);  // goes on at once
  for (int i = 12; i < 22; ++i) {
    jump = standing(i);
    jump.robot_in_previous = {2, 0, 0};
    CHECK(filter.add(jump) == Taken::rejected);
  }
  jump = standing(22);
  jump.robot_in_previous = {2, 0, 0};
  CHECK(filter.add(jump) == Taken::used);
}

TEST_CASE("an interval that was not measured, or whose begin is unknown, is not used; the next one is") {
  PoseFilter filter({});
  const auto step = [](int64_t from_ms, int64_t to_ms) {
    return Measured{Source::scans, from_ms * 1'000'000, to_ms * 1'000'000, {0, 0.1, 0}, 1e-6 * Covariance::Identity()};
  };
  CHECK(filter.add(step(0, 100)) == Taken::used);
  CHECK(filter.add(step(150, 200)) == Taken::begun);
  CHECK(filter.add(step(200, 300)) == Taken::used);
  Measured blind = step(300, 400);
  blind.valid = false;
  CHECK(filter.add(blind) == Taken::begun);
  CHECK(filter.add(step(400, 500)) == Taken::used);
  CHECK(filter.add(step(400, 500)) == Taken::too_late);  // known already
}

TEST_CASE("what is older than the history is told and changes nothing") {
  PoseFilter filter({}, 4);
  for (int64_t i = 0; i < 10; ++i)
    filter.add({Source::wheels, i * 100'000'000, (i + 1) * 100'000'000, {0, 0.1, 0}, 1e-6 * Covariance::Identity()});
  const Estimate before = filter.newest();
  CHECK(filter.add({Source::scans, 0, 200'000'000, {3, 3, 3}, 1e-6 * Covariance::Identity()}) == Taken::too_late);
  CHECK(filter.newest().robot_in_map.y_m == before.robot_in_map.y_m);
  CHECK(filter.newest().covariance == before.covariance);
}

TEST_CASE("the covariance of a step is found again in the poses that were compounded with it") {
  using takt::scan_matching::spatial;
  Covariance a, step;
  a << 4, 1, 0.5, 1, 3, 0.2, 0.5, 0.2, 2;
  step << 0.04, 0.01, 0, 0.01, 0.09, 0.002, 0, 0.002, 0.01;
  const takt::UncertainPose from = spatial({3, -2, 2.2}, a);
  const takt::UncertainPose to = compose(from, spatial({0.4, 1.5, -0.7}, step));
  CHECK(step_covariance(from, to).isApprox(step, 1e-9));
}

TEST_CASE("no measurement allocates, a late one neither") {
  if (!takt::counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  const GeneratedDrive drive(1, 10, calm());
  PoseFilter filter(calm(), 16);
  for (const Arrival& arrival : drive.arrivals) {
    const uint64_t before = takt::thread_memory_use().allocations;
    filter.add(arrival.measured);
    filter.newest();
    CHECK(takt::thread_memory_use().allocations == before);
  }
}
