// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "nodes/obstacle_stop/protected_field.hpp"
#include "tests/property_scale.hpp"

using namespace takt::obstacle_stop;

namespace {

double from_footprint_m(const Footprint& f, double x, double y) {
  return std::hypot(std::max(std::abs(x) - f.half_width_m, 0.0), std::max({-f.rear_m - y, y - f.front_m, 0.0}));
}

/// In the margin beyond the edge that trails, while the robot drives on a circle wider than itself or a line, by a
/// quarter turn at most.
bool left_behind(const Footprint& f, const Drive& d, double time_s, double x, double y) {
  const bool gently = std::abs(d.turn_rad_s) * (f.half_width_m + f.margin_m) < std::abs(d.speed_m_s) &&
                      std::abs(d.turn_rad_s) * time_s <= std::numbers::pi / 2;
  return gently && from_footprint_m(f, x, y) <= f.margin_m && (d.speed_m_s < 0 ? y > f.front_m : y < -f.rear_m);
}

/// The swept area the slow way: the robot is moved on in steps of at most a millimetre and half a milliradian, and each
/// time asked how far it is from the point.
class Way {
 public:
  Way(const Drive& d, double time_s) : drive_(d), time_s_(time_s) {
    const int steps = 1 + static_cast<int>(std::max(std::abs(d.speed_m_s), 2 * std::abs(d.turn_rad_s)) * time_s / 1e-3);
    const double dt = time_s / steps;
    double x = 0, y = 0;
    for (int i = 0; i <= steps; ++i) {
      const double heading = d.turn_rad_s * dt * i, middle = heading + d.turn_rad_s * dt / 2;
      poses_.push_back({x, y, std::cos(heading), std::sin(heading)});
      x -= d.speed_m_s * dt * std::sin(middle);
      y += d.speed_m_s * dt * std::cos(middle);
    }
  }
  bool covers(const Footprint& f, double x, double y) const {
    if (left_behind(f, drive_, time_s_, x, y)) return false;
    return std::any_of(poses_.begin(), poses_.end(), [&](const Pose& p) {
      const double across = p.cosine * (x - p.x) + p.sine * (y - p.y);
      const double along = -p.sine * (x - p.x) + p.cosine * (y - p.y);
      return from_footprint_m(f, across, along) <= f.margin_m;
    });
  }

 private:
  struct Pose {
    double x, y, cosine, sine;
  };
  Drive drive_;
  double time_s_;
  std::vector<Pose> poses_;
};

Footprint grown(Footprint f, double by) { return {f.half_width_m, f.front_m, f.rear_m, f.margin_m + by}; }

struct RandomDrive {
  std::mt19937 engine{takt::test::seed(7)};
  double operator()(double low, double high) { return std::uniform_real_distribution<>(low, high)(engine); }
  Footprint footprint() { return {(*this)(0.1, 0.5), (*this)(0.1, 0.7), (*this)(0.1, 0.7), (*this)(0, 0.3)}; }
  /// Straight, turning on the spot, nearly straight, backwards, and all between.
  Drive drive(int round) {
    const double speed = round % 5 == 0 ? 0 : (*this)(-0.8, 1.5);
    const double turn = round % 7 == 0 ? 0 : round % 3 == 0 ? (*this)(-1e-4, 1e-4) : (*this)(-2, 2);
    return {speed, turn};
  }
};

// What the steps may miss: half a step of a corner at most 3 m from the centre of the turn.
constexpr double kStep_m = 2e-3;

}  // namespace

TEST_CASE("the protected field is the area that a robot moved step by step covers") {
  RandomDrive random;
  int inside = 0, outside = 0;
  for (int round = 0; round < takt::test::rounds(210); ++round) {
    CAPTURE(round);
    const Footprint f = random.footprint();
    const Drive d = random.drive(round);
    const double time = random(0.05, 2.5);
    const ProtectedField field(f, d, time), larger(grown(f, kStep_m), d, time);
    const Way way(d, time);
    for (int i = 0; i < 60; ++i) {
      const double x = random(-1, 1), y = random(-1, 2);
      const bool slow = way.covers(f, x, y);
      (slow ? inside : outside) += 1;
      if (slow) CHECK(larger.contains(x, y));
      if (field.contains(x, y)) CHECK(way.covers(grown(f, kStep_m), x, y));
    }
  }
  CHECK(inside >= takt::test::at_scale(1000));
  CHECK(outside >= takt::test::at_scale(1000));
}

