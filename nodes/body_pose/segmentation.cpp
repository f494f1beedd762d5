// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/segmentation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace takt::body_pose {
namespace {

constexpr double kMostCells = 1 << 18;  // CellSort has a bucket for each of so many at least
constexpr double kPeakRadius_m = 0.20;
// Where head and trunk are looked at: so far below the top, within so much up and down, within that distance.
constexpr float kHeadDepth_m = 0.22f, kHeadReach_m = 0.6f;
constexpr float kTrunkBelow_m = 0.50f, kTrunkDepth_m = 0.15f, kTrunkReach_m = 0.45f;
constexpr float kBeginReach_m = 0.5f;  // everything that begins_at() lies within
// As far from a head's middle a point is still below it, across the line of sight and along it: only one side of a body
// is seen, and a back lies before the middle of what is seen of the head.
constexpr double kBelowAcross_m = 0.15, kBelowAlong_m = 0.30;

/// Spread of points across the line of sight: stereo has its noise along it.
class LateralSpread {
 public:
  /// The line of sight from the origin to that point, seen from above.
  explicit LateralSpread(const Point& towards) {
    const double distance = std::hypot(towards.x, towards.y);
    if (distance > 0) across_x_ = towards.y / distance, across_y_ = -towards.x / distance;
  }
  double across(const Point& p) const { return across_x_ * p.x + across_y_ * p.y; }
  double along(const Point& p) const { return across_x_ * p.y - across_y_ * p.x; }
  void add(const Point& p) {
    const double across = this->across(p);
    ++count_;
    x_ += p.x, y_ += p.y;
    across_ += across, squares_ += across * across;
  }
  int count() const { return count_; }
  double x() const { return x_ / count_; }
  double y() const { return y_ / count_; }
  /// Standard deviation, m.
  double value() const {
    const double mean = across_ / count_;
    return std::sqrt(std::max(0.0, squares_ / count_ - mean * mean));
  }

 private:
  double across_x_ = 1, across_y_ = 0;
  int count_ = 0;
  double x_ = 0, y_ = 0, across_ = 0, squares_ = 0;
};

}  // namespace

Segmentation::Segmentation(size_t capacity, const SegmentationParameters& p)
    : p_(p), outliers_(capacity), keep_(capacity), grid_(capacity), cells_(capacity) {
  const double volume = 4 * p.range_m * p.range_m * p.ceiling_m;
  edge_m_ = static_cast<float>(std::max(p.grow_m, 1.05 * std::cbrt(volume / kMostCells)));
  per_edge_ = 1 / edge_m_;
  across_ = static_cast<int>(2 * p.range_m / edge_m_) + 1;
  up_ = static_cast<int>(p.ceiling_m / edge_m_) + 1;
  map_side_ = static_cast<int>(std::ceil(2 * p.range_m / kMapCell_m));
  map_.resize(static_cast<size_t>(map_side_) * static_cast<size_t>(map_side_));
  top_.resize(map_.size());
  for (auto* points : {&cropped_, &reduced_, &clustered_}) points->resize(capacity);
  label_.resize(capacity);
  queue_.resize(capacity);
  seeds_.reserve(static_cast<size_t>(p.candidates));
  candidates_.reserve(static_cast<size_t>(p.candidates));
}

void Segmentation::tune(SegmentationParameters parameters) {
  parameters.range_m = p_.range_m;
  parameters.ceiling_m = p_.ceiling_m;
  parameters.grow_m = p_.grow_m;
  parameters.points_max = p_.points_max;
  parameters.candidates = p_.candidates;
  p_ = parameters;
}

std::span<const Candidate> Segmentation::run(std::span<const Point> points) {
  reduce(points);
  sort();
  find_seeds();
  grow();
  // A seed that is no head took points from those that are: without it they get them back.
  size_t kept = 0;
  for (size_t label = 0; label < seeds_.size(); ++label)
    if (plausible(label)) seeds_[kept++] = seeds_[label];
  if (kept < seeds_.size()) {
    seeds_.resize(kept);
    grow();
  }
  collect();
  return candidates_;
}

