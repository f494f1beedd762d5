// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/semi_global_matcher.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>

#include "nodes/stereo/cost_planes.hpp"
#include "nodes/stereo/path_kernel.hpp"
#include "nodes/stereo/post_process.hpp"

namespace takt::stereo {

struct SemiGlobalMatcher::State {
  State(int width_, int height_, int channels_, const MatcherParameters& parameters);
  void set_range(int disparities);
  void price_steps();
  /// Bytes of a pixel of `above`.
  int above_stride() const { return round_up(p.disparities + 1, kernels->lanes); }
  void search(const Planes& reference, const Planes& mirrored_other, const Rows<int16_t>& fine);
  void write(int y, const DisparityViews& out) const;

  MatcherParameters p;
  const MatcherParameters made;
  const int most_disparities;
  int width, height, channels, vectors = 0;
  const PathKernels* kernels;
  PlaneMaker maker;
  Planes left, right_mirrored;
  Buffer<uint8_t> outside, beyond, above_least, from_left, from_right, totals;
  std::array<Buffer<uint8_t>, 2> costs, sums, above;  ///< of even and odd rows
  Rows<int16_t> left_fine, right_fine, smooth;        ///< the right one's columns are reversed
  Rows<uint8_t> least, ambiguous;
  std::array<uint8_t, 256> confidences{};  ///< of a sum of three paths
};

SemiGlobalMatcher::State::State(int width_, int height_, int channels_, const MatcherParameters& parameters)
    : p(parameters),
      made(parameters),
      most_disparities(parameters.disparities),
      width(width_),
      height(height_),
      channels(channels_),
      kernels(&path_kernels()),
      maker(width_, height_, channels_, parameters.cost) {
  const int depth = round_up(p.disparities, kernels->lanes);
  const auto size = [](int count) { return static_cast<size_t>(count); };
  left = maker.planes(depth);
  right_mirrored = maker.planes(depth);
  outside = Buffer<uint8_t>(size(width + depth));
  std::memset(outside.data() + width, p.truncation(), size(depth));
  beyond = Buffer<uint8_t>(size(depth));
  set_range(p.disparities);
  for (auto* volume : {&costs, &sums})
    for (Buffer<uint8_t>& row : *volume) row = Buffer<uint8_t>(size(width) * size(depth));
  for (Buffer<uint8_t>& row : above)  // neighbours of the first and of the last pixel are read, too
    row = Buffer<uint8_t>(size(2 * kernels->lanes) + size(width) * size(above_stride()));
  above_least = Buffer<uint8_t>(size(width));
  for (Buffer<uint8_t>* pixel : {&from_left, &from_right, &totals}) *pixel = Buffer<uint8_t>(size(depth));
  left_fine = Rows<int16_t>(height, width);
  if (p.left_right_check) right_fine = Rows<int16_t>(height, width);
  if (p.median) smooth = Rows<int16_t>(height, width);
  price_steps();
  least = Rows<uint8_t>(height, width);
  ambiguous = Rows<uint8_t>(height, width);
}

void SemiGlobalMatcher::State::price_steps() {
  const int largest = 3 * (p.truncation() + p.step_twice());
  for (int sum = 0; sum <= largest; ++sum) confidences[static_cast<size_t>(sum)] = confidence_of(sum, largest);
}

void SemiGlobalMatcher::State::set_range(int disparities) {
  p.disparities = std::clamp(disparities, 1, most_disparities);
  vectors = (p.disparities + kernels->lanes - 1) / kernels->lanes;
  std::memset(beyond.data(), 0, static_cast<size_t>(p.disparities));
  std::memset(beyond.data() + p.disparities, 255, beyond.size() - static_cast<size_t>(p.disparities));
}

void SemiGlobalMatcher::State::search(const Planes& reference, const Planes& mirrored_other,
                                      const Rows<int16_t>& fine) {
  for (Buffer<uint8_t>& row : above) row.fill(255);
  for (int x = 0; x < width; ++x)
    std::memset(above[1].data() + kernels->lanes + x * above_stride(), 0, static_cast<size_t>(p.disparities));
  above_least.fill(0);
  PathRow row;
  row.width = width;
  row.disparities = p.disparities;
  row.vectors = vectors;
  row.c_max = static_cast<uint8_t>(p.truncation());
  row.p1 = static_cast<uint8_t>(p.step_once());
  row.p2 = static_cast<uint8_t>(p.step_twice());
  row.uniqueness = p.uniqueness;
  row.subpixel = p.subpixel;
  row.outside = outside.data();
  row.beyond = beyond.data();
  row.above_stride = above_stride();
  row.above_least = above_least.data();
  row.from_left = from_left.data();
  row.from_right = from_right.data();
  row.totals = totals.data();
  PathRow before;
  for (int y = 0; y < height; ++y) {
    row.costs = costs[static_cast<size_t>(y % 2)].data();
    row.sums = sums[static_cast<size_t>(y % 2)].data();
    row.above = above[static_cast<size_t>((y + 1) % 2)].data() + kernels->lanes;
    row.above_here = above[static_cast<size_t>(y % 2)].data() + kernels->lanes;
    for (int i = 0; i < maker.count(); ++i) {
      row.left[i] = reference[static_cast<size_t>(i)].row(y);
      row.right[i] = mirrored_other[static_cast<size_t>(i)].row(y);
    }
    row.fine = fine.row(y);
    row.least = least.row(y);
    row.ambiguous = ambiguous.row(y);
    kernels->run_rows(&row, y > 0 ? &before : nullptr);
    before = row;
  }
  kernels->run_rows(nullptr, &before);
}

void SemiGlobalMatcher::State::write(int y, const DisparityViews& out) const {
  int16_t* disparity = out.disparity.row(y);
  uint8_t* confidence = out.confidence.row(y);
  const uint8_t *at_least = least.row(y), *is_ambiguous = ambiguous.row(y);
  for (int x = 0; x < width; ++x) confidence[x] = confidences[at_least[x]];
  for (int x = 0; x < width; ++x) disparity[x] = (confidence[x] < p.min_confidence) | is_ambiguous[x] ? -1 : 0;
  take_fine((p.median ? smooth : left_fine).row(y), width, disparity,
            out.fraction.data != nullptr ? out.fraction.row(y) : nullptr);
  if (!p.left_right_check) return;
  const int16_t* mirrored = right_fine.row(y);
  reject_inconsistent(disparity, width, [&](int xr) { return mirrored[width - 1 - xr] / kFractions; });
}

bool SemiGlobalMatcher::serves(const MatcherParameters& p) {
  return p.selection == Selection::semi_global && p.cost == CostKind::census && p.aggregation == Aggregation::square &&
         p.n_square == 1;
}

SemiGlobalMatcher::SemiGlobalMatcher(int width, int height, int channels, const MatcherParameters& parameters) {
  if (const auto wrong = problem(parameters, width, height, channels)) throw std::invalid_argument("stereo: " + *wrong);
  state_ = std::make_unique<State>(width, height, channels, parameters);
}
SemiGlobalMatcher::~SemiGlobalMatcher() = default;

void SemiGlobalMatcher::tune(const MatcherParameters& parameters) {
  const int disparities = state_->p.disparities;
  state_->p = tuned(state_->made, parameters);
  state_->p.disparities = disparities;
  state_->price_steps();
}

void SemiGlobalMatcher::limit_search(int disparities) { state_->set_range(disparities); }
const char* SemiGlobalMatcher::target() const { return state_->kernels->target; }

bool SemiGlobalMatcher::match(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                              const DisparityViews& out) {
  State& s = *state_;
  if (!fit(left, right, out, s.width, s.height, s.channels)) return false;
  s.maker.make(left, false, s.left);
  s.maker.make(right, true, s.right_mirrored);
  // Seen in a mirror the right image is a left one, and the left image as it is stored is the mirrored right one.
  if (s.p.left_right_check) s.search(s.right_mirrored, s.left, s.right_fine);
  s.search(s.left, s.right_mirrored, s.left_fine);
  if (s.p.median) median_3x3(s.left_fine.view(), s.smooth.view());
  for (int y = 0; y < s.height; ++y) s.write(y, out);
  return true;
}

}  // namespace takt::stereo
