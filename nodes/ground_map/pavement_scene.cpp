// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/pavement_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "nodes/mapping_3d/pose.hpp"

namespace takt::ground_map {
namespace {

constexpr double kKerbWidth = 0.15, kRoadDepth = -0.12;  // m
constexpr double kSun[3] = {-0.55, 0.35, 0.75};          // towards the sun
constexpr double kShade = 0.62, kHardShade = 0.45;       // light that a shadow leaves

/// Whitened bits of a counter (the finaliser of SplitMix64, Steele, Lea, Flood 2014).
uint64_t bits(uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}
/// In -1..1, a function of its arguments alone.
double random(uint64_t seed, int64_t a, int64_t b = 0) {
  const uint64_t mixed = bits(bits(seed ^ static_cast<uint64_t>(a) * 0x9E3779B1u) ^ static_cast<uint64_t>(b));
  return static_cast<double>(mixed >> 11) * 0x1p-52 - 1;
}
/// Random values at the corners of a lattice, bilinear between them.
double smooth_noise(uint64_t seed, double x, double y, double period) {
  const double u = x / period, v = y / period, fu = std::floor(u), fv = std::floor(v), s = u - fu, t = v - fv;
  const auto i = static_cast<int64_t>(fu), j = static_cast<int64_t>(fv);
  return (1 - t) * ((1 - s) * random(seed, i, j) + s * random(seed, i + 1, j)) +
         t * ((1 - s) * random(seed, i, j + 1) + s * random(seed, i + 1, j + 1));
}
/// A pattern of that size blurs away with distance, as under a lens.
double visible(double distance_m, double size_m) { return std::clamp(150 * size_m / distance_m, 0.0, 1.0); }

/// Bricks of 20 x 10 cm, each with its own tone, dark joints, stains.
double brick_tone(uint64_t seed, double x, double y, double distance) {
  const double row = std::floor(y / 0.10), shift = static_cast<int64_t>(row) % 2 == 0 ? 0 : 0.10;
  const double column = std::floor((x + shift) / 0.20);
  const double in_x = x + shift - column * 0.20, in_y = y - row * 0.10;
  const bool joint = in_x < 0.008 || in_y < 0.008;
  const double tone = 0.09 * random(seed, static_cast<int64_t>(column), static_cast<int64_t>(row));
  return 1 + tone * visible(distance, 0.10) + 0.07 * smooth_noise(seed + 1, x, y, 0.9) +
         0.06 * random(seed + 2, static_cast<int64_t>(x * 200), static_cast<int64_t>(y * 200)) *
             visible(distance, 0.01) -
         (joint ? 0.35 * visible(distance, 0.008) : 0.05);
}

/// Slabs of half a metre, each with its own tone, dark joints.
double slab_tone(uint64_t seed, double x, double y, double distance) {
  const double column = std::floor(x / 0.5), row = std::floor(y / 0.5);
  const bool joint = x - column * 0.5 < 0.01 || y - row * 0.5 < 0.01;
  return 1 + 0.05 * random(seed, static_cast<int64_t>(column), static_cast<int64_t>(row)) +
         0.05 * smooth_noise(seed + 1, x, y, 0.2) - (joint ? 0.3 * visible(distance, 0.01) : 0.0);
}

/// Whether the shadow of a trunk lies there: a slanting band, one every 2.6 m of the way.
bool in_hard_shadow(uint64_t seed, double x, double y) {
  const double along = (y + 0.4 * x) / 2.6, band = std::floor(along);
  const double width = 0.27 + 0.1 * random(seed, static_cast<int64_t>(band));
  return along - band < width;
}

/// Light that the sun's reflection adds: of 255, nothing far from it.
double glare_at(double x_share, double y_share, int frame) {
  const double dx = x_share - 0.5 - 0.25 * std::sin(0.15 * frame), dy = (y_share - 0.62) * 0.75;
  return 900 * std::exp(-(dx * dx + dy * dy) / (2 * 0.045 * 0.045));
}

/// What lens and sensor make of it: a blur of 1 2 1 along both axes, and noise of about 4 grey levels (a triangle).
void expose(ImageView<const float> sharp, uint64_t seed, ImageView<uint8_t> bgr) {
  for (int y = 0; y < bgr.height; ++y)
    for (int x = 0; x < bgr.width; ++x)
      for (int k = 0; k < 3; ++k) {
        double sum = 0;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx)
            sum += static_cast<double>((2 - std::abs(dx)) * (2 - std::abs(dy))) *
                   sharp.at(std::clamp(x + dx, 0, bgr.width - 1), std::clamp(y + dy, 0, bgr.height - 1), k);
        const int64_t counter = (int64_t{y} * bgr.width + x) * 3 + k;
        const double grain = 5 * (random(seed, counter, 1) + random(seed, counter, 2));
        bgr.at(x, y, k) = static_cast<uint8_t>(std::clamp(sum / 16 + grain + 0.5, 0.0, 255.0));
      }
}

}  // namespace