void Segmentation::reduce(std::span<const Point> points) {
  size_t kept = 0;
  const auto range = static_cast<float>(p_.range_m * p_.range_m), low = static_cast<float>(p_.floor_m),
             high = static_cast<float>(p_.ceiling_m);
  for (const Point& p : points.first(std::min(points.size(), cropped_.size())))
    if (p.x * p.x + p.y * p.y < range && p.z > low && p.z < high) cropped_[kept++] = p;
  outliers_.filter(std::span(cropped_).first(kept), p_.outliers, std::span(keep_).first(kept));
  size_t good = 0;
  for (size_t i = 0; i < kept; ++i)
    if (keep_[i] != 0) cropped_[good++] = cropped_[i];
  grid_.fill({std::span(cropped_).first(good), {}}, p_.voxel_m);
  count_ = 0;
  for (const cloud::Voxel& voxel : grid_.voxels()) reduced_[count_++] = voxel.mean();
}

void Segmentation::sort() {
  const double cells[3] = {static_cast<double>(across_), static_cast<double>(across_), static_cast<double>(up_)};
  layout_ = cells_.layout(cells, static_cast<size_t>(kMostCells));
  const auto low = -static_cast<float>(p_.range_m);
  cells_.sort(reduced(), layout_, [&](const Point& p) {
    return layout_.bucket(static_cast<uint32_t>(cell_of(p.x, low)), static_cast<uint32_t>(cell_of(p.y, low)),
                          static_cast<uint32_t>(cell_of(p.z, 0)));
  });
}

/// Calls visit(index) for the reduced points within that radius.
template <class Visit>
void Segmentation::for_each_near(const Point& p, float radius_m, const Visit& visit) const {
  const auto low = -static_cast<float>(p_.range_m);
  const float reach = radius_m * 1.001f;  // the cells are chosen generously, the points are not
  const auto first = [&](float v, float from) { return cell_of(std::max(v - reach, from), from); };
  const auto last = [&](float v, float from, int cells) { return std::min(cells - 1, cell_of(v + reach, from)); };
  const int x0 = first(p.x, low), x1 = last(p.x, low, across_);
  const int y0 = first(p.y, low), y1 = last(p.y, low, across_);
  const int z0 = first(p.z, 0), z1 = last(p.z, 0, up_);
  const cloud::SortedPoint* sorted = cells_.points();
  for (int z = z0; z <= z1; ++z)
    for (int y = y0; y <= y1; ++y) {
      const uint32_t row = layout_.bucket(0, static_cast<uint32_t>(y), static_cast<uint32_t>(z));
      const uint32_t end = cells_.start()[row + static_cast<uint32_t>(x1) + 1];
      for (uint32_t i = cells_.start()[row + static_cast<uint32_t>(x0)]; i < end; ++i)
        if (squared_distance({sorted[i].x, sorted[i].y, sorted[i].z}, p) <= radius_m * radius_m) visit(sorted[i].index);
    }
}

void Segmentation::find_seeds() {
  std::fill(map_.begin(), map_.end(), 0.0f);
  const auto column_of = [&](float v) {
    return std::clamp(static_cast<int>((v + p_.range_m) / kMapCell_m), 0, map_side_ - 1);
  };
  for (size_t i = 0; i < count_; ++i) {
    const auto cell = static_cast<size_t>(column_of(reduced_[i].y) * map_side_ + column_of(reduced_[i].x));
    if (reduced_[i].z <= map_[cell]) continue;
    map_[cell] = reduced_[i].z;
    top_[cell] = static_cast<uint32_t>(i);
  }
  seeds_.clear();
  std::fill_n(label_.begin(), count_, -1);
  for (int row = 0; row < map_side_; ++row)
    for (int column = 0; column < map_side_; ++column) {
      const auto cell = static_cast<size_t>(row * map_side_ + column);
      if (map_[cell] < static_cast<float>(p_.head_min_m) || !is_peak(column, row)) continue;
      Seed seed;
      if (judge_head(top_[cell], seed) && seeds_.size() < static_cast<size_t>(p_.candidates)) seeds_.push_back(seed);
    }
  drop_lower_neighbours();
  std::sort(seeds_.begin(), seeds_.end(), [](const Seed& a, const Seed& b) {
    return a.head.x * a.head.x + a.head.y * a.head.y < b.head.x * b.head.x + b.head.y * b.head.y;
  });
}

