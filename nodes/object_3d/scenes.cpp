// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace takt::object_3d {
namespace {

using Vec3 = cv::Vec3d;

constexpr int kWidth = 640, kHeight = 480;
constexpr double kNever = std::numeric_limits<double>::infinity();

struct Hit {
  double t = kNever;  ///< along the ray
  Vec3 normal;
  cv::Vec3f bgr;
  int object = -1;
};

/// Where a ray enters a slab low..high along one axis, and leaves it.
struct Interval {
  double in = -kNever, out = kNever;
  int axis = -1;
  void cut(double origin, double direction, double low, double high, int along) {
    if (direction == 0) {
      if (origin < low || origin > high) out = -kNever;
      return;
    }
    double a = (low - origin) / direction, b = (high - origin) / direction;
    if (a > b) std::swap(a, b);
    if (a > in) in = a, axis = along;
    out = std::min(out, b);
  }
};

Vec3 unit(int axis, double sign) {
  Vec3 v;
  v[axis] = sign;
  return v;
}

/// First point of a part on a ray in the model's frame.
Hit meet(const Part& part, const Vec3& origin, const Vec3& direction) {
  const Vec3 o = origin - Vec3(part.x, part.y, part.z);
  const double r = part.length / 2;
  Interval within;
  if (part.solid == Solid::sphere) {
    const Vec3 c = o - Vec3(0, 0, r);
    const double b = c.dot(direction), d = b * b - c.dot(c) + r * r;
    if (d < 0 || -b - std::sqrt(d) <= 0) return {};
    const double t = -b - std::sqrt(d);
    return {t, (c + t * direction) / r, {}, 0};
  }
  within.cut(o[2], direction[2], 0, part.height, 2);
  if (part.solid == Solid::box) {
    within.cut(o[0], direction[0], -part.length / 2, part.length / 2, 0);
    within.cut(o[1], direction[1], -part.width / 2, part.width / 2, 1);
    if (within.in > within.out || within.in <= 0) return {};
    return {within.in, unit(within.axis, direction[within.axis] > 0 ? -1 : 1), {}, 0};
  }
  const double a = direction[0] * direction[0] + direction[1] * direction[1],
               b = o[0] * direction[0] + o[1] * direction[1], d = b * b - a * (o[0] * o[0] + o[1] * o[1] - r * r);
  if (d < 0 || a == 0) return {};
  const double in = (-b - std::sqrt(d)) / a;
  const bool through_side = in > within.in;
  const double t = std::max(in, within.in);
  if (t > std::min(within.out, (-b + std::sqrt(d)) / a) || t <= 0) return {};
  const Vec3 p = o + t * direction;
  return {t, through_side ? Vec3(p[0] / r, p[1] / r, 0) : unit(2, direction[2] > 0 ? -1 : 1), {}, 0};
}

/// Floor, a table and the wall behind it.
Hit meet_room(const SceneParameters& p, const Vec3& o, const Vec3& d) {
  constexpr double kTableHalf_m = 0.8, kTableNear_m = 0.6, kTableFar_m = 1.7, kWall_m = 3;
  Hit best;
  const auto take = [&](double t, const Vec3& normal, const cv::Vec3f& bgr) {
    if (t > 0 && t < best.t) best = {t, normal, bgr, -1};
  };
  const double table = (p.table_m - o[2]) / d[2];
  const Vec3 at = o + table * d;
  if (std::abs(at[0]) <= kTableHalf_m && at[1] >= kTableNear_m && at[1] <= kTableFar_m)
    take(table, unit(2, 1), {110, 140, 165});
  take(-o[2] / d[2], unit(2, 1), {90, 90, 90});
  take((kWall_m - o[1]) / d[1], unit(1, -1), {170, 175, 180});
  return best;
}

Hit meet_object(const PlacedModel& placed, double table_m, const Vec3& o, const Vec3& d) {
  const double c = std::cos(placed.yaw_rad), s = std::sin(placed.yaw_rad);
  const auto turned = [&](const Vec3& v) { return Vec3(c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]); };
  const Vec3 origin = turned(o - Vec3(placed.x, placed.y, table_m)), direction = turned(d);
  Hit best;
  for (const Part& part : placed.model.parts) {
    const Hit hit = meet(part, origin, direction);
    if (hit.t < best.t) best = hit;
  }
  const Vec3 n = best.normal;
  best.normal = {c * n[0] - s * n[1], s * n[0] + c * n[1], n[2]};
  best.bgr = placed.model.bgr;
  return best;
}

