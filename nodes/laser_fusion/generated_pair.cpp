// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/generated_pair.hpp"

#include <cmath>
#include <numbers>

#include "nodes/laser_fusion/generated_room.hpp"
#include "rt/msg/point.hpp"

namespace takt::laser_fusion {
namespace {

using Eigen::Vector3d;

constexpr double kWidth_rad = 2 * std::numbers::pi / 3, kHeight_rad = 70 * std::numbers::pi / 180;
constexpr double kSensor_m = 1.0;  // above the floor

Rigid random_pose(double offset_m, double offset_rad, Generator& random) {
  const Eigen::AngleAxisd turn(offset_rad, random.direction());
  return {turn.toRotationMatrix(), offset_m * random.direction()};
}

Point moved(const Rigid& into, const Vector3d& place) {
  const Eigen::Vector3f p = (into * place).cast<float>();
  return {p.x(), p.y(), p.z()};
}

}  // namespace

CloudPair generate_pair(const PairParameters& p, uint64_t seed) {
  Generator random(seed);
  const std::vector<RoomBox> room = make_room(kSensor_m, random);
  CloudPair pair;
  pair.vision_in_laser = random_pose(p.offset_m, p.offset_rad, random);
  const Rigid laser_in_vision = pair.vision_in_laser.inverse();
  const auto scan = [&](double first_rad, double sigma_m, const Rigid& into, cloud::Cloud& cloud) {
    while (cloud.points.size() < p.points) {
      const double azimuth = first_rad + random.uniform(0, kWidth_rad);
      const double elevation = random.uniform(-kHeight_rad / 2, kHeight_rad / 2);
      const Vector3d ray(std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
                         std::sin(elevation));
      const RayHit hit = first_hit(room, Vector3d::Zero(), ray);
      const Vector3d noise(random.normal(sigma_m), random.normal(sigma_m), random.normal(sigma_m));
      cloud.points.push_back(moved(into, hit.range_m * ray + noise));
      cloud.colours.push_back(room[hit.box].colour);
    }
  };
  scan(0, p.laser_sigma_m, Rigid{}, pair.laser);
  scan((1 - p.overlap) * kWidth_rad, p.vision_sigma_m, laser_in_vision, pair.vision);
  return pair;
}

CloudPair displaced(const CloudPair& pair, double offset_m, double offset_rad, uint64_t seed) {
  Generator random(seed);
  CloudPair out{pair.laser, pair.vision, random_pose(offset_m, offset_rad, random)};
  const Rigid into = out.vision_in_laser.inverse() * pair.vision_in_laser;
  for (Point& p : out.vision.points) p = moved(into, {p.x, p.y, p.z});
  return out;
}

}  // namespace takt::laser_fusion
