// SPDX-License-Identifier: Apache-2.0
// The thesis's other windows and its path through a row, against their formulas written out for one pixel at a time.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "nodes/stereo/aggregation.hpp"
#include "nodes/stereo/general_matcher.hpp"
#include "nodes/stereo/generated_pair.hpp"
#include "nodes/stereo/reference.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::stereo;

namespace {

struct Made {
  GeneratedPair pair;
  Features left, right;
  std::vector<CostRow> costs;  ///< of every row
  Made(int width, int height, const MatcherParameters& p, uint64_t seed)
      : pair(generate_pair(width, height, p.disparities, 25, 2, seed)),
        left(width, height, 3, p.cost),
        right(width, height, 3, p.cost) {
    left.make(pair.left_view(), false);
    right.make(pair.right_view(), false);
    for (int y = 0; y < height; ++y) {
      CostRow row;
      for (int x = 0; x < width; ++x)
        for (int d = 0; d < p.disparities; ++d) row.push_back(left.cost(right, x, x - d, y, p));
      costs.push_back(row);
    }
  }
  double cost(int x, int y, int d, int n) const {
    x = std::clamp(x, 0, pair.width - 1);
    y = std::clamp(y, 0, pair.height - 1);
    return static_cast<double>(costs[static_cast<size_t>(y)][static_cast<size_t>(x * n + d)]);
  }
};

/// Largest difference of the aggregated costs from those of `expected(x, y, d)`.
template <class Expected>
double difference(const Made& made, const MatcherParameters& p, Expected expected) {
  const int w = made.pair.width, h = made.pair.height;
  Aggregator aggregator(w, h, p);
  CostRow out(made.costs.front().size());
  double worst = 0;
  for (int run = 0; run < 2; ++run) {  // the second run finds used memory
    aggregator.start(made.left, p.disparities);
    int added = 0;
    for (int y = 0; y < h; ++y) {
      for (; added < aggregator.rows_needed(y); ++added) aggregator.add(made.costs[static_cast<size_t>(added)]);
      aggregator.take(y, out);
      for (int x = 0; x < w; ++x)
        for (int d = 0; d < p.disparities; ++d)
          worst = std::max(worst, std::abs(static_cast<double>(out[static_cast<size_t>(x * p.disparities + d)]) -
                                           expected(x, y, d)));
    }
  }
  return worst;
}

MatcherParameters of_size(int n_square, int n_min) {
  MatcherParameters p;
  p.disparities = 12;
  p.n_square = n_square;
  p.n_min = n_min;
  return p;
}

/// Smallest mean cost of the windows of that edge around the pixels of the minimum filter.
double filtered_mean(const Made& made, const MatcherParameters& p, int edge, int x, int y, int d) {
  const int r = std::min(p.n_min, edge) / 2, m = edge / 2;
  double smallest = 1e9;
  for (int ny = std::max(0, y - r); ny <= std::min(made.pair.height - 1, y + r); ++ny)
    for (int nx = std::max(0, x - r); nx <= std::min(made.pair.width - 1, x + r); ++nx) {
      double sum = 0;
      for (int l = -m; l <= m; ++l)
        for (int k = -m; k <= m; ++k) sum += made.cost(nx + k, ny + l, d, p.disparities);
      smallest = std::min(smallest, sum / (edge * edge));
    }
  return smallest;
}

}  // namespace

TEST_CASE("adaptive window: smallest, largest and mean of the windows of edge 5, 9 and 15") {
  for (const auto combination : {Combination::min, Combination::max, Combination::mean}) {
    MatcherParameters p = of_size(15, 5);
    p.aggregation = Aggregation::adaptive_window;
    p.combination = combination;
    const Made made(33, 21, p, 3);
    CHECK(difference(made, p, [&](int x, int y, int d) {
            const double a = filtered_mean(made, p, 5, x, y, d), b = filtered_mean(made, p, 9, x, y, d),
                         c = filtered_mean(made, p, 15, x, y, d);
            return combination == Combination::min   ? std::min({a, b, c})
                   : combination == Combination::max ? std::max({a, b, c})
                                                     : (a + b + c) / 3;
          }) < 1e-4);
  }
}

TEST_CASE("adaptive weights by distance and colour (thesis Eq. 3.5 with its denominator)") {
  MatcherParameters p = of_size(7, 1);
  p.aggregation = Aggregation::adaptive_weight;
  const Made made(25, 15, p, 5);
  CHECK(difference(made, p, [&](int x, int y, int d) {
          double sum = 0, weights = 0;
          for (int l = -3; l <= 3; ++l)
            for (int k = -3; k <= 3; ++k) {
              double squared = 0;
              for (int c = 0; c < 3; ++c)
                squared += std::pow(made.left.level(x + k, y + l, c) - made.left.level(x, y, c), 2);
              const double weight = std::exp(-(std::hypot(k, l) / 7.5 + std::sqrt(squared) / 20));
              sum += weight * made.cost(x + k, y + l, d, p.disparities);
              weights += weight;
            }
          return sum / weights;
        }) < 1e-4);
}