/// Depth and what is seen of one view, before noise.
struct View {
  int columns = 0, rows = 0;
  std::vector<double> z;
  std::vector<Hit> hits;
  double at(int x, int y) const { return z[static_cast<size_t>(y * columns + x)]; }
};

View look(const std::vector<PlacedModel>& placed, const SceneParameters& p, const CameraModel& camera,
          const Transform& mount) {
  const mapping_3d::Affine pose = mapping_3d::to_affine(mount);
  View view{kWidth / p.step_px, kHeight / p.step_px, {}, {}};
  const Vec3 origin(pose.t[0], pose.t[1], pose.t[2]);
  for (int row = 0; row < view.rows; ++row)
    for (int column = 0; column < view.columns; ++column) {
      const Vec3 ray((column * p.step_px - camera.cu_px) / camera.focal_px,
                     (row * p.step_px - camera.cv_px) / camera.focal_px, 1);
      const double length = std::sqrt(ray.dot(ray));
      Vec3 direction;
      for (int a = 0; a < 3; ++a)
        direction[a] = (pose.r[3 * a] * ray[0] + pose.r[3 * a + 1] * ray[1] + pose.r[3 * a + 2]) / length;
      Hit hit = meet_room(p, origin, direction);
      for (size_t i = 0; i < placed.size(); ++i) {
        Hit other = meet_object(placed[i], p.table_m, origin, direction);
        other.object = static_cast<int>(i);
        if (other.t < hit.t) hit = other;
      }
      view.z.push_back(hit.t == kNever ? 0 : hit.t / length);
      view.hits.push_back(hit);
    }
  return view;
}

double with_noise(const View& view, int x, int y, const SceneParameters& p, cv::RNG& random) {
  constexpr double kStep_m = 0.03;
  double z = view.at(x, y);
  static constexpr int kAround[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  for (const auto& step : kAround) {
    const int u = x + step[0], v = y + step[1];
    if (u < 0 || v < 0 || u >= view.columns || v >= view.rows || view.at(u, v) - view.at(x, y) <= kStep_m) continue;
    if (random.uniform(0.0, 1.0) < p.flying_share) z = random.uniform(view.at(x, y), view.at(u, v));
    break;
  }
  const double focal_baseline = p.focal_px * p.baseline_m;
  return focal_baseline / (focal_baseline / z + random.gaussian(p.disparity_sigma_px));
}

Colour colour_of(const Hit& hit, double light, const SceneParameters& p, cv::RNG& random) {
  static const Vec3 kLamp = Vec3(0.3, -0.5, 0.81);
  const double shade = light * (0.6 + 0.4 * std::max(0.0, hit.normal.dot(kLamp)));
  const auto level = [&](int channel) {
    return cv::saturate_cast<uint8_t>(static_cast<double>(hit.bgr[channel]) * shade + random.gaussian(p.noise_sigma));
  };
  const uint8_t b = level(0), g = level(1), r = level(2);
  return {b, g, r};
}

PlacedModel vary(const std::vector<Model>& models, size_t kind, const SceneParameters& p, cv::RNG& random) {
  PlacedModel placed{kind, models[kind], 0, 0, random.uniform(-std::numbers::pi, std::numbers::pi)};
  const auto factor = [&] { return random.uniform(1 - p.size_spread, 1 + p.size_spread); };
  const double along = factor(), across = factor(), up = factor();
  for (Part& part : placed.model.parts) {
    const bool round = part.solid != Solid::box;
    part.x *= along, part.y *= round ? along : across, part.z *= up;
    part.length *= along, part.width *= round ? along : across, part.height *= up;
  }
  for (int c = 0; c < 3; ++c)
    placed.model.bgr[c] += static_cast<float>(random.uniform(-p.colour_spread, p.colour_spread));
  return placed;
}

}  // namespace

