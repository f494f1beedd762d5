// SPDX-License-Identifier: Apache-2.0
// The slow, obvious matcher: the definition that the fast one must reproduce bit for bit. For tests.
#pragma once
#include <algorithm>
#include <cstdlib>
#include <tuple>
#include <vector>

#include "nodes/stereo/parameters.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo::reference {

using Bytes = ImageView<const uint8_t>;

/// Truncated cost of left pixel (xl, y) against right pixel (xr, y); c_max where one lies outside the image.
class PixelCost {
 public:
  PixelCost(Bytes left, Bytes right, const MatcherParameters& p) : left_(left), right_(right), p_(p) {}

  int operator()(int xl, int xr, int y) const {
    if (xl < 0 || xr < 0 || xl >= left_.width || xr >= left_.width) return p_.truncation();
    int sum = 0;
    if (p_.cost == CostKind::gradient) {
      sum = (std::abs(dx(left_, xl, y) - dx(right_, xr, y)) + std::abs(dy(left_, xl, y) - dy(right_, xr, y)) + 1) / 2;
    } else {
      for (int c = 0; c < left_.channels; ++c) {
        const int difference = left_.at(xl, y, c) - right_.at(xr, y, c);
        sum += p_.cost == CostKind::ssd ? difference * difference : std::abs(difference);
      }
    }
    return std::min(sum, p_.truncation());
  }

 private:
  static int grey(Bytes image, int x, int y) {
    x = std::clamp(x, 0, image.width - 1);
    y = std::clamp(y, 0, image.height - 1);
    return image.channels == 1 ? image.at(x, y) : grey_of(image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2));
  }
  static int dx(Bytes image, int x, int y) { return twice_derivative(grey(image, x - 1, y), grey(image, x + 1, y)); }
  static int dy(Bytes image, int x, int y) { return twice_derivative(grey(image, x, y - 1), grey(image, x, y + 1)); }

  Bytes left_, right_;
  MatcherParameters p_;
};

/// Window sums S(x, y, d) of all disparities, before the minimum filter; index (y * width + x) * disparities + d.
/// `right_is_reference` gives those of the right image, whose pixel x meets left pixel x + d.
inline std::vector<int> window_sums(Bytes left, Bytes right, const MatcherParameters& p, bool right_is_reference) {
  const PixelCost cost(left, right, p);
  const int w = left.width, h = left.height, m = p.n_square / 2;
  std::vector<int> sums(static_cast<size_t>(w) * static_cast<size_t>(h) * static_cast<size_t>(p.disparities));
  size_t i = 0;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int d = 0; d < p.disparities; ++d, ++i)
        for (int l = -m; l <= m; ++l)
          for (int k = -m; k <= m; ++k) {
            const int cx = std::clamp(x + k, 0, w - 1), cy = std::clamp(y + l, 0, h - 1);
            sums[i] += right_is_reference ? cost(cx + d, cx, cy) : cost(cx, cx - d, cy);
          }
  return sums;
}

struct Choice {
  int sum = 0, disparity = 0;
  bool ambiguous = false;
  bool operator<(const Choice& o) const {
    return std::tuple(sum, disparity, ambiguous) < std::tuple(o.sum, o.disparity, o.ambiguous);
  }
};

/// Winner of one pixel's own window (smallest disparity on ties) and its uniqueness.
inline Choice winner(const int* sums, const MatcherParameters& p) {
  Choice best{sums[0], 0, false};
  for (int d = 1; d < p.disparities; ++d)
    if (sums[d] < best.sum) best = {sums[d], d, false};
  if (p.uniqueness > 0) {
    int second = 65535;
    for (int d = 0; d < p.disparities; ++d)
      if (std::abs(d - best.disparity) > 1) second = std::min(second, sums[d]);
    best.ambiguous = int64_t{second - best.sum} * 256 <= int64_t{p.uniqueness} * second;
  }
  return best;
}

/// Winner per pixel after the minimum filter. The volume is filtered literally: for each disparity the smallest sum of
/// the neighbourhood, then the winner over all disparities (thesis Sec. 3.2.2 b, 3.2.3).
inline std::vector<Choice> choices(Bytes left, Bytes right, const MatcherParameters& p, bool right_is_reference) {
  const auto sums = window_sums(left, right, p, right_is_reference);
  const int w = left.width, h = left.height, r = p.n_min / 2;
  const auto at = [&](int x, int y) {
    return (static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x));
  };
  std::vector<Choice> own(at(0, h)), out(at(0, h));
  for (size_t i = 0; i < own.size(); ++i) own[i] = winner(&sums[i * static_cast<size_t>(p.disparities)], p);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      Choice& c = out[at(x, y)];
      c = {65536, 0, false};
      for (int d = 0; d < p.disparities; ++d) {
        int smallest = 65536;
        for (int ny = std::max(0, y - r); ny <= std::min(h - 1, y + r); ++ny)
          for (int nx = std::max(0, x - r); nx <= std::min(w - 1, x + r); ++nx)
            smallest =
                std::min(smallest, sums[at(nx, ny) * static_cast<size_t>(p.disparities) + static_cast<size_t>(d)]);
        if (smallest < c.sum) c = {smallest, d, false};
      }
      // A winning window is ambiguous if every window that gives this winner is.
      c.ambiguous = p.uniqueness > 0;
      for (int ny = std::max(0, y - r); ny <= std::min(h - 1, y + r); ++ny)
        for (int nx = std::max(0, x - r); nx <= std::min(w - 1, x + r); ++nx) {
          const Choice& n = own[at(nx, ny)];
          if (n.sum == c.sum && n.disparity == c.disparity && !n.ambiguous) c.ambiguous = false;
        }
    }
  return out;
}

/// Same contract as Matcher::match.
inline void match(Bytes left, Bytes right, const MatcherParameters& p, ImageView<int16_t> disparity,
                  ImageView<uint8_t> confidence) {
  const int w = left.width;
  const auto of_left = choices(left, right, p, false);
  const auto of_right = p.left_right_check ? choices(left, right, p, true) : std::vector<Choice>{};
  for (int y = 0; y < left.height; ++y)
    for (int x = 0; x < w; ++x) {
      const Choice& c = of_left[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x)];
      confidence.at(x, y) = confidence_of(c.sum, p.max_sum());
      bool keep = confidence.at(x, y) >= p.min_confidence && !c.ambiguous;
      if (keep && p.left_right_check) {
        const int xr = x - c.disparity;
        keep = xr >= 0 &&
               std::abs(of_right[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(xr)].disparity -
                        c.disparity) <= 1;
      }
      disparity.at(x, y) = keep ? static_cast<int16_t>(c.disparity) : int16_t{-1};
    }
}

}  // namespace takt::stereo::reference