PavementScene::PavementScene(const PavementOptions& options) : options_(options) {
  // The wide camera of ACE (97 degrees), as it looks down before the robot.
  camera_.focal_px = 0.5 * options_.width / std::tan(97 * std::numbers::pi / 360);
  camera_.cu_px = 0.5 * (options_.width - 1);
  camera_.cv_px = 0.5 * (options_.height - 1);
  camera_.baseline_m = 0.12;
  camera_in_robot_ = mapping_3d::camera_mount(-0.06, 0.25, 1.2, 0, -25 * std::numbers::pi / 180);
  add_obstacles();
}

void PavementScene::add_obstacles() {
  constexpr Colour3 kColours[] = {{150, 90, 50}, {60, 190, 210}, {140, 140, 135}, {70, 100, 150}, {200, 205, 205}};
  const double end = options_.frames * options_.frame_step_m + 25;
  int64_t n = 0;
  for (double y = 2.6; y < end; y += options_.obstacles_from_m + 1.2 * (1 + random(options_.seed, n, 1)), ++n) {
    const double side = random(options_.seed, n, 2) < 0 ? -1 : 1;
    const double half_x = 0.13 + 0.08 * (1 + random(options_.seed, n, 3)), half_y = half_x * 1.2;
    const double x = side * (0.75 + 0.2 * (1 + random(options_.seed, n, 4)));
    const double height = 0.5 + 0.5 * (1 + random(options_.seed, n, 5));
    const auto kind = static_cast<size_t>(std::clamp((random(options_.seed, n, 6) + 1) * 2.5, 0.0, 4.0));
    boxes_.push_back({x - half_x, x + half_x, y - half_y, y + half_y, height, kColours[kind]});
  }
  boxes_.push_back({-6, -5, -10, end, 4, {165, 175, 185}});  // a house behind the grass
}

PlanarPose PavementScene::robot_in_map(int frame) const {
  const double y = frame * options_.frame_step_m, phase = y / 2.5;
  return {0.12 * std::sin(phase), y, part_at(y).turned_rad - 0.12 / 2.5 * std::cos(phase)};
}

const PavementPart& PavementScene::part_at(double y_m) const {
  auto part = options_.parts.end() - 1;
  while (part != options_.parts.begin() && y_m < part->from_y_m) --part;
  return *part;
}

std::optional<size_t> PavementScene::part_seen(int frame) const {
  const double y = frame * options_.frame_step_m;
  const PavementPart &near = part_at(y - 0.5), &far = part_at(y + 4.5);
  if (&near != &far) return std::nullopt;
  return static_cast<size_t>(&near - options_.parts.data());
}

bool PavementScene::occupied(const FloorPoint& p) const {
  return std::any_of(boxes_.begin(), boxes_.end(),
                     [&](const Box& b) { return p.x_m >= b.x0 && p.x_m < b.x1 && p.y_m >= b.y0 && p.y_m < b.y1; });
}

bool PavementScene::drivable(const FloorPoint& p) const {
  const PavementPart& part = part_at(p.y_m);
  return p.x_m >= part.left_m && p.x_m < part.right_m && !occupied(p);
}