std::vector<Model> table_models() {
  constexpr auto box = Solid::box, cylinder = Solid::cylinder, sphere = Solid::sphere;
  return {{"carton", {{box, 0, 0, 0, 0.20, 0.12, 0.16}}, {70, 120, 170}},
          {"book", {{box, 0, 0, 0, 0.24, 0.17, 0.04}}, {150, 60, 50}},
          {"can", {{cylinder, 0, 0, 0, 0.09, 0, 0.13}}, {60, 60, 190}},
          {"bottle", {{cylinder, 0, 0, 0, 0.08, 0, 0.18}, {cylinder, 0, 0, 0.18, 0.035, 0, 0.08}}, {60, 140, 60}},
          {"ball", {{sphere, 0, 0, 0, 0.16, 0, 0}}, {40, 170, 210}},
          {"mug", {{cylinder, 0, 0, 0, 0.09, 0, 0.10}, {box, 0.06, 0, 0.02, 0.05, 0.016, 0.06}}, {200, 190, 190}}};
}

std::vector<Model> strange_models() {
  constexpr auto box = Solid::box, cylinder = Solid::cylinder, sphere = Solid::sphere;
  return {
      {"stool",
       {{box, 0, 0, 0.16, 0.22, 0.22, 0.03},
        {box, 0.09, 0.09, 0, 0.03, 0.03, 0.16},
        {box, -0.09, 0.09, 0, 0.03, 0.03, 0.16},
        {box, 0.09, -0.09, 0, 0.03, 0.03, 0.16},
        {box, -0.09, -0.09, 0, 0.03, 0.03, 0.16}},
       {80, 100, 130}},
      {"angle", {{box, 0, 0, 0, 0.28, 0.06, 0.10}, {box, 0.11, 0.11, 0, 0.06, 0.16, 0.10}}, {150, 150, 60}},
      {"hat", {{cylinder, 0, 0, 0, 0.26, 0, 0.02}, {cylinder, 0, 0, 0.02, 0.14, 0, 0.09}}, {50, 50, 60}},
      {"lamp",
       {{cylinder, 0, 0, 0, 0.14, 0, 0.03}, {cylinder, 0, 0, 0.03, 0.03, 0, 0.16}, {sphere, 0, 0, 0.18, 0.12, 0, 0}},
       {180, 120, 170}}};
}

Scene make_scene_of(const std::vector<PlacedModel>& placed, const SceneParameters& p, cv::RNG& random) {
  Scene scene;
  scene.camera = {p.focal_px, (kWidth - 1) / 2.0, (kHeight - 1) / 2.0, p.baseline_m};
  scene.step_px = p.step_px;
  scene.sensor_in_robot = mapping_3d::camera_mount(0, 0.15, p.camera_height_m, 0, p.camera_tilt_rad);
  scene.placed = placed;
  const View view = look(placed, p, scene.camera, scene.sensor_in_robot);
  const double light = random.uniform(p.light_min, p.light_max);
  for (int row = 0; row < view.rows; ++row)
    for (int column = 0; column < view.columns; ++column) {
      if (view.at(column, row) <= 0) continue;
      const Hit& hit = view.hits[static_cast<size_t>(row * view.columns + column)];
      const double z = with_noise(view, column, row, p, random);
      scene.points.push_back({static_cast<float>((column * p.step_px - scene.camera.cu_px) * z / p.focal_px),
                              static_cast<float>((row * p.step_px - scene.camera.cv_px) * z / p.focal_px),
                              static_cast<float>(z)});
      scene.colours.push_back(colour_of(hit, light, p, random));
      scene.object.push_back(hit.object);
    }
  return scene;
}

Scene make_scene(const std::vector<Model>& models, const std::vector<size_t>& kinds, const SceneParameters& p,
                 uint64_t seed, uint64_t index) {
  constexpr double kApart_m = 0.34, kMiddle_m = 1.1;
  cv::RNG random(seed * 0x9E3779B97F4A7C15ull + index + 1);
  for (int k = 0; k < 8; ++k) random.next();  // neighbouring states part
  std::vector<PlacedModel> placed;
  for (size_t i = 0; i < kinds.size(); ++i) {
    PlacedModel next = vary(models, kinds[i], p, random);
    next.x =
        kApart_m * (static_cast<double>(i) - static_cast<double>(kinds.size() - 1) / 2) + random.uniform(-0.03, 0.03);
    next.y = kMiddle_m + random.uniform(-0.15, 0.15);
    placed.push_back(next);
  }
  return make_scene_of(placed, p, random);
}

}  // namespace takt::object_3d
