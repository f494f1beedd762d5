// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "hal/replay/carmen_log.hpp"
#include "hal/replay/late_stamps.hpp"
#include "tests/property_scale.hpp"
#include "tests/unit/replay/carmen_file.hpp"

using namespace takt;
using namespace takt::replay;
using namespace takt::test;

namespace {

/// A stamp is trusted if every later one is greater; what lies between two of them is spread evenly. Word for word.
LineTimes reference(const std::vector<double>& seconds) {
  LineTimes lines;
  lines.time_ns.resize(seconds.size());
  std::vector<size_t> trusted;
  for (size_t i = 0; i < seconds.size(); ++i) {
    lines.time_ns[i] = std::llround(seconds[i] * 1e9);
    bool all_greater = true;
    for (size_t k = i + 1; k < seconds.size(); ++k) all_greater = all_greater && seconds[k] > seconds[i];
    if (all_greater) trusted.push_back(i);
  }
  lines.first_known = trusted.empty() ? 0 : trusted[0];
  for (size_t t = 1; t < trusted.size(); ++t) {
    const double from = seconds[trusted[t - 1]], to = seconds[trusted[t]];
    for (size_t i = trusted[t - 1] + 1; i < trusted[t]; ++i) {
      const double share = static_cast<double>(i - trusted[t - 1]) / static_cast<double>(trusted[t] - trusted[t - 1]);
      lines.time_ns[i] = std::llround((from + share * (to - from)) * 1e9);
      ++lines.late;
    }
  }
  return lines;
}

}  // namespace

TEST_CASE("late stamps: agrees with the definition, and never falls") {
  std::mt19937 random(test::seed(7));
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int round = 0; round < test::rounds(300); ++round) {
    std::vector<double> seconds;
    double now = uniform(0, 100);
    for (int i = static_cast<int>(uniform(0, 60)); i > 0; --i) {
      now += uniform(0.001, 0.3);
      const double late = uniform(0, 1) < 0.3 ? uniform(0, 1) : 0;
      // Stamps as logs have them, with few digits: equal ones occur.
      seconds.push_back(std::round((now + late) * 100) / 100);
    }
    const LineTimes fast = repair_late_stamps(seconds), slow = reference(seconds);
    REQUIRE(fast.time_ns.size() == seconds.size());
    CHECK(fast.first_known == slow.first_known);
    CHECK(fast.late == slow.late);
    for (size_t i = fast.first_known; i < seconds.size(); ++i) {
      CHECK(std::abs(fast.time_ns[i] - slow.time_ns[i]) <= 100);  // seconds as double: 1e-14 of 100 s and rounding
      if (i > fast.first_known) CHECK(fast.time_ns[i] >= fast.time_ns[i - 1]);
      CHECK(fast.time_ns[i] <= std::llround(seconds[i] * 1e9));  // a stamp is late, never early
    }
  }
}

TEST_CASE("a drive whose poses a mapping program corrected gives back its odometry") {
  std::mt19937 random(test::seed(11));
  std::normal_distribution<double> normal;
  for (int round = 0; round < test::rounds(20); ++round) {
    std::string text;
    PlanarPose odometry, correction;  // correction: frame of the odometry in the map, changes with each scan
    std::vector<PlanarPose> lines, corrected;
    double t = 0;
    for (int k = 0; k < 200; ++k) {
      odometry = compose(odometry, {0.1 + 0.05 * normal(random), 0.01 * normal(random), 0.1 * normal(random)});
      lines.push_back(odometry);
      text += odom_line(t += 0.1, compose(correction, odometry));
      if (k % 7 != 3) continue;
      const PlanarPose pose =
          compose(compose(correction, odometry), {0.1 * normal(random), 0.1 * normal(random), 0.05 * normal(random)});
      corrected.push_back(pose);
      correction = compose(pose, between(odometry, {}));
      text += flaser_line(t, 4, 1, pose) + odom_line(0, pose) + "NEFF 3.5\n";
    }
    const CarmenFile file(text);
    const auto log = load_carmen_log("laser", file.path);
    REQUIRE(log.has_value());
    REQUIRE(log->odometry.size() == lines.size());
    for (size_t i = 0; i < lines.size(); ++i) {
      const PlanarPose error = between(lines[i], log->odometry[i].pose);
      CHECK(std::hypot(error.x_m, error.y_m) < 1e-8);
      CHECK(std::abs(error.theta_rad) < 1e-9);
    }
    const auto truth = corrected_poses(*log);
    REQUIRE(truth.size() == corrected.size());
    for (size_t i = 0; i < truth.size(); ++i) CHECK(truth[i].pose.x_m == doctest::Approx(corrected[i].x_m));
  }
}

TEST_CASE("a damaged log is refused or read, and what is read is consistent") {
  std::mt19937 random(test::seed(13));
  std::string good;
  for (int k = 0; k < 12; ++k) {
    const PlanarPose pose{0.1 * k, 0, 0.01 * k};
    good += odom_line(k, pose) + (k % 2 ? flaser_line(k, 5, 1, pose) : "SYNC a 0 host 0\n");
    if (k % 4 == 3) good += odom_line(0, pose) + "NEFF 2\n";
  }
  constexpr char kBytes[] = "0123456789.-+e \n\r\tnaifODOMFLASERNEFF#\0\xff";
  int refused = 0, read = 0;
  for (int round = 0; round < test::rounds(600); ++round) {
    std::string text = good;
    for (int changes = 1 + round % 4; changes > 0 && !text.empty(); --changes) {
      const size_t at = random() % text.size();
      switch (random() % 4) {
        case 0: text[at] = kBytes[random() % (sizeof kBytes - 1)]; break;
        case 1: text.erase(at, 1 + random() % 30); break;
        case 2: text.insert(at, text.substr(random() % text.size(), random() % 60)); break;
        default: text.resize(at + 1); break;
      }
    }
    const CarmenFile file(text);
    const auto log = load_carmen_log("laser", file.path);
    if (!log) {
      ++refused;
      CHECK(log.error().what.find(file.path.string()) == 0);
      continue;
    }
    ++read;
    CHECK(log->range_m.size() == log->scans.size() * log->beams);
    for (size_t i = 1; i < log->odometry.size(); ++i) CHECK(log->odometry[i].time_ns >= log->odometry[i - 1].time_ns);
    for (const CarmenScan& scan : log->scans) CHECK(scan.time_ns <= log->end_ns);
  }
  CHECK(refused >= test::at_scale(50));
  CHECK(read >= test::at_scale(50));
}