/// Nearest entry of the ray into the box before `distance`, which it then becomes; face 0: across x, 1: y, 2: top.
bool PavementScene::meets(const Ray& ray, const Box& box, double& distance, int& face) {
  const double origin[3] = {ray.ox, ray.oy, ray.oz}, direction[3] = {ray.dx, ray.dy, ray.dz};
  const double low[3] = {box.x0, box.y0, kRoadDepth}, high[3] = {box.x1, box.y1, box.height};
  double enter = 1e-6, leave = distance;
  int axis = -1;
  for (int k = 0; k < 3; ++k) {
    const double a = (low[k] - origin[k]) / direction[k], b = (high[k] - origin[k]) / direction[k];
    if (std::min(a, b) > enter) enter = std::min(a, b), axis = k;
    leave = std::min(leave, std::max(a, b));
  }
  if (axis < 0 || enter >= leave) return false;
  distance = enter;
  face = axis;
  return true;
}

bool PavementScene::in_shadow(double x, double y, double z, const std::vector<const Box*>& near) const {
  const Ray to_sun{x, y, z + 1e-3, kSun[0], kSun[1], kSun[2]};
  return std::any_of(near.begin(), near.end(), [&](const Box* box) {
    double distance = 1e9;
    int face = 0;
    return meets(to_sun, *box, distance, face);
  });
}

PavementScene::Hit PavementScene::ground(double x, double y, double z, double distance) const {
  const uint64_t seed = options_.seed * 1000;
  const PavementPart& part = part_at(y);
  if (x < part.left_m) {  // with patches of dry earth, nearly of the colour of the bricks
    const double tone =
        1 + 0.25 * smooth_noise(seed + 5, x, y, 0.25) +
        0.35 * random(seed + 6, static_cast<int64_t>(x * 60), static_cast<int64_t>(y * 60)) * visible(distance, 0.02);
    const bool dry = smooth_noise(seed + 4, x, y, 0.7) > 0.45;
    return {shade(dry ? Colour3{72, 102, 136} : Colour3{45, 105, 70}, tone), Truth::other};
  }
  const double dirt = 0.15 * smooth_noise(seed + 8, x, y, 0.3);
  if (z < -1e-6)
    return {shade({72, 70, 68}, 1 + dirt + 0.12 * smooth_noise(seed + 7, x, y, 0.03) * visible(distance, 0.03)),
            Truth::other};
  if (x >= part.right_m) return {shade({148, 157, 166}, 1 + dirt), Truth::other};
  return pavement(part, x, y, distance);
}

PavementScene::Hit PavementScene::pavement(const PavementPart& part, double x, double y, double distance) const {
  const uint64_t seed = options_.seed * 1000;
  const double dirt = 0.15 * smooth_noise(seed + 8, x, y, 0.3);
  const auto i = static_cast<int64_t>(std::floor(x / 0.05)), j = static_cast<int64_t>(std::floor(y / 0.05));
  if (random(seed + 12, i, j) > 0.985) return {shade({35, 95, 160}, 1 + 4 * dirt), Truth::ground};  // a leaf
  const double tint = 0.05 * smooth_noise(seed + 13, x, y, 0.15);
  switch (part.surface) {
    case Surface::bricks:
      return {shade({92 * (1 - tint), 112, 142 * (1 + tint)}, brick_tone(seed + 9, x, y, distance)), Truth::ground};
    case Surface::red_bricks:
      return {shade({70 * (1 - tint), 80, 150 * (1 + tint)}, brick_tone(seed + 9, x, y, distance)), Truth::ground};
    case Surface::slabs: return {shade({150, 158, 162}, slab_tone(seed + 9, x, y, distance)), Truth::ground};
    case Surface::asphalt: break;
  }
  return {shade({92, 90, 88}, 1 + dirt / 2 + 0.1 * smooth_noise(seed + 9, x, y, 0.03) * visible(distance, 0.03)),
          Truth::ground};
}

