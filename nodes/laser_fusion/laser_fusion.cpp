// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/laser_fusion.hpp"

#include <algorithm>

#include "nodes/laser_fusion/thinning.hpp"

namespace takt::laser_fusion {
namespace {

constexpr double kSearchVoxel_m = 0.1;  // the smallest; a room of 1000 points has some 25 cm
constexpr int kFusionDivisions = 2;     // many points close together: larger voxels are built sooner
constexpr size_t kFusedAtOnce = 512;

}  // namespace

LaserFusion::LaserFusion(size_t laser_points, size_t vision_points, const LaserFusionParameters& p)
    : parameters_(p),
      vision_(p.vision_points),
      few_laser_(p.search_points),
      few_vision_(p.search_points),
      vision_colours_(p.vision_points),
      grid_(std::max({laser_points, vision_points, p.vision_points})),
      clusters_(p.search_points),
      vision_table_(p.vision_points),
      matcher_(p.search_points, p.search_points, p.quality),
      genetic_(matcher_, p.genetic) {
  laser_.reserve(laser_points);
  fused_.reserve(laser_points);
}

void LaserFusion::begin(std::span<const Point> laser, const cloud::CloudView& vision, const Rigid& vision_in_laser,
                        uint64_t seed) {
  laser_.assign(laser.begin(), laser.begin() + static_cast<std::ptrdiff_t>(std::min(laser.size(), laser_.capacity())));
  cloud::CloudBuffer few(vision_, vision_colours_);
  thin_out(vision, parameters_.vision_voxel_m, grid_, few);
  vision_count_ = few.size();
  if (!vision.coloured()) std::fill(vision_colours_.begin(), vision_colours_.end(), Colour{128, 128, 128});
  start_ = vision_in_laser;
  seed_ = seed;
  stage_ = Stage::thin_laser;
}

void LaserFusion::go_on() {
  switch (stage_) {
    case Stage::thin_laser:
      few_laser_count_ = thinned(laser_, few_laser_);
      stage_ = Stage::thin_vision;
      return;
    case Stage::thin_vision:
      few_vision_count_ = thinned(std::span<const Point>(vision_).first(vision_count_), few_vision_);
      stage_ = Stage::drop_clusters;
      return;
    case Stage::drop_clusters:
      few_laser_count_ = without_clusters(few_laser_, few_laser_count_);
      few_vision_count_ = without_clusters(few_vision_, few_vision_count_);
      matcher_.begin(std::span<const Point>(few_laser_).first(few_laser_count_),
                     std::span<const Point>(few_vision_).first(few_vision_count_));
      stage_ = Stage::build;
      return;
    case Stage::build:
      if (!matcher_.go_on()) return;
      genetic_.begin(start_, seed_);
      stage_ = Stage::search;
      return;
    case Stage::search:
      if (genetic_.go_on()) begin_colours();
      return;
    case Stage::build_colours:
      if (vision_table_.go_on()) stage_ = Stage::fuse;
      return;
    case Stage::fuse: return fuse_some();
    case Stage::idle:
    case Stage::done: return;
  }
}

size_t LaserFusion::thinned(std::span<const Point> points, std::vector<Point>& out) {
  cloud::CloudBuffer buffer(out, {});
  thin_out({points, {}}, kSearchVoxel_m, grid_, buffer);
  return buffer.size();
}

size_t LaserFusion::without_clusters(std::span<Point> points, size_t count) {
  return clusters_.filter(points.first(count), parameters_.clusters);
}

void LaserFusion::begin_colours() {
  vision_table_.begin(std::span<const Point>(vision_).first(vision_count_), farthest_match_m(parameters_.fusion),
                      kFusionDivisions);
  fused_.clear();
  next_ = 0;
  stage_ = Stage::build_colours;
}

void LaserFusion::fuse_some() {
  const size_t count = std::min(kFusedAtOnce, laser_.size() - next_);
  fuse(std::span<const Point>(laser_).subspan(next_, count), vision_table_, vision_colours_, vision_in_laser(),
       parameters_.fusion, [&](const Point& point, const Colour& colour, double confidence) {
         fused_.push_back({point, colour, confidence});
       });
  next_ += count;
  if (next_ == laser_.size()) stage_ = Stage::done;
}

double LaserFusion::share() const {
  return few_laser_count_ == 0 ? 0
                               : static_cast<double>(genetic_.quality().pairs) / static_cast<double>(few_laser_count_);
}

}  // namespace takt::laser_fusion