/// A hand or an elbow beside a head is none.
void Segmentation::drop_lower_neighbours() {
  constexpr float kBeside_m = 0.45f, kLower_m = 0.15f;
  const auto is_lower = [&](const Seed& seed) {
    return std::any_of(seeds_.begin(), seeds_.end(), [&](const Seed& other) {
      return other.top_m > seed.top_m + kLower_m &&
             squared_distance(seed.head, {other.head.x, other.head.y, seed.head.z}) < kBeside_m * kBeside_m;
    });
  };
  std::sort(seeds_.begin(), seeds_.end(), [](const Seed& a, const Seed& b) { return a.top_m < b.top_m; });
  // From low to high: what a seed is compared with is still there.
  for (size_t i = 0; i < seeds_.size();)
    if (is_lower(seeds_[i])) seeds_.erase(seeds_.begin() + static_cast<ptrdiff_t>(i));
    else ++i;
}

/// Nothing around the cell is higher.
bool Segmentation::is_peak(int column, int row) const {
  constexpr int kReach = static_cast<int>(kPeakRadius_m / kMapCell_m + 0.5);
  const float height = map_[static_cast<size_t>(row * map_side_ + column)];
  for (int dy = -kReach; dy <= kReach; ++dy)
    for (int dx = -kReach; dx <= kReach; ++dx) {
      const int x = column + dx, y = row + dy;
      if (x < 0 || y < 0 || x >= map_side_ || y >= map_side_ || dx * dx + dy * dy > kReach * kReach) continue;
      const float other = map_[static_cast<size_t>(y * map_side_ + x)];
      if (other > height || (other == height && (dy < 0 || (dy == 0 && dx < 0)))) return false;
    }
  return true;
}

/// The points that hang together with the top and are hardly lower, at the queue's front; returns how many. Who
/// stands beside is not among them, but all of a wide thing is.
size_t Segmentation::gather_head(uint32_t top) {
  const auto peak = static_cast<int32_t>(top);  // marks what was visited from here
  const Point& highest = reduced_[top];
  size_t end = 0;
  const auto claim = [&](uint32_t i) {
    if (label_[i] == peak || reduced_[i].z <= highest.z - kHeadDepth_m ||
        squared_distance(reduced_[i], highest) > kHeadReach_m * kHeadReach_m)
      return;
    label_[i] = peak;
    queue_[end++] = i;
  };
  claim(top);
  for (size_t next = 0; next < end; ++next)
    for_each_near(reduced_[queue_[next]], static_cast<float>(p_.head_link_m), claim);
  return end;
}

/// Across the line of sight the topmost part must be as wide as a head, what is below it wider, and much of
/// that below the head itself: not so for a hand held out.
bool Segmentation::judge_head(uint32_t top, Seed& seed) {
  const Point& highest = reduced_[top];
  if (highest.z > static_cast<float>(p_.ceiling_m) - kHeadDepth_m / 2) return false;  // goes on above
  LateralSpread head(highest), trunk(highest);
  for (const uint32_t i : std::span(queue_).first(gather_head(top))) head.add(reduced_[i]);
  if (head.count() < p_.head_points || head.value() < p_.head_spread_min_m || head.value() > p_.head_spread_max_m)
    return false;
  const Point middle{static_cast<float>(head.x()), static_cast<float>(head.y()), highest.z - kTrunkBelow_m};
  int below = 0;
  for_each_near(middle, kTrunkReach_m, [&](uint32_t i) {
    const Point& p = reduced_[i];
    if (std::abs(p.z - middle.z) >= kTrunkDepth_m) return;
    trunk.add(p);
    below += std::abs(trunk.across(p) - trunk.across(middle)) < kBelowAcross_m &&
                     std::abs(trunk.along(p) - trunk.along(middle)) < kBelowAlong_m
                 ? 1
                 : 0;
  });
  if (trunk.count() < p_.head_points || below < p_.trunk_below_min * trunk.count() ||
      trunk.value() < p_.trunk_to_head_min * head.value())
    return false;
  seed = {{middle.x, middle.y, highest.z - static_cast<float>(p_.head_middle_m)}, highest.z};
  return true;
}

