// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/generated_pair.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <random>

namespace takt::laser_fusion {
namespace {

using Eigen::Vector3d;

constexpr double kWidth_rad = 2 * std::numbers::pi / 3, kHeight_rad = 70 * std::numbers::pi / 180;
constexpr double kSensor_m = 1.0, kCeiling_m = 2.8;
constexpr int kFurniture = 12;

struct Box {
  Vector3d centre, half;
  double yaw = 0;
  Colour colour;
};

class Generator {
 public:
  explicit Generator(uint64_t seed) : bits_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<>(low, high)(bits_); }
  double normal(double sigma) { return std::normal_distribution<>(0, sigma)(bits_); }
  Vector3d direction() {
    const Vector3d v(normal(1), normal(1), normal(1));
    return v.normalized();
  }
  Colour colour() {
    const auto level = [&] { return static_cast<uint8_t>(uniform(40, 255)); };
    return {level(), level(), level()};
  }

 private:
  std::mt19937_64 bits_;
};

/// The first box is the room, seen from within.
std::vector<Box> make_room(Generator& random) {
  const double x = random.uniform(5, 8), y = random.uniform(4, 6);
  std::vector<Box> boxes{{{random.uniform(-0.2, 0.2) * x, random.uniform(-0.2, 0.2) * y, kCeiling_m / 2 - kSensor_m},
                          {x / 2, y / 2, kCeiling_m / 2},
                          random.uniform(0, std::numbers::pi),
                          random.colour()}};
  while (boxes.size() <= kFurniture) {
    Box box;
    box.half = {random.uniform(0.1, 0.7), random.uniform(0.1, 0.4), random.uniform(0.2, 1.1)};
    const double azimuth = random.uniform(-std::numbers::pi, std::numbers::pi), range = random.uniform(1.3, 3.5);
    box.centre = {range * std::cos(azimuth), range * std::sin(azimuth), box.half.z() - kSensor_m};
    box.yaw = random.uniform(0, std::numbers::pi);
    box.colour = random.colour();
    boxes.push_back(box);
  }
  return boxes;
}

/// How far along the ray from the origin the surface of the box is; nothing if it misses.
std::optional<double> hit(const Box& box, const Vector3d& ray) {
  const Eigen::AngleAxisd into_box(-box.yaw, Vector3d::UnitZ());
  const Vector3d from = into_box * -box.centre, along = into_box * ray;
  double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
  for (int a = 0; a < 3; ++a) {
    const double low = (-box.half[a] - from[a]) / along[a], high = (box.half[a] - from[a]) / along[a];
    enter = std::max(enter, std::min(low, high));
    leave = std::min(leave, std::max(low, high));
  }
  if (enter > leave || leave < 0) return std::nullopt;
  return enter > 0 ? enter : leave;
}

struct Sight {
  Vector3d point;
  Colour colour;
};

Sight look(const std::vector<Box>& boxes, const Vector3d& ray) {
  double nearest = std::numeric_limits<double>::infinity();
  Colour colour{};
  for (const Box& box : boxes)
    if (const auto range = hit(box, ray); range && *range < nearest) nearest = *range, colour = box.colour;
  return {nearest * ray, colour};
}

}  // namespace

CloudPair generate_pair(const PairParameters& p, uint64_t seed) {
  Generator random(seed);
  const std::vector<Box> room = make_room(random);
  const Eigen::AngleAxisd turn(p.offset_rad, random.direction());
  CloudPair pair;
  pair.vision_in_laser = {turn.toRotationMatrix(), p.offset_m * random.direction()};
  const Rigid laser_in_vision = pair.vision_in_laser.inverse();
  const auto scan = [&](double first_rad, double sigma_m, const Rigid& into, cloud::Cloud& cloud) {
    while (cloud.points.size() < p.points) {
      const double azimuth = first_rad + random.uniform(0, kWidth_rad);
      const double elevation = random.uniform(-kHeight_rad / 2, kHeight_rad / 2);
      const Vector3d ray(std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
                         std::sin(elevation));
      const Sight sight = look(room, ray);
      const Vector3d noise(random.normal(sigma_m), random.normal(sigma_m), random.normal(sigma_m));
      const Eigen::Vector3f seen = (into * (sight.point + noise)).cast<float>();
      cloud.points.push_back({seen.x(), seen.y(), seen.z()});
      cloud.colours.push_back(sight.colour);
    }
  };
  scan(0, p.laser_sigma_m, Rigid{}, pair.laser);
  scan((1 - p.overlap) * kWidth_rad, p.vision_sigma_m, laser_in_vision, pair.vision);
  return pair;
}

}  // namespace takt::laser_fusion
