// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/grouping.hpp"

#include <algorithm>
#include <cmath>

namespace takt::traffic_signs {
namespace {

constexpr double kTolerance = 0.2;

bool similar(const Box& a, const Box& b) {
  const double delta = kTolerance * (std::min(a.width, b.width) + std::min(a.height, b.height)) * 0.5;
  return std::abs(a.x - b.x) <= delta && std::abs(a.y - b.y) <= delta &&
         std::abs(a.x + a.width - b.x - b.width) <= delta && std::abs(a.y + a.height - b.y - b.height) <= delta;
}

int rounded(double value) { return static_cast<int>(std::nearbyint(value)); }

/// Hardly larger than the other and much weaker.
bool overruled(const Group& group, const Group& by) {
  const int dx = rounded(by.box.width * kTolerance), dy = rounded(by.box.height * kTolerance);
  const Box &a = group.box, &b = by.box;
  return a.x >= b.x - dx && a.y >= b.y - dy && a.x + a.width <= b.x + b.width + dx &&
         a.y + a.height <= b.y + b.height + dy && (by.hits > std::max(3, group.hits) || group.hits < 3);
}

}  // namespace

double intersection_over_union(const Box& a, const Box& b) {
  const int width = std::min(a.x + a.width, b.x + b.width) - std::max(a.x, b.x);
  const int height = std::min(a.y + a.height, b.y + b.height) - std::max(a.y, b.y);
  if (width <= 0 || height <= 0) return 0;
  const double common = static_cast<double>(width) * height;
  return common / (static_cast<double>(a.width) * a.height + static_cast<double>(b.width) * b.height - common);
}

Grouping::Grouping(size_t most) : parents_(most), index_(most) {
  groups_.reserve(most);
  kept_.reserve(most);
}

size_t Grouping::root(size_t i) {
  while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
  return i;
}

std::span<const Group> Grouping::group(std::span<const Box> all, int least) {
  const auto boxes = all.first(std::min(all.size(), most()));
  groups_.clear();
  kept_.clear();
  for (size_t i = 0; i < boxes.size(); ++i) {
    parents_[i] = static_cast<uint32_t>(i);
    for (size_t j = 0; j < i; ++j) {
      if (!similar(boxes[i], boxes[j])) continue;
      const size_t a = root(i), b = root(j);
      parents_[std::max(a, b)] =
          static_cast<uint32_t>(std::min(a, b));  // the root is the first box: groups keep its order
    }
  }
  for (size_t i = 0; i < boxes.size(); ++i) {
    const size_t first = root(i);
    if (first == i) {
      index_[i] = static_cast<uint32_t>(groups_.size());
      groups_.push_back({});
    }
    Group& group = groups_[index_[first]];
    group.box.x += boxes[i].x;
    group.box.y += boxes[i].y;
    group.box.width += boxes[i].width;
    group.box.height += boxes[i].height;
    ++group.hits;
  }
  std::erase_if(groups_, [&](const Group& group) { return group.hits < least; });
  for (Group& group : groups_) {
    const float share = 1.0f / static_cast<float>(group.hits);
    for (int* value : {&group.box.x, &group.box.y, &group.box.width, &group.box.height})
      *value = rounded(static_cast<double>(static_cast<float>(*value) * share));
  }
  for (size_t i = 0; i < groups_.size(); ++i)
    if (std::none_of(groups_.begin(), groups_.end(),
                     [&](const Group& other) { return &other != &groups_[i] && overruled(groups_[i], other); }))
      kept_.push_back(groups_[i]);
  return kept_;
}

}  // namespace takt::traffic_signs
