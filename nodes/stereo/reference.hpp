// SPDX-License-Identifier: Apache-2.0
// The slow, obvious matcher: the definition that the fast one must reproduce bit for bit. For tests.
#pragma once
#include <algorithm>
#include <cmath>
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

  double operator()(int xl, int xr, int y) const {
    if (xl < 0 || xr < 0 || xl >= left_.width || xr >= left_.width) return p_.truncation();
    return std::min<double>(untruncated(xl, xr, y), p_.truncation());
  }

 private:
  double untruncated(int xl, int xr, int y) const {
    const auto over_channels = [&](auto term) {
      double sum = 0;
      for (int c = 0; c < left_.channels; ++c) sum += term(c);
      return sum;
    };
    const auto squares = [&] {
      return over_channels([&](int c) { return std::pow(left_.at(xl, y, c) - right_.at(xr, y, c), 2); });
    };
    switch (p_.cost) {
      case CostKind::gradient:
        return (std::abs(dx(left_, xl, y) - dx(right_, xr, y)) + std::abs(dy(left_, xl, y) - dy(right_, xr, y)) + 1) /
               2;
      case CostKind::ssd: return squares();
      case CostKind::sad:
        return over_channels([&](int c) { return std::abs(left_.at(xl, y, c) - right_.at(xr, y, c)); });
      case CostKind::rss: return std::sqrt(squares());
      case CostKind::census: {
        int differ = 0;
        for (int bit = 0; bit < kCensusBits; ++bit) differ += darker(left_, xl, y, bit) != darker(right_, xr, y, bit);
        return differ;
      }
      case CostKind::mixed: break;
    }
    const auto slopes = over_channels([&](int c) {
      return std::pow(slope(left_, xl, y, c, 1, 0) - slope(right_, xr, y, c, 1, 0), 2) +
             std::pow(slope(left_, xl, y, c, 0, 1) - slope(right_, xr, y, c, 0, 1), 2);
    });
    return p_.intensity_weight * squares() + (1 - p_.intensity_weight) / 2 * slopes;
  }
  static int level(Bytes image, int x, int y, int c) {
    return image.at(std::clamp(x, 0, image.width - 1), std::clamp(y, 0, image.height - 1), c);
  }
  /// Derivative of one channel along (x, y).
  static double slope(Bytes image, int x, int y, int c, int along_x, int along_y) {
    return (level(image, x + along_x, y + along_y, c) - level(image, x - along_x, y - along_y, c)) / 2.0;
  }
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
inline std::vector<double> window_sums(Bytes left, Bytes right, const MatcherParameters& p, bool right_is_reference) {
  const PixelCost cost(left, right, p);
  const int w = left.width, h = left.height, m = p.n_square / 2;
  std::vector<double> sums(static_cast<size_t>(w) * static_cast<size_t>(h) * static_cast<size_t>(p.disparities));
  std::vector<double> costs(sums.size());
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

/// The smallest sum of each disparity in the neighbourhood of n_min: the volume filtered literally (thesis Sec. 3.2.2
/// b).
inline std::vector<double> filtered(const std::vector<double>& sums, int w, int h, const MatcherParameters& p) {
  const int r = p.n_min / 2;
  std::vector<double> out(sums.size());
  const auto at = [&](int x, int y) { return static_cast<size_t>(y * w + x) * static_cast<size_t>(p.disparities); };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (size_t d = 0; d < static_cast<size_t>(p.disparities); ++d) {
        double smallest = sums[at(x, y) + d];
        for (int ny = std::max(0, y - r); ny <= std::min(h - 1, y + r); ++ny)
          for (int nx = std::max(0, x - r); nx <= std::min(w - 1, x + r); ++nx)
            smallest = std::min(smallest, sums[at(nx, ny) + d]);
        out[at(x, y) + d] = smallest;
      }
  return out;
}

struct Choice {
  double sum = 0;
  int disparity = 0, fraction = kNoFraction;
  bool ambiguous = false;
};

/// Costs of rss and mixed are no whole numbers.
inline bool is_whole(const MatcherParameters& p) { return p.cost != CostKind::rss && p.cost != CostKind::mixed; }

inline int fraction(const double* middle, const MatcherParameters& p) {
  if (is_whole(p))
    return fraction_of(static_cast<int>(middle[-1]), static_cast<int>(middle[0]), static_cast<int>(middle[1]));
  const double bend = middle[-1] - 2 * middle[0] + middle[1];
  if (bend <= 0) return kNoFraction;
  const auto rounded = static_cast<int>(std::lround(kFractions * (middle[-1] - middle[1]) / (2 * bend)));
  return std::clamp(kNoFraction + rounded, 0, kFractions - 1);
}

inline uint8_t confidence(double sum, int most, const MatcherParameters& p) {
  return is_whole(p) ? confidence_of(static_cast<int>(sum), most)
                     : static_cast<uint8_t>(255 * (most - sum) / most + 0.5);
}

/// Winner of one pixel's sums (smallest disparity on ties), its fraction and its uniqueness; `most` stands for the
/// second best where there is none.
inline Choice winner(const double* sums, const MatcherParameters& p, int most) {
  Choice best{sums[0], 0};
  for (int d = 1; d < p.disparities; ++d)
    if (sums[d] < best.sum) best = {sums[d], d};
  if (p.subpixel && best.disparity > 0 && best.disparity + 1 < p.disparities)
    best.fraction = fraction(sums + best.disparity, p);
  if (p.uniqueness > 0) {
    double second = most;
    for (int d = 0; d < p.disparities; ++d)
      if (std::abs(d - best.disparity) > 1) second = std::min(second, sums[d]);
    best.ambiguous = (second - best.sum) * 256 <= p.uniqueness * second;
  }
  return best;
}

/// Where fraction and uniqueness of a filtered winner come from: the window that won, or the filtered sums.
enum class Beside : uint8_t { window, filtered };

/// Winner per pixel over all disparities of the filtered volume (thesis Sec. 3.2.3).
inline std::vector<Choice> choices(Bytes left, Bytes right, const MatcherParameters& p, bool right_is_reference,
                                   Beside beside) {
  const auto sums = window_sums(left, right, p, right_is_reference);
  const int w = left.width, h = left.height, r = p.n_min / 2;
  const auto at = [&](int x, int y) { return static_cast<size_t>(y * w + x); };
  const auto winners = [&](const std::vector<double>& volume) {
    std::vector<Choice> all(at(0, h));
    for (size_t i = 0; i < all.size(); ++i) all[i] = winner(&volume[i * static_cast<size_t>(p.disparities)], p, 65535);
    return all;
  };
  std::vector<Choice> out = winners(filtered(sums, w, h, p));
  if (beside == Beside::filtered) return out;
  const std::vector<Choice> own = winners(sums);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      // Of the windows that give this winner the smallest fraction counts, and of those an unambiguous one if there is.
      Choice& c = out[at(x, y)];
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
      out.confidence.at(x, y) = confidence(c.sum, max_sum, p);
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

/// Same contract as WindowMatcher::match, with fractions; with Beside::filtered as GeneralMatcher::match for square
/// windows and winner takes all.
inline void match(Bytes left, Bytes right, const MatcherParameters& p, const DisparityViews& out,
                  Beside beside = Beside::window) {
  const auto of = [&](bool right_is_reference) { return choices(left, right, p, right_is_reference, beside); };
  write(of(false), p.left_right_check ? of(true) : std::vector<Choice>{}, left.width, left.height, p.max_sum(), p, out);
}

/// Winners of the sums of the cheapest paths from one side, from the other and from above, each found on its own
/// (path_kernel.hpp).
inline std::vector<Choice> path_choices(Bytes left, Bytes right, const MatcherParameters& p, bool right_is_reference) {
  const auto costs = window_sums(left, right, p, right_is_reference);  // n_square = 1
  const int w = left.width, h = left.height, n = p.disparities, most = 3 * (p.truncation() + p.step_twice());
  const auto at = [&](int x, int y, int d) { return static_cast<size_t>((y * w + x) * n + d); };
  std::vector<double> sums(costs.size());
  const auto add_path = [&](int dx, int dy) {
    std::vector<double> path(costs.size());
    for (int y = 0; y < h; ++y)
      for (int step = 0; step < w; ++step) {
        const int x = dx < 0 ? w - 1 - step : step, px = x - dx, py = y - dy;
        const bool first = px < 0 || px >= w || py < 0;
        double least = first ? 0 : path[at(px, py, 0)];
        for (int d = 1; !first && d < n; ++d) least = std::min(least, path[at(px, py, d)]);
        for (int d = 0; d < n; ++d) {
          double way = 0;
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
