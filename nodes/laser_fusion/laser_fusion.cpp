// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/laser_fusion.hpp"

#include <algorithm>
#include <stdexcept>

namespace takt::laser_fusion {
namespace {

constexpr double kSearchVoxel_m = 0.1;  // the smallest; a room of 1000 points has some 25 cm
constexpr int kFusionDivisions = 2;     // many points close together: larger voxels are built sooner
constexpr size_t kFusedAtOnce = 512;

}  // namespace

LaserFusion::LaserFusion(size_t laser_points, size_t vision_points, const LaserFusionParameters& p)
    : parameters_(p),
      next_parameters_(p),
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
  all_vision_.reserve(vision_points);
  all_colours_.reserve(vision_points);
  fused_.reserve(laser_points);
}

void LaserFusion::tune(const LaserFusionParameters& parameters) {
  if (all_locked(parameters.genetic.locks))
    throw std::invalid_argument("genetic ICP has nothing to vary: all six parameters are locked");
  next_parameters_ = parameters;
}

void LaserFusion::use(const LaserFusionParameters& parameters) {
  parameters_ = parameters;
  matcher_.tune(parameters.quality);
  genetic_.tune(parameters.genetic);
}

void LaserFusion::begin(std::span<const Point> laser, const cloud::CloudView& vision, const Rigid& vision_in_laser,
                        uint64_t seed, bool coloured) {
  const auto copied = [](const auto& from, auto& into) {
    into.assign(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(std::min(from.size(), into.capacity())));
  };
  copied(laser, laser_);
  copied(vision.points, all_vision_);
  copied(vision.coloured() ? vision.colours : std::span<const Colour>(), all_colours_);
  start_ = vision_in_laser;
  seed_ = seed;
  coloured_ = coloured;
  use(next_parameters_);
  begin_again();
}

void LaserFusion::begin_again() {
  fused_.clear();
  portions_ = {};
  thinning_.begin({all_vision_, all_colours_}, parameters_.vision_voxel_m, {vision_, vision_colours_});
  stage_ = Stage::take_vision;
}

void LaserFusion::remember(StateArchive& archive) {
  Stage stage = stage_;
  std::array<uint32_t, 2> portions = portions_;
  TAKT_STATE(archive, stage);
  if (archive.loads()) stage_ = Stage::idle;
  if (stage == Stage::idle) {
    genetic_.room(archive);
    return archive.room(laser_.capacity() * sizeof(Point) + all_vision_.capacity() * (sizeof(Point) + sizeof(Colour)) +
                        sizeof *this);
  }
  LaserFusionParameters parameters = parameters_;
  TAKT_STATE(archive, portions, laser_, all_vision_, all_colours_, start_, seed_, coloured_, parameters);
  if (archive.loads() && !archive.failed()) {
    if (all_locked(parameters.genetic.locks)) return archive.fail();
    use(parameters);
    begin_again();
    for (uint32_t i = 0; i < portions[0]; ++i) go_on();
  }
  TAKT_STATE(archive, genetic_);
  if (!archive.loads() || archive.failed() || stage <= Stage::search) return;
  if (coloured_) begin_colours();
  for (uint32_t i = 0; i < portions[1]; ++i) go_on();
  stage_ = stage;
}

void LaserFusion::go_on() {
  if (stage_ != Stage::search) ++portions_[stage_ < Stage::search ? 0 : 1];
  switch (stage_) {
    case Stage::take_vision:
      if (!thinning_.go_on(grid_)) return;
      vision_count_ = thinning_.size();
      if (all_colours_.empty()) std::fill(vision_colours_.begin(), vision_colours_.end(), Colour{128, 128, 128});
      return thin(Stage::thin_laser, laser_, few_laser_);
    case Stage::thin_laser:
      if (!thinning_.go_on(grid_)) return;
      few_laser_count_ = thinning_.size();
      return thin(Stage::thin_vision, std::span<const Point>(vision_).first(vision_count_), few_vision_);
    case Stage::thin_vision:
      if (!thinning_.go_on(grid_)) return;
      few_vision_count_ = thinning_.size();
      return drop_clusters(Stage::drop_of_laser, std::span(few_laser_).first(few_laser_count_));
    case Stage::drop_of_laser:
      if (!clusters_.go_on()) return;
      few_laser_count_ = clusters_.kept();
      return drop_clusters(Stage::drop_of_vision, std::span(few_vision_).first(few_vision_count_));
    case Stage::drop_of_vision:
      if (!clusters_.go_on()) return;
      few_vision_count_ = clusters_.kept();
      matcher_.begin(std::span<const Point>(few_laser_).first(few_laser_count_),
                     std::span<const Point>(few_vision_).first(few_vision_count_));
      stage_ = Stage::build;
      return;
    case Stage::build:
      if (!matcher_.go_on()) return;
      genetic_.begin(start_, seed_);
      stage_ = Stage::search;
      return;
    case Stage::search: return search_or_end();
    case Stage::build_colours:
      if (vision_table_.go_on()) stage_ = Stage::fuse;
      return;
    case Stage::fuse: return fuse_some();
    case Stage::idle:
    case Stage::done: return;
  }
}

void LaserFusion::thin(Stage stage, std::span<const Point> points, std::vector<Point>& out) {
  thinning_.begin({points, {}}, kSearchVoxel_m, {out, {}});
  stage_ = stage;
}

void LaserFusion::drop_clusters(Stage stage, std::span<Point> points) {
  clusters_.begin(points, parameters_.clusters);
  stage_ = stage;
}

void LaserFusion::search_or_end() {
  if (!genetic_.go_on()) return;
  if (coloured_) begin_colours();
  else stage_ = Stage::done;
}

void LaserFusion::begin_colours() {
  vision_table_.begin(std::span<const Point>(vision_).first(vision_count_), farthest_match_m(parameters_.fusion),
                      kFusionDivisions);
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
