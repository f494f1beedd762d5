// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/flow_filter.hpp"

#include <algorithm>
#include <cmath>

namespace takt::ego_motion {
namespace {

bool neighbours(const Flow& a, const Flow& b, double radius) {
  const double dx = static_cast<double>(a.x) - b.x, dy = static_cast<double>(a.y) - b.y;
  return dx * dx + dy * dy <= radius * radius;
}

float lower_median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

constexpr int kSmallestCell_px = 8;

bool agrees(const Flow& flow, std::vector<float>& dx, std::vector<float>& dy, const FlowFilterParameters& p) {
  if (dx.size() < static_cast<size_t>(std::max(1, p.n_flow))) return false;
  const double ex = static_cast<double>(flow.dx) - lower_median(dx),
               ey = static_cast<double>(flow.dy) - lower_median(dy);
  return ex * ex + ey * ey <= p.t_flow_px * p.t_flow_px;
}

}  // namespace

FlowFilter::FlowFilter(int width, int height, size_t capacity, const FlowFilterParameters& parameters)
    : width_(width), height_(height) {
  start_.reserve(
      static_cast<size_t>(width / kSmallestCell_px + 1) * static_cast<size_t>(height / kSmallestCell_px + 1) + 1);
  tune(parameters);
  order_.resize(capacity);
  dx_.reserve(capacity);
  dy_.reserve(capacity);
}

void FlowFilter::tune(const FlowFilterParameters& parameters) {
  p_ = parameters;
  edge_ = std::max(kSmallestCell_px, static_cast<int>(std::ceil(p_.r_min_px)));
  columns_ = width_ / edge_ + 1;
  rows_ = height_ / edge_ + 1;
  start_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows_) + 1);
}

int FlowFilter::cell_of(const Flow& flow) const {
  const auto edge = static_cast<float>(edge_);
  const int cx = std::clamp(static_cast<int>(flow.x / edge), 0, columns_ - 1);
  const int cy = std::clamp(static_cast<int>(flow.y / edge), 0, rows_ - 1);
  return cy * columns_ + cx;
}

void FlowFilter::apply(std::span<const Flow> flows, std::span<uint8_t> keep) {
  std::fill(start_.begin(), start_.end(), 0u);
  for (const Flow& f : flows) ++start_[static_cast<size_t>(cell_of(f)) + 1];
  for (size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
  for (size_t i = flows.size(); i-- > 0;) {  // counts down each cell's end; afterwards start_[c + 1] is the start of c
    const auto cell = static_cast<size_t>(cell_of(flows[i]));
    order_[--start_[cell + 1]] = static_cast<uint32_t>(i);
  }
  const auto first = [&](int cell) { return start_[static_cast<size_t>(cell) + 1]; };
  const auto last = [&](int cell) {
    return static_cast<size_t>(cell) + 2 < start_.size() ? start_[static_cast<size_t>(cell) + 2]
                                                         : static_cast<uint32_t>(flows.size());
  };
  for (size_t i = 0; i < flows.size(); ++i) {
    dx_.clear();
    dy_.clear();
    const int cell = cell_of(flows[i]), cx = cell % columns_, cy = cell / columns_;
    for (int v = std::max(0, cy - 1); v <= std::min(rows_ - 1, cy + 1); ++v)
      for (int u = std::max(0, cx - 1); u <= std::min(columns_ - 1, cx + 1); ++u)
        for (uint32_t k = first(v * columns_ + u); k < last(v * columns_ + u); ++k) {
          const Flow& other = flows[order_[k]];
          if (!neighbours(flows[i], other, p_.r_min_px)) continue;
          dx_.push_back(other.dx);
          dy_.push_back(other.dy);
        }
    keep[i] = agrees(flows[i], dx_, dy_, p_);
  }
}

void FlowFilter::apply_reference(std::span<const Flow> flows, const FlowFilterParameters& parameters,
                                 std::span<uint8_t> keep) {
  std::vector<float> dx, dy;
  for (size_t i = 0; i < flows.size(); ++i) {
    dx.clear();
    dy.clear();
    for (const Flow& other : flows)
      if (neighbours(flows[i], other, parameters.r_min_px)) dx.push_back(other.dx), dy.push_back(other.dy);
    keep[i] = agrees(flows[i], dx, dy, parameters);
  }
}

}  // namespace takt::ego_motion
