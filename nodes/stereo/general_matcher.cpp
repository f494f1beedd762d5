// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/general_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "nodes/stereo/aggregation.hpp"
#include "nodes/stereo/aligned_rows.hpp"
#include "nodes/stereo/post_process.hpp"

namespace takt::stereo {
namespace {

/// One path's costs at one pixel after those at the pixel before (path_kernel.hpp); `least` is their minimum there.
void advance(float* path, float& least, const float* cost, int count, float p1, float p2) {
  float before = std::numeric_limits<float>::max(), smallest = before;
  for (int d = 0; d < count; ++d) {
    const float here = path[d], after = d + 1 < count ? path[d + 1] : std::numeric_limits<float>::max();
    const float way = std::min({here, before + p1, after + p1, least + p2}) - least;
    path[d] = cost[d] + way;
    smallest = std::min(smallest, path[d]);
    before = here;
  }
  least = smallest;
}

float fraction_px(float before, float best, float after) {
  const float bend = before - 2 * best + after;
  return bend > 0 ? (before - after) / (2 * bend) : 0;
}

}  // namespace

struct GeneralMatcher::State {
  State(int width_, int height_, int channels_, const MatcherParameters& parameters);

  size_t pixel(int x) const { return static_cast<size_t>(x) * static_cast<size_t>(p.disparities); }
  void search(const Features& reference, const Features& other, Rows<int16_t>& fine);
  void fill_costs(const Features& reference, const Features& other, int y);
  /// Winners of one row of aggregated costs.
  void select(int y, Rows<int16_t>& fine);
  void select_winners(const CostRow& costs, float largest, int y, Rows<int16_t>& fine);
  void select_path(int y, Rows<int16_t>& fine);
  void add_paths();
  void put(const float* costs, int d, float largest, int x, int y, Rows<int16_t>& fine);
  void write(int y, const DisparityViews& out) const;

