// SPDX-License-Identifier: Apache-2.0
// The slow, obvious matcher: the definition that the fast one must reproduce bit for bit. For tests.
#pragma once
#include <algorithm>
#include <cstdlib>
#include <tuple>
#include <vector>

#include "nodes/stereo/matcher.hpp"
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
    } else if (p_.cost == CostKind::census) {
      for (int bit = 0; bit < kCensusBits; ++bit) sum += darker(left_, xl, y, bit) != darker(right_, xr, y, bit);
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
  static bool darker(Bytes image, int x, int y, int bit) {
    const CensusOffset o = census_offset(bit);
    return grey(image, x + o.x, y + o.y) < grey(image, x, y);
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
  std::vector<int> costs(sums.size());
  const auto at = [&](int x, int y, int d) {
    return (static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x)) *
               static_cast<size_t>(p.disparities) +
           static_cast<size_t>(d);
  };
  const auto each = [&](auto body) {
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x)
        for (int d = 0; d < p.disparities; ++d) body(x, y, d);
  };
  each([&](int x, int y, int d) { costs[at(x, y, d)] = right_is_reference ? cost(x + d, x, y) : cost(x, x - d, y); });
  each([&](int x, int y, int d) {
    for (int l = -m; l <= m; ++l)
      for (int k = -m; k <= m; ++k)
        sums[at(x, y, d)] += costs[at(std::clamp(x + k, 0, w - 1), std::clamp(y + l, 0, h - 1), d)];
  });
  return sums;
}

struct Choice {
  int sum = 0, disparity = 0, fraction = kNoFraction;
  bool ambiguous = false;
};

/// Winner of one pixel's sums (smallest disparity on ties), its fraction and its uniqueness; `most` stands for the
/// second best where there is none.
inline Choice winner(const int* sums, const MatcherParameters& p, int most) {
  Choice best{sums[0], 0};
  for (int d = 1; d < p.disparities; ++d)
    if (sums[d] < best.sum) best = {sums[d], d};
  if (p.subpixel && best.disparity > 0 && best.disparity + 1 < p.disparities)
    best.fraction = fraction_of(sums[best.disparity - 1], best.sum, sums[best.disparity + 1]);
  if (p.uniqueness > 0) {
    int second = most;
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
  for (size_t i = 0; i < own.size(); ++i) own[i] = winner(&sums[i * static_cast<size_t>(p.disparities)], p, 65535);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      Choice& c = out[at(x, y)];
      c = {65536, 0};
      for (int d = 0; d < p.disparities; ++d) {
        int smallest = 65536;
        for (int ny = std::max(0, y - r); ny <= std::min(h - 1, y + r); ++ny)
          for (int nx = std::max(0, x - r); nx <= std::min(w - 1, x + r); ++nx)
            smallest =
                std::min(smallest, sums[at(nx, ny) * static_cast<size_t>(p.disparities) + static_cast<size_t>(d)]);
        if (smallest < c.sum) c = {smallest, d};
      }
      // Of the windows that give this winner the smallest fraction counts, and of those an unambiguous one if there is.
      c.fraction = kFractions;
      for (int ny = std::max(0, y - r); ny <= std::min(h - 1, y + r); ++ny)
        for (int nx = std::max(0, x - r); nx <= std::min(w - 1, x + r); ++nx) {
          const Choice& n = own[at(nx, ny)];
          if (n.sum == c.sum && n.disparity == c.disparity &&
              std::tuple(n.fraction, n.ambiguous) < std::tuple(c.fraction, c.ambiguous))
            c = n;
        }
    }
  return out;
}

/// Median of the 3 x 3 choices around each pixel by disparity and fraction, the border replicated.
inline void filter_median(std::vector<Choice>& choices, int w, int h) {
  const std::vector<Choice> in = choices;
  const auto fine = [&](int x, int y) {
    const Choice& c = in[static_cast<size_t>(std::clamp(y, 0, h - 1) * w + std::clamp(x, 0, w - 1))];
    return c.disparity * kFractions + c.fraction;
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      std::vector<int> nine;
      for (int l = -1; l <= 1; ++l)
        for (int k = -1; k <= 1; ++k) nine.push_back(fine(x + k, y + l));
      std::sort(nine.begin(), nine.end());
      choices[static_cast<size_t>(y * w + x)].disparity = nine[4] / kFractions;
      choices[static_cast<size_t>(y * w + x)].fraction = nine[4] % kFractions;
    }
}