PavementScene::Hit PavementScene::trace(const Ray& ray, const std::vector<const Box*>& near) const {
  double distance = std::numeric_limits<double>::infinity();
  double z = 0;
  if (ray.dz < 0) {
    distance = -ray.oz / ray.dz;
    if (ray.ox + distance * ray.dx >= part_at(ray.oy + distance * ray.dy).right_m + kKerbWidth)
      z = kRoadDepth, distance = (kRoadDepth - ray.oz) / ray.dz;
  }
  const Box* box = nullptr;
  int face = 0;
  for (const Box* candidate : near)
    if (meets(ray, *candidate, distance, face)) box = candidate;
  const double x = ray.ox + distance * ray.dx, y = ray.oy + distance * ray.dy;
  if (box) {
    const double height = ray.oz + distance * ray.dz;
    const double light = (face == 0   ? 0.8
                          : face == 1 ? 0.65
                                      : 1.05) *
                         (1 + 0.06 * smooth_noise(options_.seed * 1000 + 11, x + y, height, 0.15));
    return {{box->colour.b * light, box->colour.g * light, box->colour.r * light}, Truth::other};
  }
  if (!(distance < 60)) return {{225, 205, 190}, Truth::other};  // sky, or so far that it looks like it
  Hit hit = ground(x, y, z, distance);
  if (in_shadow(x, y, z, near)) hit.colour = shade(hit.colour, kShade);
  else if (options_.hard_shadows && in_hard_shadow(options_.seed * 1000 + 14, x, y))
    hit.colour = shade(hit.colour, kHardShade);
  return hit;
}

void PavementScene::render(int frame, ImageView<uint8_t> bgr, ImageView<uint8_t> truth) const {
  const PlanarPose robot = robot_in_map(frame);
  const mapping_3d::Affine a = mapping_3d::to_affine(camera_in_robot_);
  const double c = std::cos(robot.theta_rad), s = std::sin(robot.theta_rad);
  const FloorPoint eye = transformed(robot, {a.t[0], a.t[1]});
  std::vector<const Box*> near;
  for (const Box& box : boxes_)
    if (box.y1 > eye.y_m - 3 && box.y0 < eye.y_m + 20) near.push_back(&box);
  const double clouds = options_.brightness * (1 + options_.flicker * random(options_.seed, frame, 15)) *
                        (0.93 + 0.17 * std::sin(0.11 * frame + static_cast<double>(options_.seed)));
  const double warm = 1 + 0.04 * std::sin(0.07 * frame);
  std::vector<float> colours(static_cast<size_t>(bgr.width) * static_cast<size_t>(bgr.height) * 3);
  const ImageView<float> sharp(colours.data(), bgr.width, bgr.height, 3);
  for (int y = 0; y < bgr.height; ++y)
    for (int x = 0; x < bgr.width; ++x) {
      const double u = (x - camera_.cu_px) / camera_.focal_px, v = (y - camera_.cv_px) / camera_.focal_px;
      const double rx = a.r[0] * u + a.r[1] * v + a.r[2], ry = a.r[3] * u + a.r[4] * v + a.r[5];
      const Hit hit =
          trace({eye.x_m, eye.y_m, a.t[2], c * rx - s * ry, s * rx + c * ry, a.r[6] * u + a.r[7] * v + a.r[8]}, near);
      truth.at(x, y) = static_cast<uint8_t>(hit.truth);
      const double white = options_.glare ? glare_at((x + 0.5) / bgr.width, (y + 0.5) / bgr.height, frame) : 0;
      sharp.at(x, y, 0) = static_cast<float>(hit.colour.b / warm * clouds + white);
      sharp.at(x, y, 1) = static_cast<float>(hit.colour.g * clouds + white);
      sharp.at(x, y, 2) = static_cast<float>(hit.colour.r * warm * clouds + white);
    }
  expose(sharp, bits(options_.seed * 7919 + static_cast<uint64_t>(frame)), bgr);
}

}  // namespace takt::ground_map