  MatcherParameters p;
  const MatcherParameters made;
  const int most_disparities;
  int width, height, channels;
  Features left, right;
  Aggregator aggregator;
  CostRow costs, aggregated, totals, above, path;
  std::vector<float> above_least;
  std::vector<int16_t> came_from;
  Rows<int16_t> left_fine, right_fine, smooth;  ///< the right one's columns are reversed
  Rows<uint8_t> confidence, ambiguous;
};

GeneralMatcher::State::State(int width_, int height_, int channels_, const MatcherParameters& parameters)
    : p(parameters),
      made(parameters),
      most_disparities(parameters.disparities),
      width(width_),
      height(height_),
      channels(channels_),
      left(width_, height_, channels_, parameters.cost),
      right(width_, height_, channels_, parameters.cost),
      aggregator(width_, height_, parameters) {
  costs.resize(pixel(width));
  aggregated = costs;
  if (p.selection != Selection::winner) path.resize(pixel(width));
  if (p.selection == Selection::scanline) came_from.resize(pixel(width));
  if (p.selection == Selection::semi_global) {
    totals = above = costs;
    above_least.resize(static_cast<size_t>(width));
  }
  left_fine = Rows<int16_t>(height, width);
  if (p.left_right_check) right_fine = Rows<int16_t>(height, width);
  if (p.median) smooth = Rows<int16_t>(height, width);
  confidence = Rows<uint8_t>(height, width);
  ambiguous = Rows<uint8_t>(height, width);
}

void GeneralMatcher::State::fill_costs(const Features& reference, const Features& other, int y) {
  float* to = costs.data();
  for (int x = 0; x < width; ++x)
    for (int d = 0; d < p.disparities; ++d) *to++ = reference.cost(other, x, x - d, y, p);
}

void GeneralMatcher::State::search(const Features& reference, const Features& other, Rows<int16_t>& fine) {
  aggregator.start(reference, p.disparities);
  std::fill(above.begin(), above.end(), 0.0f);
  std::fill(above_least.begin(), above_least.end(), 0.0f);
  int added = 0;
  for (int y = 0; y < height; ++y) {
    for (; added < aggregator.rows_needed(y); ++added) {
      fill_costs(reference, other, added);
      aggregator.add(costs);
    }
    aggregator.take(y, aggregated);
    select(y, fine);
  }
}

void GeneralMatcher::State::select(int y, Rows<int16_t>& fine) {
  const auto scale = static_cast<float>(aggregator.scale()), c_max = static_cast<float>(p.truncation());
  switch (p.selection) {
    case Selection::winner: return select_winners(aggregated, c_max * scale, y, fine);
    case Selection::scanline: return select_path(y, fine);
    case Selection::semi_global:
      add_paths();
      return select_winners(totals, 3 * scale * (c_max + static_cast<float>(p.step_twice())), y, fine);
  }
}

/// The choice of one pixel, of whose costs `largest` is the largest possible.
void GeneralMatcher::State::put(const float* all, int d, float largest, int x, int y, Rows<int16_t>& fine) {
  int fraction = kNoFraction;
  if (p.subpixel && d > 0 && d + 1 < p.disparities)
    fraction = std::clamp(
        kNoFraction + static_cast<int>(std::lround(kFractions * fraction_px(all[d - 1], all[d], all[d + 1]))), 0,
        kFractions - 1);
  fine.row(y)[x] = static_cast<int16_t>(d * kFractions + fraction);
  const double zeta =
      std::max(0.0, static_cast<double>(largest) - static_cast<double>(all[d])) / static_cast<double>(largest);
  confidence.row(y)[x] = static_cast<uint8_t>(255 * zeta + 0.5);
  ambiguous.row(y)[x] = 0;
  if (p.uniqueness == 0) return;
  float second = p.selection == Selection::semi_global ? largest : 65535;
  for (int e = 0; e < p.disparities; ++e)
    if (std::abs(e - d) > 1) second = std::min(second, all[e]);
  ambiguous.row(y)[x] = static_cast<double>(second - all[d]) * 256 <= p.uniqueness * static_cast<double>(second);
}

void GeneralMatcher::State::select_winners(const CostRow& all, float largest, int y, Rows<int16_t>& fine) {
  for (int x = 0; x < width; ++x) {
    const float* at = all.data() + pixel(x);
    put(at, static_cast<int>(std::min_element(at, at + p.disparities) - at), largest, x, y, fine);
  }
}

/// Cheapest path through the row (Viterbi): costs from the left border, where each came from, and back.
void GeneralMatcher::State::select_path(int y, Rows<int16_t>& fine) {
  const auto scale = static_cast<float>(aggregator.scale());
  const float p1 = scale * static_cast<float>(p.step_once()), p2 = scale * static_cast<float>(p.step_twice());
  const int n = p.disparities;
  std::copy_n(aggregated.begin(), n, path.begin());
  for (int x = 1; x < width; ++x) {
    const float* last = path.data() + pixel(x - 1);
    const auto cheapest = static_cast<int16_t>(std::min_element(last, last + n) - last);
    for (int d = 0; d < n; ++d) {
      auto from = static_cast<int16_t>(d);
      float way = last[d];
      const auto consider = [&](int e, float cost) {
        if (cost >= way) return;
        way = cost;
        from = static_cast<int16_t>(e);
      };
      if (d > 0) consider(d - 1, last[d - 1] + p1);
      if (d + 1 < n) consider(d + 1, last[d + 1] + p1);
      consider(cheapest, last[cheapest] + p2);
      path[pixel(x) + static_cast<size_t>(d)] = aggregated[pixel(x) + static_cast<size_t>(d)] + way;
      came_from[pixel(x) + static_cast<size_t>(d)] = from;
    }
  }
  const float* end = path.data() + pixel(width - 1);
  auto d = static_cast<int>(std::min_element(end, end + n) - end);
  for (int x = width - 1; x >= 0; --x) {
    put(aggregated.data() + pixel(x), d, scale * static_cast<float>(p.truncation()), x, y, fine);
    if (x > 0) d = came_from[pixel(x) + static_cast<size_t>(d)];
  }
}

/// Sums of the paths from the left, from above and from the right.
void GeneralMatcher::State::add_paths() {
  const auto scale = static_cast<float>(aggregator.scale());
  const float p1 = scale * static_cast<float>(p.step_once()), p2 = scale * static_cast<float>(p.step_twice());
  const auto n = static_cast<size_t>(p.disparities);
  const auto add = [&](int x, float* from, float& least) {
    advance(from, least, aggregated.data() + pixel(x), p.disparities, p1, p2);
    for (size_t d = 0; d < n; ++d) totals[pixel(x) + d] += from[d];
  };
  std::fill(totals.begin(), totals.end(), 0.0f);
  float least = 0;
  std::fill_n(path.begin(), n, 0.0f);
  for (int x = 0; x < width; ++x) {
    add(x, path.data(), least);
    add(x, above.data() + pixel(x), above_least[static_cast<size_t>(x)]);
  }
  least = 0;
  std::fill_n(path.begin(), n, 0.0f);
  for (int x = width - 1; x >= 0; --x) add(x, path.data(), least);
}

void GeneralMatcher::State::write(int y, const DisparityViews& out) const {
  int16_t* disparity = out.disparity.row(y);
  for (int x = 0; x < width; ++x) {
    const uint8_t sure = out.confidence.row(y)[x] = confidence.row(y)[x];
    disparity[x] = sure < p.min_confidence || ambiguous.row(y)[x] != 0 ? int16_t{-1} : int16_t{0};
  }
  take_fine((p.median ? smooth : left_fine).row(y), width, disparity,
            out.fraction.data != nullptr ? out.fraction.row(y) : nullptr);
  if (!p.left_right_check) return;
  const int16_t* mirrored = right_fine.row(y);
  reject_inconsistent(disparity, width, [&](int xr) { return mirrored[width - 1 - xr] / kFractions; });
}

GeneralMatcher::GeneralMatcher(int width, int height, int channels, const MatcherParameters& parameters) {
  if (const auto wrong = problem(parameters, width, height, channels)) throw std::invalid_argument("stereo: " + *wrong);
  state_ = std::make_unique<State>(width, height, channels, parameters);
}
GeneralMatcher::~GeneralMatcher() = default;

void GeneralMatcher::tune(const MatcherParameters& parameters) {
  const int disparities = state_->p.disparities;
  state_->p = tuned(state_->made, parameters);
  state_->p.disparities = disparities;
  state_->aggregator.tune(state_->p);
}

void GeneralMatcher::limit_search(int disparities) {
  state_->p.disparities = std::clamp(disparities, 1, state_->most_disparities);
}

bool GeneralMatcher::match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const DisparityViews& out) {
  State& s = *state_;
  if (!fit(left, right, out, s.width, s.height, s.channels)) return false;
  if (s.p.left_right_check) {  // seen in a mirror the right image is a left one
    s.left.make(right, true);
    s.right.make(left, true);
    s.search(s.left, s.right, s.right_fine);
  }
  s.left.make(left, false);
  s.right.make(right, false);
  s.search(s.left, s.right, s.left_fine);
  if (s.p.median) median_3x3(s.left_fine.view(), s.smooth.view());
  for (int y = 0; y < s.height; ++y) s.write(y, out);
  return true;
}

}  // namespace takt::stereo
