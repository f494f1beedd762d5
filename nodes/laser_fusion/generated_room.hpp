// SPDX-License-Identifier: Apache-2.0
// Furnished rooms for generated clouds, and what a ray in them meets.
#pragma once
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "nodes/laser_fusion/pose_parameters.hpp"
#include "rt/msg/point.hpp"

namespace takt::laser_fusion {

/// Random numbers of a scene: the same seed gives the same scene.
class Generator {
 public:
  explicit Generator(uint64_t seed) : bits_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<>(low, high)(bits_); }
  double normal(double sigma) { return sigma * std::normal_distribution<>()(bits_); }
  Eigen::Vector3d direction() {
    const Eigen::Vector3d v(normal(1), normal(1), normal(1));
    return v.normalized();
  }
  Colour colour() {
    const auto level = [&] { return static_cast<uint8_t>(uniform(40, 255)); };
    return {level(), level(), level()};
  }

 private:
  std::mt19937_64 bits_;
};

/// An upright box.
struct RoomBox {
  Eigen::Vector3d centre, half;  ///< m
  Eigen::Vector2d along{1, 0};   ///< its x axis seen from above, unit
  Colour colour{};
};

/// Seen from above: the x axis turned by that angle.
inline Eigen::Vector2d direction_of(double yaw_rad) { return {std::cos(yaw_rad), std::sin(yaw_rad)}; }

/// The first box is the room, seen from within: 5 to 8 m x 4 to 6 m x 2.8 m, the origin near its middle and origin_m
/// above its floor. A dozen others stand on the floor, their middles 1.3 to 3.5 m away.
std::vector<RoomBox> make_room(double origin_m, Generator& random);

struct RayHit {
  double range_m = std::numeric_limits<double>::infinity();
  size_t box = 0;
};
/// The nearest surface in a direction (unit); `from` lies in the first box and in no other.
RayHit first_hit(std::span<const RoomBox> boxes, const Eigen::Vector3d& from, const Eigen::Vector3d& ray);

}  // namespace takt::laser_fusion
