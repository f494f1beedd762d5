// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/finder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
namespace takt::object_3d {
namespace {

/// Distance between two rectangles, 0 where they overlap: of separating axes the one with the widest gap.
double gap_between(const Rectangle& a, const Rectangle& b) {
  const auto half_extent = [](const Rectangle& r, double ux, double uy) {
    const double c = std::cos(r.yaw_rad), s = std::sin(r.yaw_rad);
    return std::abs(ux * c + uy * s) * r.length / 2 + std::abs(uy * c - ux * s) * r.width / 2;
  };
  double gap = 0;
  for (const Rectangle* r : {&a, &b})
    for (const double turn : {0.0, std::numbers::pi / 2}) {
      const double ux = std::cos(r->yaw_rad + turn), uy = std::sin(r->yaw_rad + turn);
      const double apart = std::abs((b.centre.x - a.centre.x) * ux + (b.centre.y - a.centre.y) * uy);
      gap = std::max(gap, apart - half_extent(a, ux, uy) - half_extent(b, ux, uy));
    }
  return gap;
}

bool holds(const Rectangle& r, double x, double y) {
  const double c = std::cos(r.yaw_rad), s = std::sin(r.yaw_rad), dx = x - r.centre.x, dy = y - r.centre.y;
  return std::abs(c * dx + s * dy) <= r.length / 2 && std::abs(c * dy - s * dx) <= r.width / 2;
}

}  // namespace

ObjectFinder::ObjectFinder(size_t capacity, size_t most_objects, const FinderParameters& parameters,
                           Classifier* classifier)
    : parameters_(parameters),
      classifier_(classifier),
      grid_(capacity),
      smoother_(capacity),
      colour_seeds_(capacity),
      segmenter_(capacity, most_objects),
      describer_(capacity),
      camera_points_(capacity),
      robot_points_(capacity),
      colours_(capacity),
      source_(capacity),
      seeds_(capacity),
      scratch_(capacity),
      object_points_(capacity),
      object_colours_(capacity),
      objects_(most_objects) {}

void ObjectFinder::begin(const SensorCloud& cloud, std::span<const Detection> boxes) {
  count_ = described_ = 0;
  step_per_focal_ = cloud.camera.focal_px > 0 ? cloud.step_px / cloud.camera.focal_px : 0;
  take_points(cloud);
  grid_.fill(std::span(camera_points_).first(points_), cloud.camera, cloud.step_px);
  const size_t seeds = find_seeds(cloud, boxes);
  segmenter_.begin(std::span(robot_points_).first(points_), std::span(colours_).first(points_),
                   std::span(seeds_).first(seeds), parameters_.segment);
}

Point ObjectFinder::in_robot(const Point& p) const {
  const mapping_3d::Position q =
      mapping_3d::transformed(mount_, static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
  return {static_cast<float>(q.x_m), static_cast<float>(q.y_m), static_cast<float>(q.z_m)};
}

void ObjectFinder::take_points(const SensorCloud& cloud) {
  mount_ = mapping_3d::to_affine(cloud.sensor_in_robot);
  const bool coloured = cloud.colours.size() == cloud.points.size();
  const double range2 = parameters_.range_m * parameters_.range_m;
  const size_t size = std::min(cloud.points.size(), camera_points_.size());
  points_ = 0;
  for (uint32_t i = 0; i < size; ++i) {
    const Point& p = cloud.points[i];
    const double x = static_cast<double>(p.x), y = static_cast<double>(p.y), z = static_cast<double>(p.z);
    if (!(x * x + y * y + z * z <= range2)) continue;  // so that NaN is left out
    camera_points_[points_] = p;
    colours_[points_] = coloured ? cloud.colours[i] : Colour{};
    source_[points_] = i;
    robot_points_[points_++] = in_robot(p);
  }
  support_.reset();
  if (!parameters_.needs_support) return;
  support_ = find_support(std::span(robot_points_).first(points_), parameters_.support);
  size_t kept = 0;
  for (size_t i = 0; i < points_ && support_; ++i) {
    if (support_->above(robot_points_[i]) <= parameters_.clearance_m) continue;
    camera_points_[kept] = camera_points_[i];
    robot_points_[kept] = robot_points_[i];
    colours_[kept] = colours_[i];
    source_[kept++] = source_[i];
  }
  points_ = kept;
}

size_t ObjectFinder::find_seeds(const SensorCloud& cloud, std::span<const Detection> boxes) {
  const auto points = std::span<const Point>(camera_points_).first(points_);
  switch (parameters_.seeds) {
    case SeedSource::standing:
      std::iota(seeds_.begin(), seeds_.begin() + static_cast<ptrdiff_t>(points_), 0u);
      return points_;
    case SeedSource::colour:
      return colour_seeds_.find(grid_, colours_, parameters_.colour, parameters_.components, cloud.step_px, seeds_);
    case SeedSource::boxes: break;
  }
  size_t found = 0;
  for (const Detection& box : boxes) {
    const auto seed = seed_in_box(grid_, points, box, cloud.step_px, scratch_);
    if (seed && found < seeds_.size()) seeds_[found++] = *seed;
  }
  return found;
}

void ObjectFinder::describe_new() {
  while (described_ < segmenter_.segments().size()) describe(segmenter_.segments()[described_++]);
}

void ObjectFinder::describe(const Segment& segment) {
  std::span<uint32_t> members = segmenter_.points_of(segment);
  size_t count = members.size();
  if (parameters_.smooth && !grid_.empty()) {
    const auto smooth = smoother_.run(grid_, camera_points_, members, parameters_.segment.grow.d_max_m);
    count = smooth.size();
    std::transform(smooth.begin(), smooth.end(), object_points_.begin(), [&](const Point& p) { return in_robot(p); });
  } else {
    for (size_t i = 0; i < count; ++i) object_points_[i] = robot_points_[members[i]];
  }
  float low = std::numeric_limits<float>::infinity();
  double x = 0, y = 0, spacing_m = 0;
  for (size_t i = 0; i < count; ++i) {
    object_colours_[i] = colours_[members[i]];
    low = std::min(low, object_points_[i].z);
    x += static_cast<double>(object_points_[i].x), y += static_cast<double>(object_points_[i].y);
    spacing_m += step_per_focal_ * static_cast<double>(camera_points_[members[i]].z);
  }
  const double n = static_cast<double>(std::max<size_t>(1, count));
  const double level = support_ ? support_->z(x / n, y / n) : static_cast<double>(low);
  const bool stands = support_ && static_cast<double>(low) - level < parameters_.gap_m;
  const auto what = describer_.describe(std::span(object_points_).first(count), std::span(object_colours_).first(count),
                                        stands ? level : static_cast<double>(low), spacing_m / n);
  if (!what) return;
  FoundObject& object = objects_[count_++];
  object = {*what,
            {},
            stands ? kOnSupport : kOnNothing,
            kBesideNothing,
            static_cast<uint32_t>(&segment - segmenter_.segments().data())};
  if (classifier_ != nullptr) object.answer = classifier_->classify(what->attributes);
}

void ObjectFinder::relate() {
  const auto found = std::span(objects_).first(count_);
  for (FoundObject& object : found) {
    const Rectangle& own = object.what.outline;
    if (object.on != kOnSupport) {
      double nearest = parameters_.gap_m;
      for (size_t k = 0; k < found.size(); ++k) {
        const double gap = std::abs(object.what.base_z_m - found[k].what.top_z_m);
        if (&found[k] == &object || gap >= nearest) continue;
        if (!holds(found[k].what.outline, own.centre.x, own.centre.y)) continue;
        nearest = gap;
        object.on = static_cast<int>(k);
      }
    }
  }
  for (FoundObject& object : found) {
    double nearest = parameters_.beside_m;
    for (size_t k = 0; k < found.size() && object.on != kOnNothing; ++k) {
      if (&found[k] == &object || found[k].on != object.on) continue;
      const double gap = gap_between(object.what.outline, found[k].what.outline);
      if (gap > nearest) continue;
      nearest = gap;
      object.beside = static_cast<int>(k);
    }
  }
}

std::span<const uint32_t> ObjectFinder::points_of(const FoundObject& object) {
  const std::span<uint32_t> members = segmenter_.points_of(segmenter_.segments()[object.segment]);
  for (size_t i = 0; i < members.size(); ++i) scratch_[i] = source_[members[i]];
  return std::span(scratch_).first(members.size());
}

}  // namespace takt::object_3d
