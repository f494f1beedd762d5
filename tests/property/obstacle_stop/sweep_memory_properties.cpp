// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "nodes/obstacle_stop/sweep_memory.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::obstacle_stop;

namespace {

using test::kMs;
constexpr int64_t kPeriod_ns = 66'666'667, kSpan_ns = 1'000 * kMs;
constexpr size_t kBeams = 181;

struct Disc {
  double x, y, radius;
};
struct Wall {
  double x0, y0, x1, y1;
};

struct Random {
  std::mt19937_64 engine;
  explicit Random(uint64_t seed) : engine(seed) {}
  double operator()(double low, double high) { return std::uniform_real_distribution<>(low, high)(engine); }
  double normal(double sigma) { return std::normal_distribution<>(0, sigma)(engine); }
};

/// A room with boxes, and legs of furniture and people, all of which stand still.
struct Room {
  std::vector<Wall> walls{{-4, -3, 4, -3}, {4, -3, 4, 6}, {4, 6, -4, 6}, {-4, 6, -4, -3}};
  std::vector<Disc> discs;

  explicit Room(Random& random) {
    for (int i = 0; i < 6; ++i) {
      const PlanarPose box{random(-3.5, 3.5), random(-2.5, 5.5), random(0, 6.3)};
      const double length = random(0.1, 1.5), width = random(0.04, 0.6);
      const PlanarPose corners[] = {box, compose(box, {length, 0, 0}), compose(box, {length, width, 0}),
                                    compose(box, {0, width, 0})};
      for (int side = 0; side < 4; ++side) {
        const PlanarPose &a = corners[side], &b = corners[(side + 1) % 4];
        walls.push_back({a.x_m, a.y_m, b.x_m, b.y_m});
      }
    }
    for (int i = 0; i < 12; ++i) discs.push_back({random(-3.5, 3.5), random(-2.5, 5.5), random(0.02, 0.3)});
  }

  double range(double x, double y, double cosine, double sine) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Wall& w : walls) {
      const double ex = w.x1 - w.x0, ey = w.y1 - w.y0, cross = cosine * ey - sine * ex;
      const double t = ((w.x0 - x) * ey - (w.y0 - y) * ex) / cross;
      const double u = ((w.x0 - x) * sine - (w.y0 - y) * cosine) / cross;
      if (t > 0 && u >= 0 && u <= 1) nearest = std::min(nearest, t);
    }
    for (const Disc& d : discs) {
      const double b = (d.x - x) * cosine + (d.y - y) * sine;
      const double h = b * b - std::pow(d.x - x, 2) - std::pow(d.y - y, 2) + d.radius * d.radius;
      if (h >= 0 && b - std::sqrt(h) > 0) nearest = std::min(nearest, b - std::sqrt(h));
    }
    return nearest;
  }
};

/// Whether anything is nearer to the robot's centre than so much.
bool touches(const Room& room, const PlanarPose& robot, double clearance_m) {
  for (int degree = 0; degree < 360; ++degree) {
    const double angle = std::numbers::pi / 180 * degree;
    if (room.range(robot.x_m, robot.y_m, std::cos(angle), std::sin(angle)) < clearance_m) return true;
  }
  return false;
}

/// Where the robot is, and where its odometry says: 1 % of the way and of the turn too much, and a bias.
struct Robot {
  PlanarPose truth, odometry;
  void drive(double speed_m_s, double turn_rad_s, double seconds) {
    truth = compose(truth, {0, speed_m_s * seconds, turn_rad_s * seconds});
    odometry = compose(odometry, {0, 1.01 * speed_m_s * seconds, (1.01 * turn_rad_s + 0.002) * seconds});
  }
};

constexpr double kMountY_m = 0.3;

/// Beams 13 ms from the first to the last, while the robot goes on.
std::vector<float> scan(const Room& room, Robot robot, double speed_m_s, double turn_rad_s, Random& random) {
  std::vector<float> ranges(kBeams);
  for (size_t i = 0; i < kBeams; ++i) {
    const PlanarPose at = compose(robot.truth, {0, kMountY_m, 0});
    const double angle = at.theta_rad + std::numbers::pi / 180 * static_cast<double>(i);  // beam 0 to the right
    const double range = room.range(at.x_m, at.y_m, std::cos(angle), std::sin(angle));
    ranges[i] = static_cast<float>(std::max(range + random.normal(0.01), 0.01));
    robot.drive(speed_m_s, turn_rad_s, 0.0133 / kBeams);
  }
  return ranges;
}

Sweep sweep_of(const std::vector<float>& ranges) {
  return {-std::numbers::pi / 2, std::numbers::pi / 180, {0, kMountY_m, 0.25, 1, 0, 0, 0}, ranges};
}

/// Beams of which a neighbour has moved in as well.
int in_pairs(std::span<const float> moved_in) {
  int pairs = 0;
  for (size_t i = 0; i + 1 < moved_in.size(); ++i) pairs += moved_in[i] > 0 && moved_in[i + 1] > 0;
  return pairs;
}

}  // namespace

TEST_CASE(
    "in a room where all stands still next to nothing moves in while the robot drives; who appears does, at once") {
  int sweeps = 0, wrong = 0, appeared = 0, noticed = 0;
  for (uint64_t seed = 0; seed < test::rounds(200u); ++seed) {
    Random random(test::seed(seed));
    Room room(random);
    Robot robot;
    SweepMemory memory(kBeams, kSpan_ns);
    const double speed = random(0, 1.4), turn = random(-0.8, 0.8);
    int64_t k = 0;
    for (; k < 30 && !touches(room, robot.truth, 0.4); ++k) {
      const auto ranges = scan(room, robot, speed, turn, random);
      ++sweeps;
      wrong += in_pairs(memory.moved_in(sweep_of(ranges), robot.odometry, k * kPeriod_ns, 2.0)) > 0;
      memory.add(sweep_of(ranges), robot.odometry, k * kPeriod_ns);
      robot.drive(speed, turn, 1.0 / 15);
    }
    if (k < 8) continue;
    // Two shins, 0.8 to 1.5 m before the scanner.
    const double angle = random(-0.5, 0.5), range = random(0.8, 1.5);
    for (const double aside : {-0.1, 0.1}) {
      const PlanarPose leg =
          compose(robot.truth, {aside - range * std::sin(angle), kMountY_m + range * std::cos(angle), 0});
      room.discs.push_back({leg.x_m, leg.y_m, 0.055});
    }
    const auto ranges = scan(room, robot, speed, turn, random);
    Room without = room;
    without.discs.resize(without.discs.size() - 2);
    Random same = random;
    const auto before = scan(without, robot, speed, turn, same);
    bool in_view = false;
    for (size_t i = 0; i + 1 < kBeams; ++i)
      in_view |= ranges[i] < before[i] - 0.5f && ranges[i + 1] < before[i + 1] - 0.5f;
    if (!in_view) continue;
    ++appeared;
    noticed += in_pairs(memory.moved_in(sweep_of(ranges), robot.odometry, k * kPeriod_ns, 2.0)) > 0;
  }
  MESSAGE("wrong in " << wrong << " of " << sweeps << " sweeps; noticed " << noticed << " of " << appeared);
  CHECK(sweeps >= test::at_scale(2000));
  CHECK(wrong <= test::at_most(sweeps, 1.0 / 500));
  CHECK(appeared >= test::at_scale(50));
  CHECK(appeared - noticed <= test::at_most(appeared, 1.0 / 20));
}