/// Region growing (Alg. 3.2) from all seeds at once. The queue holds the points of one round after those of the round
/// before, in each by seed: so who is reached by two in the same round belongs to the first.
void Segmentation::grow() {
  std::fill_n(label_.begin(), count_, -1);
  size_t end = 0;
  const auto claim = [&](uint32_t i, int32_t label) {
    if (label_[i] >= 0 || !within_reach(p_, seeds_[static_cast<size_t>(label)].head, reduced_[i])) return;
    label_[i] = label;
    queue_[end++] = i;
  };
  for (size_t seed = 0; seed < seeds_.size(); ++seed)
    for_each_near(seeds_[seed].head, kBeginReach_m, [&](uint32_t i) {
      if (begins_at(seeds_[seed].head, reduced_[i])) claim(i, static_cast<int32_t>(seed));
    });
  const auto near = static_cast<float>(p_.grow_m);
  for (size_t next = 0; next < end; ++next) {
    const uint32_t from = queue_[next];
    for_each_near(reduced_[from], near, [&](uint32_t i) { claim(i, label_[from]); });
  }
}

/// Validation of a cluster before the fit.
bool Segmentation::plausible(size_t label) const {
  int count = 0;
  double x = 0, y = 0, z = 0;
  constexpr float kFar = std::numeric_limits<float>::infinity();
  float low[3] = {kFar, kFar, kFar}, high[3] = {-kFar, -kFar, -kFar};
  for (size_t i = 0; i < count_; ++i) {
    if (label_[i] != static_cast<int32_t>(label)) continue;
    const Point& p = reduced_[i];
    ++count;
    x += p.x, y += p.y, z += p.z;
    const float at[3] = {p.x, p.y, p.z};
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], at[k]), high[k] = std::max(high[k], at[k]);
  }
  if (count < p_.points_min || count > p_.points_max) return false;
  const Seed& seed = seeds_[label];
  const double above = seed.head.z - z / count, beside = std::hypot(seed.head.x - x / count, seed.head.y - y / count);
  const double box = double{high[0] - low[0]} * (high[1] - low[1]) * (high[2] - low[2]);
  return above >= p_.head_above_min_m && above <= p_.head_above_max_m && beside <= p_.head_beside_m &&
         count >= p_.density_min * box;
}

void Segmentation::collect() {
  candidates_.clear();
  clustered_count_ = 0;
  for (size_t label = 0; label < seeds_.size(); ++label) {
    if (!plausible(label)) continue;
    Candidate candidate{clustered_count_, 0, seeds_[label].head, seeds_[label].top_m};
    for (size_t i = 0; i < count_; ++i)
      if (label_[i] == static_cast<int32_t>(label)) clustered_[clustered_count_++] = reduced_[i];
    candidate.count = clustered_count_ - candidate.first;
    candidates_.push_back(candidate);
  }
}

std::vector<int32_t> grow_reference(const SegmentationParameters& p, std::span<const Point> points,
                                    std::span<const Seed> seeds) {
  std::vector<int32_t> label(points.size(), -1);
  for (size_t i = 0; i < points.size(); ++i)
    for (size_t s = seeds.size(); s-- > 0;)
      if (begins_at(seeds[s].head, points[i]) && within_reach(p, seeds[s].head, points[i]))
        label[i] = static_cast<int32_t>(s);
  const auto near = static_cast<float>(p.grow_m);
  for (bool grown = true; grown;) {
    grown = false;
    std::vector<int32_t> next = label;
    for (size_t i = 0; i < points.size(); ++i) {
      if (label[i] >= 0) continue;
      for (size_t j = 0; j < points.size(); ++j) {
        const int32_t by = label[j];
        if (by < 0 || squared_distance(points[j], points[i]) > near * near ||
            !within_reach(p, seeds[static_cast<size_t>(by)].head, points[i]))
          continue;
        if (next[i] < 0 || by < next[i]) next[i] = by;
      }
      grown = grown || next[i] >= 0;
    }
    label = std::move(next);
  }
  return label;
}

}  // namespace takt::body_pose
