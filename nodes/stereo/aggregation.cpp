// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/aggregation.hpp"

#include <algorithm>
#include <cmath>

namespace takt::stereo {
namespace {

void add_to(float* out, const float* in, size_t count, float weight = 1) {
  for (size_t i = 0; i < count; ++i) out[i] += weight * in[i];
}

void lower_to(float* out, const float* in, size_t count) {
  for (size_t i = 0; i < count; ++i) out[i] = std::min(out[i], in[i]);
}

/// Edges of the windows that are summed; those of an adaptive window are a third, three fifths and all of n_square.
std::vector<int> window_edges(const MatcherParameters& p) {
  if (p.aggregation != Aggregation::adaptive_window) return {p.n_square};
  const auto odd = [](int edge) { return edge / 2 * 2 + 1; };
  return {odd(p.n_square / 3 - 1), odd(p.n_square * 3 / 5 - 1), p.n_square};
}

}  // namespace

Aggregator::Aggregator(int width, int height, const MatcherParameters& p)
    : p_(p), width_(width), height_(height), edges_(window_edges(p)) {
  const CostRow row(static_cast<size_t>(width) * static_cast<size_t>(p.disparities));
  costs_.assign(static_cast<size_t>(p.n_square), row);
  aggregated_.assign(edges_.size(), std::vector<CostRow>(static_cast<size_t>(p.n_min), row));
  columns_ = smallest_ = row;
  if (p.aggregation == Aggregation::boundary) arms_.resize(static_cast<size_t>(width) * static_cast<size_t>(height));
  distance_weight_.reserve(static_cast<size_t>(p.n_square) * static_cast<size_t>(p.n_square));
  tune(p);
}

void Aggregator::tune(const MatcherParameters& p) {
  p_ = p;
  const int m = p.n_square / 2;
  distance_weight_.clear();
  for (int l = -m; l <= m; ++l)
    for (int k = -m; k <= m; ++k)
      distance_weight_.push_back(static_cast<float>(std::exp(-std::hypot(k, l) / p.gamma_distance)));
}

void Aggregator::start(const Features& image, int disparities) {
  image_ = &image;
  disparities_ = disparities;
  added_ = next_ = 0;
  if (p_.aggregation == Aggregation::boundary) find_arms();
}

const CostRow& Aggregator::row(int y) const {
  return costs_[static_cast<size_t>(std::clamp(y, 0, height_ - 1)) % costs_.size()];
}

int Aggregator::rows_needed(int y) const { return std::min(height_, y + p_.n_min / 2 + p_.n_square / 2 + 1); }

void Aggregator::add(const CostRow& costs) {
  CostRow& place = costs_[static_cast<size_t>(added_) % costs_.size()];
  if (p_.aggregation == Aggregation::boundary) along_arms(costs, added_, place);
  else std::copy_n(costs.begin(), pixel(width_), place.begin());
  ++added_;
}

void Aggregator::aggregate(int y) {
  for (size_t i = 0; i < edges_.size(); ++i) {
    CostRow& out = aggregated_[i][static_cast<size_t>(y) % aggregated_[i].size()];
    switch (p_.aggregation) {
      case Aggregation::boundary: within_arms(y, out); break;
      case Aggregation::adaptive_weight: weighted(y, out); break;
      default: sum(y, edges_[i], out);
    }
  }
}

// Separable: sums of columns, then of these along the row.
void Aggregator::sum(int y, int edge, CostRow& out) {
  const int m = edge / 2;
  const auto d = static_cast<size_t>(disparities_);
  std::fill_n(columns_.begin(), pixel(width_), 0.0f);
  for (int l = -m; l <= m; ++l) add_to(columns_.data(), row(y + l).data(), pixel(width_));
  const float mean = p_.aggregation == Aggregation::square ? 1.0f : 1.0f / static_cast<float>(edge * edge);
  for (int x = 0; x < width_; ++x) {
    float* to = out.data() + pixel(x);
    std::fill_n(to, d, 0.0f);
    for (int k = -m; k <= m; ++k) add_to(to, columns_.data() + pixel(std::clamp(x + k, 0, width_ - 1)), d);
    if (mean < 1)
      for (size_t i = 0; i < d; ++i) to[i] *= mean;
  }
}

/// Arms reach to the first edge pixel of the image, at most half a window.
void Aggregator::find_arms() {
  const auto is_edge = [&](int x, int y) {
    int gx = 0, gy = 0;
    for (int c = 0; c < image_->channels(); ++c) {
      gx = std::max(gx, std::abs(image_->level(x + 1, y, c) - image_->level(x - 1, y, c)));
      gy = std::max(gy, std::abs(image_->level(x, y + 1, c) - image_->level(x, y - 1, c)));
    }
    return std::hypot(gx, gy) / 2 > p_.edge_threshold;
  };
  const auto arm = [&](int x, int y, int dx, int dy) {
    int length = 0;
    while (length < p_.n_square / 2) {
      const int nx = x + (length + 1) * dx, ny = y + (length + 1) * dy;
      if (nx < 0 || ny < 0 || nx >= width_ || ny >= height_) break;
      ++length;
      if (is_edge(nx, ny)) break;
    }
    return length;
  };
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      arms_[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)] = {
          arm(x, y, -1, 0), arm(x, y, 1, 0), arm(x, y, 0, -1), arm(x, y, 0, 1)};
}