TEST_CASE("boundary guided: along the row, then along the column, up to the next edge") {
  MatcherParameters p = of_size(9, 1);
  p.aggregation = Aggregation::boundary;
  p.edge_threshold = 20;
  const Made made(31, 19, p, 7);
  const int w = made.pair.width, h = made.pair.height;
  int edges = 0;
  const auto is_edge = [&](int x, int y) {
    int gx = 0, gy = 0;
    for (int c = 0; c < 3; ++c) {
      gx = std::max(gx, std::abs(made.left.level(x + 1, y, c) - made.left.level(x - 1, y, c)));
      gy = std::max(gy, std::abs(made.left.level(x, y + 1, c) - made.left.level(x, y - 1, c)));
    }
    return std::hypot(gx, gy) / 2 > 20;
  };
  /// Weighted mean of value(k) over steps -4 .. 4 that neither leave the image nor pass an edge pixel.
  const auto along = [&](int x, int y, int dx, int dy, auto value) {
    double sum = value(0), weights = 1;
    for (const int side : {-1, 1})
      for (int k = 1; k <= 4; ++k) {
        const int nx = x + side * k * dx, ny = y + side * k * dy;
        if (nx < 0 || ny < 0 || nx >= w || ny >= h) break;
        sum += (1 - k / 5.0) * value(side * k);
        weights += 1 - k / 5.0;
        if (is_edge(nx, ny)) break;
      }
    return sum / weights;
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) edges += is_edge(x, y);
  CHECK(edges > 20);  // else the edges would not be tested
  CHECK(edges < w * h - 20);
  CHECK(difference(made, p, [&](int x, int y, int d) {
          return along(x, y, 0, 1, [&](int l) {
            return along(x, y + l, 1, 0, [&](int k) { return made.cost(x + k, y + l, d, p.disparities); });
          });
        }) < 1e-4);
}

TEST_CASE("scanline: no path through a row is cheaper than the one found") {
  std::mt19937 random(test::seed(41));
  for (int round = 0; round < test::rounds(20); ++round) {
    MatcherParameters p = of_size(1, 1);
    p.disparities = 2 + static_cast<int>(random() % 6);
    p.cost = CostKind::sad;
    p.selection = Selection::scanline;
    p.p1 = 1 + static_cast<int>(random() % 10);
    p.p2 = p.p1 + static_cast<int>(random() % 20);
    const int w = 2 + static_cast<int>(random() % 30);
    const Made made(w, 1, p, test::seed(static_cast<uint64_t>(round)));
    std::vector<int16_t> chosen(static_cast<size_t>(w));
    std::vector<uint8_t> confidence(chosen.size());
    GeneralMatcher matcher(w, 1, 3, p);
    REQUIRE(matcher.match(made.pair.left_view(), made.pair.right_view(),
                          {{chosen.data(), w, 1}, {confidence.data(), w, 1}}));
    const auto step = [&](int a, int b) { return a == b ? 0 : std::abs(a - b) == 1 ? p.p1 : p.p2; };
    double energy = 0;
    std::vector<double> cheapest(static_cast<size_t>(p.disparities));  // of all paths to (x, d)
    for (int x = 0; x < w; ++x) {
      const auto at = static_cast<size_t>(x);
      energy += made.cost(x, 0, chosen[at], p.disparities) + (x > 0 ? step(chosen[at], chosen[at - 1]) : 0);
      std::vector<double> next(cheapest.size(), 1e9);
      for (int d = 0; d < p.disparities; ++d)
        for (int e = 0; e < p.disparities; ++e)
          next[static_cast<size_t>(d)] =
              std::min(next[static_cast<size_t>(d)],
                       (x > 0 ? cheapest[static_cast<size_t>(e)] + step(d, e) : 0) + made.cost(x, 0, d, p.disparities));
      cheapest = next;
    }
    CHECK(energy == doctest::Approx(*std::min_element(cheapest.begin(), cheapest.end())));
  }
}

TEST_CASE("sub-pixel disparities lie nearer to the truth than whole ones") {
  const GeneratedPair pair = generate_pair(200, 120, 40, 30, 1, 11);
  const auto error = [&](MatcherParameters p, bool fine) {
    p.disparities = 40;
    p.subpixel = fine;
    std::vector<int16_t> d(200 * 120);
    std::vector<uint8_t> c(d.size()), f(d.size());
    const DisparityViews views{{d.data(), 200, 120}, {c.data(), 200, 120}, {f.data(), 200, 120}};
    REQUIRE(make_matcher(200, 120, 3, p)->match(pair.left_view(), pair.right_view(), views));
    const DisparityImage found = to_disparity_image(views);
    const auto visible = visible_in_right(pair.truth);
    double sum = 0;
    int64_t count = 0;
    for (size_t i = 0; i < visible.size(); ++i) {
      const double e = std::abs(static_cast<double>(found.pixels[i] - pair.truth.pixels[i]));
      if (visible[i] == 0 || e > 1) continue;  // mismatches are no matter of fractions
      sum += e;
      ++count;
    }
    return sum / static_cast<double>(count);
  };
  for (const auto& p : {MatcherParameters{}, MatcherParameters::quality()}) {
    const double whole = error(p, false), fine = error(p, true);
    MESSAGE("mean error ", whole, " px whole, ", fine, " px with fractions");
    CHECK(whole > 0.15);  // a quarter of a pixel for evenly spread fractions
    CHECK(fine < 0.85 * whole);
  }
}
