// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/segmenter.hpp"

#include <algorithm>
#include <optional>

namespace takt::object_3d {
namespace {

void put_in_order(std::span<const Point> points, std::span<uint32_t> seeds) {
  std::sort(seeds.begin(), seeds.end(),
            [&](uint32_t a, uint32_t b) { return points[a].z > points[b].z || (points[a].z == points[b].z && a < b); });
}

}  // namespace

Segmenter::Segmenter(size_t capacity, size_t most_segments)
    : grower_(capacity), owner_(capacity), segments_(most_segments), shared_(most_segments), members_(capacity) {}

void Segmenter::begin(std::span<const Point> points, std::span<const Colour> colours, std::span<uint32_t> seeds,
                      const SegmentParameters& parameters) {
  parameters_ = parameters;
  grower_.fill(points, colours, parameters.grow);
  put_in_order(points, seeds);
  seeds_ = seeds;
  std::fill_n(owner_.begin(), points.size(), kFree);
  next_seed_ = count_ = member_count_ = 0;
  growing_ = false;
}

bool Segmenter::advance() {
  for (size_t passed = 0; passed < kPortion && !growing_; ++passed) {
    if (next_seed_ == seeds_.size() || count_ == segments_.size()) return false;
    if (owner_[seeds_[next_seed_]] != kFree) {
      ++next_seed_;
      continue;
    }
    grower_.begin(seeds_[next_seed_], parameters_.reach);
    growing_ = true;
  }
  if (growing_ && !grower_.advance(kPortion)) finish_region();
  return true;
}

void Segmenter::finish_region() {
  growing_ = false;
  const uint32_t seed = seeds_[next_seed_++];
  const std::span<const uint32_t> region = grower_.region();
  std::fill_n(shared_.begin(), count_, size_t{0});
  size_t taken = 0;
  for (const uint32_t i : region) {
    if (owner_[i] >= count_) continue;
    ++shared_[owner_[i]];
    ++taken;
  }
  bool merged = false;
  for (size_t s = 0; s < count_; ++s) {
    const size_t smaller = std::min(region.size(), segments_[s].last - segments_[s].first);
    merged |= static_cast<double>(shared_[s]) > parameters_.overlap * static_cast<double>(smaller);
  }
  const bool object = !grower_.cut() && !merged && region.size() - taken >= parameters_.points_min;
  const uint32_t owner = object ? static_cast<uint32_t>(count_) : kNoObject;
  const size_t first = member_count_;
  for (const uint32_t i : region) {
    if (owner_[i] < count_) continue;
    owner_[i] = owner;
    if (object) members_[member_count_++] = i;
  }
  if (object) segments_[count_++] = {seed, first, member_count_};
}

double Segmenter::done() const {
  return seeds_.empty() ? 1 : static_cast<double>(next_seed_) / static_cast<double>(seeds_.size());
}

std::vector<std::vector<uint32_t>> segment_reference(std::span<const Point> points, std::span<const Colour> colours,
                                                     std::vector<uint32_t> seeds, const SegmentParameters& p) {
  put_in_order(points, seeds);
  std::vector<std::vector<uint32_t>> objects;
  std::vector<bool> refused(points.size());
  const auto has = [](const std::vector<uint32_t>& object, uint32_t i) {
    return std::find(object.begin(), object.end(), i) != object.end();
  };
  const auto taken = [&](uint32_t i) {
    return std::any_of(objects.begin(), objects.end(), [&](const auto& object) { return has(object, i); });
  };
  for (const uint32_t seed : seeds) {
    if (refused[seed] || taken(seed)) continue;
    const Region region = grow_reference(points, colours, p.grow, seed, p.reach);
    const bool merged = std::any_of(objects.begin(), objects.end(), [&](const auto& object) {
      const auto shared =
          std::count_if(region.points.begin(), region.points.end(), [&](uint32_t i) { return has(object, i); });
      return static_cast<double>(shared) >
             p.overlap * static_cast<double>(std::min(region.points.size(), object.size()));
    });
    std::vector<uint32_t> own;
    std::copy_if(region.points.begin(), region.points.end(), std::back_inserter(own),
                 [&](uint32_t i) { return !taken(i); });
    if (!region.cut && !merged && own.size() >= p.points_min) objects.push_back(own);
    else
      for (const uint32_t i : own) refused[i] = true;
  }
  return objects;
}

}  // namespace takt::object_3d