/// From the choices of both images to what a matcher writes; `of_right` is looked at for the left-right check only.
inline void write(std::vector<Choice> of_left, const std::vector<Choice>& of_right, int w, int h, int max_sum,
                  const MatcherParameters& p, const DisparityViews& out) {
  if (p.median) filter_median(of_left, w, h);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const Choice& c = of_left[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x)];
      out.confidence.at(x, y) = confidence_of(c.sum, max_sum);
      bool keep = out.confidence.at(x, y) >= p.min_confidence && !c.ambiguous;
      if (keep && p.left_right_check) {
        const int xr = x - c.disparity;
        keep = xr >= 0 &&
               std::abs(of_right[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(xr)].disparity -
                        c.disparity) <= 1;
      }
      out.disparity.at(x, y) = keep ? static_cast<int16_t>(c.disparity) : int16_t{-1};
      out.fraction.at(x, y) = static_cast<uint8_t>(c.fraction);
    }
}

/// Same contract as WindowMatcher::match, with fractions.
inline void match(Bytes left, Bytes right, const MatcherParameters& p, const DisparityViews& out) {
  write(choices(left, right, p, false), p.left_right_check ? choices(left, right, p, true) : std::vector<Choice>{},
        left.width, left.height, p.max_sum(), p, out);
}

/// Winners of the sums of the cheapest paths from one side, from the other and from above, each found on its own
/// (path_kernel.hpp).
inline std::vector<Choice> path_choices(Bytes left, Bytes right, const MatcherParameters& p, bool right_is_reference) {
  const auto costs = window_sums(left, right, p, right_is_reference);  // n_square = 1
  const int w = left.width, h = left.height, n = p.disparities, most = 3 * (p.truncation() + p.step_twice());
  const auto at = [&](int x, int y, int d) { return static_cast<size_t>((y * w + x) * n + d); };
  std::vector<int> sums(costs.size());
  const auto add_path = [&](int dx, int dy) {
    std::vector<int> path(costs.size());
    for (int y = 0; y < h; ++y)
      for (int step = 0; step < w; ++step) {
        const int x = dx < 0 ? w - 1 - step : step, px = x - dx, py = y - dy;
        const bool first = px < 0 || px >= w || py < 0;
        int least = first ? 0 : path[at(px, py, 0)];
        for (int d = 1; !first && d < n; ++d) least = std::min(least, path[at(px, py, d)]);
        for (int d = 0; d < n; ++d) {
          int way = 0;
          if (!first) {
            way = std::min(path[at(px, py, d)], least + p.step_twice());
            if (d > 0) way = std::min(way, path[at(px, py, d - 1)] + p.step_once());
            if (d + 1 < n) way = std::min(way, path[at(px, py, d + 1)] + p.step_once());
          }
          path[at(x, y, d)] = costs[at(x, y, d)] + way - least;
        }
      }
    for (size_t i = 0; i < sums.size(); ++i) sums[i] += path[i];
  };
  add_path(1, 0);
  add_path(-1, 0);
  add_path(0, 1);
  std::vector<Choice> out(static_cast<size_t>(w) * static_cast<size_t>(h));
  for (size_t i = 0; i < out.size(); ++i) out[i] = winner(&sums[i * static_cast<size_t>(n)], p, most);
  return out;
}

/// Same contract as SemiGlobalMatcher::match, with fractions.
inline void semi_global(Bytes left, Bytes right, const MatcherParameters& p, const DisparityViews& out) {
  write(path_choices(left, right, p, false),
        p.left_right_check ? path_choices(left, right, p, true) : std::vector<Choice>{}, left.width, left.height,
        3 * (p.truncation() + p.step_twice()), p, out);
}

}  // namespace takt::stereo::reference