void Aggregator::along_arms(const CostRow& costs, int y, CostRow& out) const {
  for (int x = 0; x < width_; ++x) {
    const Arms& a = arms_of(x, y);
    mean_of_arms(
        a.left, a.right, [&](int k) { return costs.data() + pixel(x + k); }, out.data() + pixel(x));
  }
}

void Aggregator::within_arms(int y, CostRow& out) const {
  for (int x = 0; x < width_; ++x) {
    const Arms& a = arms_of(x, y);
    mean_of_arms(
        a.up, a.down, [&](int l) { return row(y + l).data() + pixel(x); }, out.data() + pixel(x));
  }
}

template <class CostsAt>
void Aggregator::mean_of_arms(int before, int after, const CostsAt& costs_at, float* out) const {
  const auto d = static_cast<size_t>(disparities_);
  const auto weight = [reach = static_cast<float>(p_.n_square / 2 + 1)](int k) {
    return 1 - static_cast<float>(std::abs(k)) / reach;
  };
  float weights = 0;
  for (int k = -before; k <= after; ++k) weights += weight(k);
  std::fill_n(out, d, 0.0f);
  for (int k = -before; k <= after; ++k) add_to(out, costs_at(k), d, weight(k) / weights);
}

// The weights of a pixel serve all its disparities.
void Aggregator::weighted(int y, CostRow& out) {
  const int m = p_.n_square / 2;
  const auto d = static_cast<size_t>(disparities_);
  for (int x = 0; x < width_; ++x) {
    float* to = out.data() + pixel(x);
    std::fill_n(to, d, 0.0f);
    float weights = 0;
    const float* near = distance_weight_.data();
    for (int l = -m; l <= m; ++l)
      for (int k = -m; k <= m; ++k, ++near) {
        double squared = 0;
        for (int c = 0; c < image_->channels(); ++c) {
          const double difference = image_->level(x + k, y + l, c) - image_->level(x, y, c);
          squared += difference * difference;
        }
        const float w = *near * static_cast<float>(std::exp(-std::sqrt(squared) / p_.gamma_colour));
        weights += w;
        add_to(to, row(y + l).data() + pixel(std::clamp(x + k, 0, width_ - 1)), d, w);
      }
    for (size_t i = 0; i < d; ++i) to[i] /= weights;
  }
}

/// Minimum filter over the aggregated rows of one window edge, which may not be wider than the window.
void Aggregator::minimum(size_t size, int y, CostRow& out) {
  const int r = std::min(p_.n_min, edges_[size]) / 2;
  const auto d = static_cast<size_t>(disparities_);
  const std::vector<CostRow>& rows = aggregated_[size];
  const auto at = [&](int n) -> const CostRow& { return rows[static_cast<size_t>(n) % rows.size()]; };
  std::copy_n(at(y).begin(), pixel(width_), columns_.begin());
  for (int n = std::max(0, y - r); n <= std::min(height_ - 1, y + r); ++n)
    if (n != y) lower_to(columns_.data(), at(n).data(), pixel(width_));
  for (int x = 0; x < width_; ++x) {
    float* to = out.data() + pixel(x);
    std::copy_n(columns_.data() + pixel(x), d, to);
    for (int n = std::max(0, x - r); n <= std::min(width_ - 1, x + r); ++n)
      if (n != x) lower_to(to, columns_.data() + pixel(n), d);
  }
}

void Aggregator::take(int y, CostRow& out) {
  for (; next_ <= std::min(height_ - 1, y + p_.n_min / 2); ++next_) aggregate(next_);
  minimum(0, y, out);
  for (size_t i = 1; i < edges_.size(); ++i) {
    minimum(i, y, smallest_);
    for (size_t k = 0; k < pixel(width_); ++k) {
      if (p_.combination == Combination::min) out[k] = std::min(out[k], smallest_[k]);
      else if (p_.combination == Combination::max) out[k] = std::max(out[k], smallest_[k]);
      else out[k] += (smallest_[k] - out[k]) / static_cast<float>(i + 1);  // running mean
    }
  }
}

}  // namespace takt::stereo
