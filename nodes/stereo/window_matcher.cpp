// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/window_matcher.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>

#include "nodes/stereo/cost_planes.hpp"
#include "nodes/stereo/post_process.hpp"
#include "nodes/stereo/row_kernel.hpp"

namespace takt::stereo {
namespace {

constexpr uint32_t kNoKey = 0xFFFFFFFF;
/// Columns of one strip; the ring of costs (n_square rows) then stays in the second-level cache.
constexpr int kStripWidth = 320;

}  // namespace

struct WindowMatcher::State {
  struct RowRange {
    int first, last;  ///< the last is not one of them

    RowRange wider(int rows, int height) const { return {std::max(0, first - rows), std::min(height, last + rows)}; }
    int count() const { return last - first; }
  };

  State(int width_, int height_, int channels_, const MatcherParameters& parameters);

  /// Searches 0 .. disparities - 1, not more than memory was taken for.
  void set_range(int disparities);
  void set_rows(RowRange rows);
  /// Groups of the next block when that many are left.
  int block_size(int groups_left) const;
  /// Keys of the reference image against the other one, given mirrored.
  void search(const Planes& reference, const Planes& mirrored_other);
  void search_block(const Planes& reference, const Planes& mirrored_other, RowJob job, const RowFunctions& rows);
  void load_row(const Planes& reference, const Planes& mirrored_other, int y, RowJob& job);
  /// The minimum filter on the keys, row by row: `done(y)` follows when row y of `out` is.
  template <class Done>
  void filter(Rows<uint32_t>& out, Done done);
  void smooth_rows();
  bool in_memory() const { return p.uniqueness > 0 || p.subpixel; }
  void write(int y, const DisparityViews& out) const;

  MatcherParameters p;
  const MatcherParameters made;
  const int most_disparities;
  RowRange wanted, filtered, decided;  ///< rows of the result, and those that they are made of
  int width, height, channels, planes, lanes, all_groups, block_groups;
  bool narrow;
  const Kernels* kernels;
  const ImageKernels* images;
  PlaneMaker maker;
  size_t column_stride = 0;  ///< bytes of one column of costs

