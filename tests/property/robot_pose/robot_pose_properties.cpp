// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "tests/property_scale.hpp"
#include "tests/unit/robot_pose/generated_drive.hpp"

using namespace takt::robot_pose;
using takt::test::Arrival;
using takt::test::GeneratedDrive;

TEST_CASE("whatever the order of arrival, the estimate is that of all measurements in the order of their stamps") {
  std::mt19937_64 random(takt::test::seed(1));
  size_t late = 0;
  for (uint64_t seed = 1; seed <= takt::test::rounds(20u); ++seed) {
    GeneratedDrive drive(takt::test::seed(seed), 8, {});
    for (Arrival& arrival : drive.arrivals)  // up to 0.3 s late, those of one source in their order
      arrival.arrives_ns = arrival.measured.to_ns + 150'000'000 * static_cast<int64_t>(arrival.measured.source) +
                           std::uniform_int_distribution<int64_t>(0, 60'000'000)(random);
    std::vector<Measured> by_stamp, by_arrival;
    const auto collect = [&](std::vector<Measured>& into) {
      for (const Arrival& arrival : drive.arrivals) into.push_back(arrival.measured);
    };
    std::sort(drive.arrivals.begin(), drive.arrivals.end(),
              [](const Arrival& a, const Arrival& b) { return a.arrives_ns < b.arrives_ns; });
    collect(by_arrival);
    std::sort(drive.arrivals.begin(), drive.arrivals.end(), [](const Arrival& a, const Arrival& b) {
      return std::pair(a.measured.to_ns, a.measured.source) < std::pair(b.measured.to_ns, b.measured.source);
    });
    collect(by_stamp);
    PoseFilter ordered({}), disordered({});
    for (const Measured& m : by_stamp) ordered.add(m);
    int64_t newest = 0;
    for (const Measured& m : by_arrival) {
      CHECK(disordered.add(m) != Taken::too_late);
      late += m.to_ns < newest;
      newest = std::max(newest, m.to_ns);
    }
    const Estimate a = ordered.newest(), b = disordered.newest();
    CHECK(a.stamp_ns == b.stamp_ns);
    CHECK(a.robot_in_map.x_m == b.robot_in_map.x_m);
    CHECK(a.robot_in_map.y_m == b.robot_in_map.y_m);
    CHECK(a.robot_in_map.theta_rad == b.robot_in_map.theta_rad);
    CHECK(a.covariance == b.covariance);
  }
  CHECK(late >= takt::test::at_scale(500));
}