TEST_CASE("whatever the robot covers at any instant of its way is in the field") {
  RandomDrive random;
  for (int round = 0; round < takt::test::rounds(4000); ++round) {
    const Footprint f = random.footprint();
    const Drive d = random.drive(round);
    const double time = random(0.05, 2.5), at = random(0, time), heading = d.turn_rad_s * at;
    // Along the chord: the way on a circle, exact also where the circle is nearly a line.
    const double chord = d.speed_m_s * at * (std::abs(heading) < 1e-9 ? 1 : std::sin(heading / 2) / (heading / 2));
    const double px = -chord * std::sin(heading / 2), py = chord * std::cos(heading / 2);
    const double off = random(0, f.margin_m - 1e-6), to = random(0, 2 * std::numbers::pi);
    const double across = random(-1, 1) * (f.half_width_m - 1e-6) + off * std::cos(to),
                 along = random(-f.rear_m + 1e-6, f.front_m - 1e-6) + off * std::sin(to);
    const double c = std::cos(heading), s = std::sin(heading);
    const double x = px + c * across - s * along, y = py + s * across + c * along;
    CHECK(ProtectedField(f, d, time).contains(x, y) != left_behind(f, d, time, x, y));
  }
}

TEST_CASE("a sweep blocks exactly if a row of neighbouring beams ends in the field") {
  RandomDrive random;
  int blocked = 0;
  for (int round = 0; round < takt::test::rounds(600); ++round) {
    CAPTURE(round);
    const ProtectedField field(random.footprint(), random.drive(round), random(0.1, 1.5));
    std::vector<float> ranges(static_cast<size_t>(random(0, 90)));
    for (auto& r : ranges) r = random(0, 1) < 0.3 ? 0.0f : static_cast<float>(random(0.05, 3));
    Sweep sweep{random(-2, 0), random(0.005, 0.05), {}, ranges};
    const Eigen::Quaterniond q = Eigen::AngleAxisd(random(-1, 1), Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(random(-0.1, 0.1), Eigen::Vector3d::UnitX());
    sweep.sensor_in_robot = {random(-0.2, 0.2), random(-0.2, 0.4), 0.3, q.w(), q.x(), q.y(), q.z()};
    const int beams_min = 1 + round % 4;

    const auto hit = [&](size_t i) {
      const double angle = sweep.first_angle_rad + static_cast<double>(i) * sweep.step_rad;
      const Eigen::Vector3d on_sensor =
          Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * Eigen::Vector3d(0, static_cast<double>(ranges[i]), 0);
      const Eigen::Vector3d p =
          q * on_sensor + Eigen::Vector3d(sweep.sensor_in_robot.x, sweep.sensor_in_robot.y, sweep.sensor_in_robot.z);
      return ranges[i] > 0 && field.contains(p.x(), p.y());
    };
    FieldReading slow;
    for (size_t first = 0; first + static_cast<size_t>(beams_min) <= ranges.size(); ++first) {
      bool all = true;
      float nearest = ranges[first];
      for (size_t i = first; i < first + static_cast<size_t>(beams_min); ++i) {
        all = all && hit(i);
        nearest = std::min(nearest, ranges[i]);
      }
      if (!all) continue;
      if (!slow.blocked || nearest < static_cast<float>(slow.nearest_m)) slow.nearest_m = static_cast<double>(nearest);
      slow.blocked = true;
    }
    const FieldReading fast = read_field(sweep, field, beams_min);
    CHECK(fast.blocked == slow.blocked);
    CHECK(fast.nearest_m == slow.nearest_m);
    blocked += slow.blocked;
  }
  CHECK(blocked >= takt::test::at_scale(50));
  CHECK(blocked <= takt::test::rounds(600) - takt::test::at_scale(50));
}
