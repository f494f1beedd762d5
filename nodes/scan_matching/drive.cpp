// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/drive.hpp"

#include <algorithm>
#include <cmath>

namespace takt::scan_matching {
namespace {

constexpr double kPi = std::numbers::pi;

void add_box(std::vector<Wall>& walls, double x, double y, double width, double depth, double turn) {
  const PlanarPose box{x, y, turn};
  const double corners[4][2] = {
      {-width / 2, -depth / 2}, {width / 2, -depth / 2}, {width / 2, depth / 2}, {-width / 2, depth / 2}};
  for (int i = 0; i < 4; ++i) {
    const PlanarPose a = compose(box, {corners[i][0], corners[i][1], 0}),
                     b = compose(box, {corners[(i + 1) % 4][0], corners[(i + 1) % 4][1], 0});
    walls.push_back({a.x_m, a.y_m, b.x_m, b.y_m});
  }
}

}  // namespace

double distance_m(const std::vector<Wall>& walls, double x, double y, double angle, double range_max_m) {
  const double dx = std::cos(angle), dy = std::sin(angle);
  double nearest = 0;
  for (const Wall& w : walls) {
    const double ex = w.x1_m - w.x0_m, ey = w.y1_m - w.y0_m, det = ex * dy - ey * dx;
    if (std::abs(det) < 1e-12) continue;
    const double ax = w.x0_m - x, ay = w.y0_m - y;
    const double along = (ex * ay - ey * ax) / det, on_wall = (dx * ay - dy * ax) / det;
    if (along <= 0 || along > range_max_m || on_wall < 0 || on_wall > 1) continue;
    if (nearest == 0 || along < nearest) nearest = along;
  }
  return nearest;
}

std::vector<Wall> furnished_room(uint64_t seed) {
  std::vector<Wall> walls;
  add_box(walls, 0, 0, 12, 9, 0);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<> size(0.3, 1.2), turn(-kPi, kPi), side(-1, 1);
  for (int i = 0; i < 10; ++i) {
    // Along the four walls in turn, outside of the free middle.
    const double x = i % 4 < 2 ? (i % 4 == 0 ? -5 : 5) + 0.4 * side(random) : 4.5 * side(random);
    const double y = i % 4 < 2 ? 3.5 * side(random) : (i % 4 == 2 ? -3.5 : 3.5) + 0.3 * side(random);
    add_box(walls, x, y, size(random), size(random), turn(random));
  }
  return walls;
}

std::vector<Wall> corridor() { return {{-1, -1000, -1, 1000}, {1, -1000, 1, 1000}}; }

void cast(const std::vector<Wall>& walls, const PlanarPose& robot, const DriveParameters& p, std::mt19937_64& random,
          std::vector<float>& range_m) {
  std::normal_distribution<> noise(0, 1);
  for (size_t i = 0; i < p.beams; ++i) {
    // Counter-clockwise from the robot's y axis.
    const double share = static_cast<double>(i) / static_cast<double>(p.beams - 1) - 0.5;
    const double range =
        distance_m(walls, robot.x_m, robot.y_m, robot.theta_rad + kPi / 2 + share * p.field_rad, p.range_max_m);
    const double error = p.noise_m * noise(random);
    range_m.push_back(static_cast<float>(range > 0 ? std::max(0.01, range + error) : 0));
  }
}

Drive make_drive(const std::vector<Wall>& walls, const std::vector<PlanarPose>& truth, const DriveParameters& p,
                 uint64_t seed) {
  Drive drive;
  drive.beams = p.beams;
  drive.step_rad = p.field_rad / static_cast<double>(p.beams - 1);
  drive.first_angle_rad = -p.field_rad / 2;
  std::mt19937_64 random(seed);
  std::normal_distribution<> noise(0, 1);
  PlanarPose odometry;
  for (size_t i = 0; i < truth.size(); ++i) {
    if (i > 0) {
      PlanarPose moved = between(truth[i - 1], truth[i]);
      const double sigma_m = p.odometry_noise * std::hypot(moved.x_m, moved.y_m);
      moved.x_m += sigma_m * noise(random);
      moved.y_m += sigma_m * noise(random);
      moved.theta_rad += p.odometry_noise_rad * noise(random);
      odometry = compose(odometry, moved);
    }
    cast(walls, truth[i], p, random, drive.range_m);
    drive.scans.push_back({static_cast<double>(i) * p.interval_s, odometry, truth[i]});
  }
  return drive;
}

std::vector<PlanarPose> rounds(size_t poses) {
  std::vector<PlanarPose> path;
  double phase = 0;
  for (size_t i = 0; i < poses; ++i) {
    const double dx = -1.8 * std::sin(phase), dy = 1.3 * std::cos(phase);
    // The robot drives along its y axis.
    path.push_back({1.8 * std::cos(phase), 1.3 * std::sin(phase), wrapped(std::atan2(dy, dx) - kPi / 2)});
    phase += 0.1 / std::hypot(dx, dy);
  }
  return path;
}

}  // namespace takt::scan_matching
