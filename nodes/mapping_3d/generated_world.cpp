// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/generated_world.hpp"

#include <algorithm>
#include <cmath>

#include "rt/transform/pose_math.hpp"

namespace takt::mapping_3d {
namespace {

using body_pose::Bgr;
using Eigen::Vector3d;

constexpr double kRoom_m = 4, kCeiling_m = 2.6;
constexpr double kSegment_m = 4, kWay_m = 2.5;  // of the long way: half as wide as it may be
constexpr double kDisparityStep_m = 0.3;        // more between two pixels is a step in depth

void add_box(World& world, double x_m, double y_m, double half_x_m, double half_y_m, double from_m, double to_m,
             const Bgr& colour) {
  world.boxes.push_back({{x_m - half_x_m, y_m - half_y_m, from_m}, {x_m + half_x_m, y_m + half_y_m, to_m}, colour});
}

Bgr any_colour(Lot& lot) {
  const auto level = [&] { return static_cast<uint8_t>(lot.in(40, 255)); };
  return {level(), level(), level()};
}

double floor_along(const World& world, const Vector3d& from, const Vector3d& ray) {
  double nearest = body_pose::kNever;
  const double level = ray.z() < 0 ? -from.z() / ray.z() : body_pose::kNever;
  if (from.y() + level * ray.y() <= world.ramp_from_m) nearest = level;
  const double closing = ray.z() - world.ramp_slope * ray.y();
  if (world.ramp_slope != 0 && closing < 0) {
    const double range = (world.ramp_slope * (from.y() - world.ramp_from_m) - from.z()) / closing;
    if (range > 0 && from.y() + range * ray.y() > world.ramp_from_m) nearest = std::min(nearest, range);
  }
  return nearest;
}

/// What a ray of unit length meets.
struct Hit {
  double range_m = body_pose::kNever;
  Bgr colour{90, 90, 90};
};

Hit meet(const World& world, const Vector3d& from, const Vector3d& ray) {
  Hit hit{floor_along(world, from, ray)};
  const auto nearer = [&](double range, const Bgr& colour) {
    if (range < hit.range_m) hit = {range, colour};
  };
  for (const Box& box : world.boxes) nearer(body_pose::meet(from, ray, box), box.colour);
  for (const Capsule& person : world.people) nearer(body_pose::meet(from, ray, person), person.colour);
  return hit;
}

}  // namespace

double distance_m(const World& world, const Vector3d& place) {
  const double floor = std::abs(place.z() - world.floor_m(place.y()));
  double nearest = floor * std::cos(std::atan(place.y() > world.ramp_from_m ? world.ramp_slope : 0));
  for (const Box& box : world.boxes) {
    const Vector3d half = (box.high - box.low) / 2, beyond = (place - (box.low + box.high) / 2).cwiseAbs() - half;
    nearest = std::min(nearest, std::abs(beyond.cwiseMax(0).norm() + std::min(0.0, beyond.maxCoeff())));
  }
  for (const Capsule& person : world.people) {
    const Vector3d line = person.to - person.from;
    const double share = std::clamp((place - person.from).dot(line) / line.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, std::abs((place - person.from - share * line).norm() - person.radius));
  }
  return nearest;
}

World furnished_room(uint64_t seed) {
  Lot lot(seed, 1);
  World world;
  for (const double side : {-1.0, 1.0}) {
    add_box(world, side * (kRoom_m + 0.1), 0, 0.1, kRoom_m, 0, kCeiling_m, any_colour(lot));
    add_box(world, 0, side * (kRoom_m + 0.1), kRoom_m, 0.1, 0, kCeiling_m, any_colour(lot));
    add_box(world, side * lot.in(2.4, 2.8), side * lot.in(-1, 1), 0.3, 0.4, 0, lot.in(0.5, 1.5), any_colour(lot));
    add_table(world, side * lot.in(-1.5, 1.5), side * lot.in(2.8, 3.2), 0.7, 0.4);
  }
  add_box(world, -3.8, 2.5, 0.2, 0.8, 0, 2.0, any_colour(lot));
  add_box(world, lot.in(-0.3, 0.3), lot.in(-0.3, 0.3), 0.25, 0.25, 0, 0.9, any_colour(lot));
  return world;
}

World long_way(double y_m, uint64_t seed) {
  World world;
  const auto here = static_cast<int64_t>(std::floor(y_m / kSegment_m));
  for (int64_t segment = here - 1; segment <= here + 3; ++segment) {
    Lot lot(seed, static_cast<uint64_t>(segment + 1'000'000));
    const double middle = (static_cast<double>(segment) + 0.5) * kSegment_m;
    for (const double side : {-1.0, 1.0}) {
      add_box(world, side * (kWay_m + lot.in(0, 0.5)), middle, 0.2, kSegment_m / 2, 0, kCeiling_m, any_colour(lot));
      if (lot.chance(0.7))
        add_box(world, side * lot.in(1.2, 2), middle + lot.in(-1.5, 1.5), lot.in(0.1, 0.3), lot.in(0.1, 0.4), 0,
                lot.in(0.3, 1.8), any_colour(lot));
    }
  }
  return world;
}

void add_person(World& world, double x_m, double y_m) {
  for (const double side : {-0.1, 0.1})
    world.people.push_back({{x_m + side, y_m, 0.07}, {x_m + side, y_m, 0.8}, 0.07, {90, 60, 40}});
  world.people.push_back({{x_m, y_m, 0.9}, {x_m, y_m, 1.35}, 0.18, {40, 60, 200}});
  world.people.push_back({{x_m, y_m, 1.62}, {x_m, y_m, 1.66}, 0.1, {150, 170, 220}});
}

void add_table(World& world, double x_m, double y_m, double half_x_m, double half_y_m) {
  add_box(world, x_m, y_m, half_x_m, half_y_m, 0.70, 0.74, {60, 120, 170});
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      add_box(world, x_m + x * (half_x_m - 0.04), y_m + y * (half_y_m - 0.04), 0.03, 0.03, 0, 0.70, {50, 90, 130});
}

Look look(const World& world, const WorldCamera& c, const Transform& robot_in_world, Lot& lot) {
  Look out;
  out.camera_in_world = compose({robot_in_world, {}}, {camera_mount(0, 0.2, c.height_m, 0, c.tilt_rad), {}}).transform;
  const Affine m = to_affine(out.camera_in_world);
  const Vector3d from(m.t[0], m.t[1], m.t[2]);
  const double focal = c.focal_px / c.step_px, focal_baseline = c.focal_px * c.baseline_m;
  const double cu = (c.width - 1) / 2.0, cv = (c.height - 1) / 2.0;
  const auto pixels = static_cast<size_t>(c.width) * static_cast<size_t>(c.height);
  std::vector<Bgr> colour(pixels);
  out.depth_m.resize(pixels);
  for (size_t i = 0; i < pixels; ++i) {
    const double u = static_cast<double>(i % static_cast<size_t>(c.width)),
                 v = static_cast<double>(i / static_cast<size_t>(c.width));
    const Vector3d ray((u - cu) / focal, (v - cv) / focal, 1);
    const Position along = transformed(m, ray.x(), ray.y(), ray.z());
    const Hit hit = meet(world, from, (Vector3d(along.x_m, along.y_m, along.z_m) - from).normalized());
    const double depth = hit.range_m / ray.norm();
    out.depth_m[i] = depth < c.farthest_m ? static_cast<float>(depth) : 0;
    colour[i] = hit.colour;
  }
  for (size_t i = 0; i < pixels; ++i) {
    if (!(out.depth_m[i] > 0) || lot.chance(c.missing)) continue;
    double depth = out.depth_m[i];
    const size_t beside = i + 1 < pixels ? i + 1 : i;
    const double step = out.depth_m[beside] - depth;
    if (out.depth_m[beside] > 0 && std::abs(step) > kDisparityStep_m && lot.chance(c.smeared)) depth += lot.in(0, step);
    double disparity = focal_baseline / depth + c.noise_px * lot.normal();
    if (lot.chance(c.wrong)) disparity = lot.in(focal_baseline / c.farthest_m, 100);
    if (!(disparity > focal_baseline / c.farthest_m)) continue;
    const double z = focal_baseline / disparity;
    const double u = static_cast<double>(i % static_cast<size_t>(c.width)),
                 v = static_cast<double>(i / static_cast<size_t>(c.width));
    out.points.push_back(
        {static_cast<float>((u - cu) / focal * z), static_cast<float>((v - cv) / focal * z), static_cast<float>(z)});
    out.colours.push_back({colour[i].b, colour[i].g, colour[i].r});
    out.pixel.push_back(i);
  }
  return out;
}

Transform robot_at(double x_m, double y_m, double heading_rad) {
  return {x_m, y_m, 0, std::cos(heading_rad / 2), 0, 0, std::sin(heading_rad / 2)};
}

Transform disturbed(const Transform& pose, double sigma_m, double sigma_rad, Lot& lot) {
  const double half = sigma_rad * lot.normal() / 2;
  Transform out = compose({pose, {}}, {{0, 0, 0, std::cos(half), 0, 0, std::sin(half)}, {}}).transform;
  out.x += sigma_m * lot.normal();
  out.y += sigma_m * lot.normal();
  return out;
}

}  // namespace takt::mapping_3d
