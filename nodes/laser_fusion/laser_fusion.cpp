// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/laser_fusion.hpp"

#include <algorithm>

#include "nodes/laser_fusion/thinning.hpp"

namespace takt::laser_fusion {
namespace {

constexpr double kSearchVoxel_m = 0.1;  // the smallest; a room of 1000 points has some 25 cm

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

void LaserFusion::prepare() {
  const auto few_of = [&](const cloud::CloudView& cloud, std::vector<Point>& out) {
    cloud::CloudBuffer buffer(out, {});
    thin_out(cloud, kSearchVoxel_m, grid_, buffer);
    return clusters_.filter(buffer.points(), parameters_.clusters);
  };
  if (stage_ == Stage::thin_laser) {
    few_laser_count_ = few_of({laser_, {}}, few_laser_);
    stage_ = Stage::build;
    return;
  }
  const size_t few_vision_count = few_of({std::span<const Point>(vision_).first(vision_count_), {}}, few_vision_);
  matcher_.set(std::span<const Point>(few_laser_).first(few_laser_count_),
               std::span<const Point>(few_vision_).first(few_vision_count));
  genetic_.begin(start_, seed_);
  stage_ = Stage::search;
}

double LaserFusion::share() const {
  return few_laser_count_ == 0 ? 0
                               : static_cast<double>(genetic_.quality().pairs) / static_cast<double>(few_laser_count_);
}

}  // namespace takt::laser_fusion