  Planes left, right_mirrored;
  Rows<uint32_t> keys, along, left_keys, right_keys;
  Rows<int16_t> fine, smooth;  ///< disparity << 6 | fraction, before and after the median filter
  Buffer<uint8_t> ring, zeros, columns, outside;
  std::array<Buffer<uint32_t>, kMaxPlanes> reference_row;
  std::array<Buffer<uint8_t>, kMaxPlanes> search_row;
  Buffer<uint16_t> no_tail, last_tail, sums;
  Buffer<uint32_t> winners;
};

WindowMatcher::State::State(int width_, int height_, int channels_, const MatcherParameters& parameters)
    : p(parameters),
      made(parameters),
      most_disparities(parameters.disparities),
      wanted{0, height_},
      filtered{0, height_},
      decided{0, height_},
      width(width_),
      height(height_),
      channels(channels_),
      kernels(&stereo::kernels()),
      images(&image_kernels()),
      maker(width_, height_, channels_, parameters.cost) {
  planes = planes_of(p.cost);
  lanes = kernels->lanes;
  narrow = may_be_narrow(p.cost) && p.truncation() * p.n_square <= 255;
  all_groups = (p.disparities + lanes - 1) / lanes;
  block_groups = in_memory() ? all_groups : block_size(all_groups);

  const int n = p.n_square, strip = std::min(width, kStripWidth) + 2 * (n + 1);
  const int depth = (all_groups + 16) * lanes;
  const auto size = [](int count) { return static_cast<size_t>(count); };
  column_stride = size(round_up(block_groups, 2) * lanes);
  ring = Buffer<uint8_t>(size(n) * size(strip) * column_stride);
  zeros = Buffer<uint8_t>(size(strip) * column_stride);
  columns = Buffer<uint8_t>(size(strip) * column_stride * column_bytes(narrow));
  sums = Buffer<uint16_t>(column_stride);
  winners = Buffer<uint32_t>(size(strip));
  left = maker.planes(depth);
  right_mirrored = maker.planes(depth);
  for (int i = 0; i < planes; ++i) {
    const auto at = size(i);
    reference_row[at] = Buffer<uint32_t>(size(strip + kRowPadding));
    search_row[at] = Buffer<uint8_t>(2 * size(strip + depth));
  }
  outside = Buffer<uint8_t>(2 * size(width + depth));
  for (int i = 0; i < width + depth; ++i)
    for (int odd = 0; odd < 2; ++odd)
      outside.data()[2 * i + odd] = static_cast<uint8_t>(i + odd * lanes >= width ? p.truncation() : 0);
  no_tail = Buffer<uint16_t>(size(lanes));
  last_tail = Buffer<uint16_t>(size(lanes));
  set_range(p.disparities);

  keys = Rows<uint32_t>(height, width, 0, kNoKey);
  along = Rows<uint32_t>(p.n_min, width, 0, kNoKey);
  left_keys = Rows<uint32_t>(height, width, 0, kNoKey);
  if (p.left_right_check) right_keys = Rows<uint32_t>(height, width, 0, kNoKey);
  if (p.median) {
    fine = Rows<int16_t>(height, width);
    smooth = Rows<int16_t>(height, width);
  }
}

void WindowMatcher::State::set_range(int disparities) {
  p.disparities = std::clamp(disparities, 1, most_disparities);
  all_groups = (p.disparities + lanes - 1) / lanes;
  for (int i = 0; i < lanes; ++i)
    last_tail.data()[i] = (all_groups - 1) * lanes + i >= p.disparities ? uint16_t{0xFFFF} : uint16_t{0};
}

void WindowMatcher::State::set_rows(RowRange rows) {
  wanted = rows;
  filtered = wanted.wider(p.median ? 1 : 0, height);
  decided = filtered.wider(p.n_min / 2, height);
}

int WindowMatcher::State::block_size(int groups_left) const {
  // Sums are scaled by the number of groups and must stay below 65535.
  const int most = std::min(groups_left, 65535 / (p.max_sum() + 1));
  for (const int size : block_sizes(narrow))
    if (size <= most) return size;
  return 1;
}

void WindowMatcher::State::load_row(const Planes& reference, const Planes& mirrored_other, int y, RowJob& job) {
  const int count = job.last_column - job.first_column + 1;
  const int start = width - 1 - job.last_column + job.first_disparity;
  for (int i = 0; i < planes; ++i) {
    const auto at = static_cast<size_t>(i);
    images->spread(reference[at].row(y) + job.first_column, count, reference_row[at].data());
    kernels->interleave(mirrored_other[at].row(y) + start, count + round_up(job.groups, 2) * lanes,
                        search_row[at].data());
  }
}

void WindowMatcher::State::search_block(const Planes& reference, const Planes& mirrored_other, RowJob job,
                                        const RowFunctions& rows) {
  const int r = job.radius, n = p.n_square, last = height - 1;
  const size_t row_bytes = static_cast<size_t>(job.last_column - job.first_column + 1) * column_stride;
  const auto slot = [&](int y) { return ring.data() + static_cast<size_t>(y % n) * row_bytes; };
  std::memset(columns.data(), 0, row_bytes * column_bytes(narrow));
  const int begin = decided.first;
  for (int y = std::max(0, begin - r); y <= std::min(begin + r, last); ++y) {
    load_row(reference, mirrored_other, y, job);
    job.ring_new = slot(y);
    rows.fill(job);
  }
  job.ring_old = zeros.data();
  for (int y = begin - r; y <= begin + r; ++y) {
    job.ring_new = slot(std::clamp(y, 0, last));
    rows.roll(job);
  }
  for (int y = begin; y < decided.last; ++y) {
    const int enters = std::min(y + r, last), leaves = std::max(y - r - 1, 0);
    if (y > begin) {
      job.new_row = y + r <= last && r > 0;
      job.ring_new = slot(enters);
      job.ring_old = slot(leaves);
      if (y + r <= last) load_row(reference, mirrored_other, enters, job);
      if (r == 0) {  // one row is the whole window: nothing to roll
        std::memset(columns.data(), 0, row_bytes * column_bytes(narrow));
        job.ring_old = zeros.data();
        rows.fill(job);
      }
      if (!job.new_row) rows.roll(job);
    }
    job.keys = keys.row(y) + job.x_begin;
    rows.decide(job);
  }
}

void WindowMatcher::State::search(const Planes& reference, const Planes& mirrored_other) {
  RowJob job;
  job.image_width = width;
  job.radius = p.n_square / 2;
  job.c_max = p.truncation();
  job.uniqueness = p.uniqueness;
  job.subpixel = p.subpixel;
  job.disparities = p.disparities;
  job.columns = columns.data();
  job.sums = sums.data();
  job.winners = winners.data();
  for (size_t i = 0; i < kMaxPlanes; ++i) {
    job.left[i] = reference_row[i].data();
    job.right[i] = search_row[i].data();
  }
  for (job.x_begin = 0; job.x_begin < width; job.x_begin = job.x_end) {
    job.x_end = std::min(width, job.x_begin + kStripWidth);
    job.first_column = std::max(0, job.x_begin - job.radius - 1);
    job.last_column = std::min(width - 1, job.x_end - 1 + job.radius);
    for (int group = 0; group < all_groups; group += job.groups) {
      job.groups = in_memory() ? all_groups : block_size(all_groups - group);
      job.first_disparity = group * lanes;
      job.first_block = group == 0;
      job.outside = outside.data() + 2 * (width - 1 - job.last_column + job.first_disparity);
      job.tail = group + job.groups == all_groups ? last_tail.data() : no_tail.data();
      search_block(reference, mirrored_other, job,
                   in_memory() ? kernels->rows_in_memory(p.cost, narrow) : kernels->rows(p.cost, narrow, job.groups));
    }
  }
}

// min_d min_w S = min_w min_d S: the minimum filter on the volume is one on the (sum, disparity) keys, ties included.
template <class Done>
void WindowMatcher::State::filter(Rows<uint32_t>& out, Done done) {
  const int r = p.n_min / 2;
  std::array<const uint32_t*, kLargestWindow> near{};
  const auto along_row = [&](int y) { return along.row(y % p.n_min); };
  int next = decided.first;  // row that the filter along rows has not seen yet
  for (int y = filtered.first; y < filtered.last; ++y) {
    const int top = std::max(0, y - r), bottom = std::min(height - 1, y + r);
    for (; next <= bottom; ++next) images->minimum_along(keys.row(next), r, width, along_row(next));
    size_t count = 0;
    for (int n = top; n <= bottom; ++n) near[count++] = along_row(n);
    images->minimum_across(near.data(), static_cast<int>(count), width, out.row(y));
    done(y);
  }
}

void WindowMatcher::State::smooth_rows() {
  const auto rows = [&](const Rows<int16_t>& of) {
    return ImageView<int16_t>{of.row(filtered.first), width, filtered.count(), 1, of.view().stride};
  };
  for (int y = filtered.first; y < filtered.last; ++y)
    for (int x = 0; x < width; ++x) fine.row(y)[x] = static_cast<int16_t>(left_keys.row(y)[x] % 65536 >> 1);
  median_3x3(rows(fine), rows(smooth));
}

void WindowMatcher::State::write(int y, const DisparityViews& out) const {
  int16_t* disparity = out.disparity.row(y);
  images->decode(left_keys.row(y), p.max_sum(), p.min_confidence, width, disparity, out.confidence.row(y));
  uint8_t* fraction = out.fraction.data != nullptr ? out.fraction.row(y) : nullptr;
  if (p.median) take_fine(smooth.row(y), width, disparity, fraction);
  else if (fraction != nullptr)
    for (int x = 0; x < width; ++x) fraction[x] = static_cast<uint8_t>((left_keys.row(y)[x] >> 1) % kFractions);
  if (!p.left_right_check) return;
  const uint32_t* mirrored = right_keys.row(y);
  reject_inconsistent(disparity, width,
                      [&](int xr) { return static_cast<int>(mirrored[width - 1 - xr] % 65536 >> 7); });
}

bool WindowMatcher::serves(const MatcherParameters& p) {
  return p.aggregation == Aggregation::square && p.selection == Selection::winner && p.cost != CostKind::rss &&
         p.cost != CostKind::mixed;
}

WindowMatcher::WindowMatcher(int width, int height, int channels, const MatcherParameters& parameters) {
  if (const auto wrong = problem(parameters, width, height, channels)) throw std::invalid_argument("stereo: " + *wrong);
  state_ = std::make_unique<State>(width, height, channels, parameters);
}
WindowMatcher::~WindowMatcher() = default;

void WindowMatcher::limit_search(int disparities) { state_->set_range(disparities); }

void WindowMatcher::tune(const MatcherParameters& parameters) {
  const int disparities = state_->p.disparities;
  state_->p = tuned(state_->made, parameters);
  state_->p.disparities = disparities;
}

void WindowMatcher::want_rows(int first, int last) { state_->set_rows({first, last}); }

const char* WindowMatcher::target() const { return state_->kernels->target; }

bool WindowMatcher::match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const DisparityViews& out) {
  State& s = *state_;
  if (!fit(left, right, out, s.width, s.height, s.channels)) return false;
  s.maker.make(left, false, s.left);
  s.maker.make(right, true, s.right_mirrored);
  const auto write = [&](int y) {
    if (y >= s.wanted.first && y < s.wanted.last) s.write(y, out);
  };
  const bool at_once = !s.p.left_right_check && !s.p.median;  // while the row is in the cache
  s.search(s.left, s.right_mirrored);
  s.filter(s.left_keys, [&](int y) {
    if (at_once) write(y);
  });
  if (at_once) return true;
  // Seen in a mirror the right image is a left one, and the left image as it is stored is the mirrored right one.
  if (s.p.left_right_check) {
    s.search(s.right_mirrored, s.left);
    s.filter(s.right_keys, [](int) {});
  }
  if (s.p.median) s.smooth_rows();
  for (int y = s.wanted.first; y < s.wanted.last; ++y) write(y);
  return true;
}

}  // namespace takt::stereo
