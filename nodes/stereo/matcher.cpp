// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/matcher.hpp"

#include <hwy/aligned_allocator.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <new>
#include <stdexcept>

#include "nodes/stereo/image_kernels.hpp"
#include "nodes/stereo/row_kernel.hpp"

namespace takt::stereo {
namespace {

constexpr uint32_t kNoKey = 0xFFFFFFFF;
/// Columns of one strip; the ring of costs (n_square rows) then stays in the second-level cache.
constexpr int kStripWidth = 320;

/// Zeroed (so that no page is touched for the first time in a job), cache-line aligned memory.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  explicit Buffer(size_t count, T value = T{}) : data_(hwy::AllocateAligned<T>(count)), count_(count) {
    if (!data_) throw std::bad_alloc();
    std::fill(data_.get(), data_.get() + count, value);
  }
  T* data() const { return data_.get(); }
  size_t size() const { return count_; }

 private:
  hwy::AlignedFreeUniquePtr<T[]> data_;
  size_t count_ = 0;
};

/// Rows of equal length with `margin` elements before each and enough after it for vector accesses.
template <class T>
class Rows {
 public:
  Rows() = default;
  Rows(int height, int width, int after, T value = T{})
      : stride_((static_cast<size_t>(kRowPadding + width + after + kRowPadding) + 63) / 64 * 64),
        buffer_(stride_ * static_cast<size_t>(height), value) {}
  T* row(int y) const { return buffer_.data() + static_cast<size_t>(y) * stride_ + kRowPadding; }

 private:
  size_t stride_ = 0;
  Buffer<T> buffer_;
};

int round_up(int value, int unit) { return (value + unit - 1) / unit * unit; }

}  // namespace

struct Matcher::State {
  using Planes = std::array<Rows<uint8_t>, kMaxPlanes>;

  State(int width_, int height_, int channels_, const MatcherParameters& parameters);

  bool fits(ImageView<const uint8_t> view) const {
    return view.width == width && view.height == height && view.channels == channels && view.data != nullptr;
  }
  /// Searches 0 .. disparities - 1, not more than memory was taken for.
  void set_range(int disparities);
  /// Groups of the next block when that many are left.
  int block_size(int groups_left) const;
  /// The byte planes that the cost compares, in reading order or with the columns reversed.
  void make_planes(ImageView<const uint8_t> image, bool mirror, Planes& out);
  void make_grey(ImageView<const uint8_t> image);
  /// Keys of the reference image against the other one, given mirrored; minimum filter applied, left in `filtered`.
  void search(const Planes& reference, const Planes& mirrored_other, Rows<uint32_t>& out);
  void search_block(const Planes& reference, const Planes& mirrored_other, RowJob job, const RowFunctions& rows);
  void load_row(const Planes& reference, const Planes& mirrored_other, int y, RowJob& job);
  void filter(Rows<uint32_t>& out);
  void reject_inconsistent(int y, int16_t* disparity) const;

  MatcherParameters p;
  const int most_disparities;
  int width, height, channels, planes, lanes, all_groups, block_groups;
  bool narrow;
  const Kernels* kernels;
  const ImageKernels* images;
  size_t column_stride = 0;  ///< bytes of one column of costs

  Rows<uint8_t> grey;
  Planes left, right_mirrored;
  Rows<uint32_t> keys, along, left_keys, right_keys;
  Buffer<uint8_t> scratch_row, ring, zeros, columns, outside;
  std::array<Buffer<uint32_t>, kMaxPlanes> reference_row;
  std::array<Buffer<uint8_t>, kMaxPlanes> search_row;
  Buffer<uint16_t> no_tail, last_tail, sums;
  Buffer<uint32_t> winners;
};

Matcher::State::State(int width_, int height_, int channels_, const MatcherParameters& parameters)
    : p(parameters),
      most_disparities(parameters.disparities),
      width(width_),
      height(height_),
      channels(channels_),
      kernels(&stereo::kernels()),
      images(&image_kernels()) {
  planes = p.cost == CostKind::gradient ? 2 : 3;
  lanes = kernels->lanes;
  narrow = p.cost == CostKind::gradient && p.truncation() * p.n_square <= 255;
  all_groups = (p.disparities + lanes - 1) / lanes;
  block_groups = p.uniqueness > 0 ? all_groups : block_size(all_groups);

  const int n = p.n_square, strip = std::min(width, kStripWidth) + 2 * (n + 1);
  const int depth = (all_groups + 16) * lanes;
  const auto size = [](int count) { return static_cast<size_t>(count); };
  column_stride = size(round_up(block_groups, 2) * lanes);
  scratch_row = Buffer<uint8_t>(size(width + kRowPadding));
  ring = Buffer<uint8_t>(size(n) * size(strip) * column_stride);
  zeros = Buffer<uint8_t>(size(strip) * column_stride);
  columns = Buffer<uint8_t>(size(strip) * column_stride * column_bytes(narrow));
  sums = Buffer<uint16_t>(column_stride);
  winners = Buffer<uint32_t>(size(strip));
  if (p.cost == CostKind::gradient) grey = Rows<uint8_t>(height, width, 0);
  for (int i = 0; i < planes; ++i) {
    const auto at = size(i);
    left[at] = Rows<uint8_t>(height, width, depth);
    right_mirrored[at] = Rows<uint8_t>(height, width, depth);
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
  along = Rows<uint32_t>(height, width, 0, kNoKey);
  left_keys = Rows<uint32_t>(height, width, 0, kNoKey);
  if (p.left_right_check) right_keys = Rows<uint32_t>(height, width, 0, kNoKey);
}

void Matcher::State::set_range(int disparities) {
  p.disparities = std::clamp(disparities, 1, most_disparities);
  all_groups = (p.disparities + lanes - 1) / lanes;
  for (int i = 0; i < lanes; ++i)
    last_tail.data()[i] = (all_groups - 1) * lanes + i >= p.disparities ? uint16_t{0xFFFF} : uint16_t{0};
}

int Matcher::State::block_size(int groups_left) const {
  // Sums are scaled by the number of groups and must stay below 65535.
  const int most = std::min(groups_left, 65535 / (p.max_sum() + 1));
  for (const int size : block_sizes(narrow))
    if (size <= most) return size;
  return 1;
}

void Matcher::State::make_grey(ImageView<const uint8_t> image) {
  for (int y = 0; y < height; ++y) {
    uint8_t* row = grey.row(y);
    if (channels == 3) images->grey(image.row(y), width, row);
    else std::memcpy(row, image.row(y), static_cast<size_t>(width));
    row[-1] = row[0];
    row[width] = row[width - 1];
  }
}

void Matcher::State::make_planes(ImageView<const uint8_t> image, bool mirror, Planes& out) {
  const bool gradient = p.cost == CostKind::gradient;
  if (gradient) make_grey(image);
  // A grey image under ssd or sad leaves planes 1 and 2 zero: they then cost nothing.
  const int used = gradient ? 2 : channels;
  const uint8_t bias = p.cost == CostKind::ssd ? 0x80 : 0;
  for (int i = 0; i < used; ++i)
    for (int y = 0; y < height; ++y) {
      uint8_t* target = out[static_cast<size_t>(i)].row(y);
      uint8_t* row = mirror ? scratch_row.data() : target;
      if (!gradient) images->channel(image.row(y), channels, i, width, bias, row);
      else if (i == 0) images->derivative(grey.row(y) - 1, grey.row(y) + 1, width, row);
      else images->derivative(grey.row(std::max(0, y - 1)), grey.row(std::min(height - 1, y + 1)), width, row);
      if (mirror) images->reverse(row, width, target);
    }
}

void Matcher::State::load_row(const Planes& reference, const Planes& mirrored_other, int y, RowJob& job) {
  const int count = job.last_column - job.first_column + 1;
  const int start = width - 1 - job.last_column + job.first_disparity;
  for (int i = 0; i < planes; ++i) {
    const auto at = static_cast<size_t>(i);
    images->spread(reference[at].row(y) + job.first_column, count, reference_row[at].data());
    kernels->interleave(mirrored_other[at].row(y) + start, count + round_up(job.groups, 2) * lanes,
                        search_row[at].data());
  }
}

void Matcher::State::search_block(const Planes& reference, const Planes& mirrored_other, RowJob job,
                                  const RowFunctions& rows) {
  const int r = job.radius, n = p.n_square, last = height - 1;
  const size_t row_bytes = static_cast<size_t>(job.last_column - job.first_column + 1) * column_stride;
  const auto slot = [&](int y) { return ring.data() + static_cast<size_t>(y % n) * row_bytes; };
  std::memset(columns.data(), 0, row_bytes * column_bytes(narrow));
  for (int y = 0; y <= std::min(r, last); ++y) {
    load_row(reference, mirrored_other, y, job);
    job.ring_new = slot(y);
    rows.fill(job);
  }
  job.ring_old = zeros.data();
  for (int y = -r; y <= r; ++y) {
    job.ring_new = slot(std::clamp(y, 0, last));
    rows.roll(job);
  }
  for (int y = 0; y < height; ++y) {
    const int enters = std::min(y + r, last), leaves = std::max(y - r - 1, 0);
    if (y > 0) {
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

void Matcher::State::search(const Planes& reference, const Planes& mirrored_other, Rows<uint32_t>& out) {
  RowJob job;
  job.image_width = width;
  job.radius = p.n_square / 2;
  job.c_max = p.truncation();
  job.uniqueness = p.uniqueness;
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
      job.groups = p.uniqueness > 0 ? all_groups : block_size(all_groups - group);
      job.first_disparity = group * lanes;
      job.first_block = group == 0;
      job.outside = outside.data() + 2 * (width - 1 - job.last_column + job.first_disparity);
      job.tail = group + job.groups == all_groups ? last_tail.data() : no_tail.data();
      search_block(reference, mirrored_other, job,
                   p.uniqueness > 0 ? kernels->unique_rows(p.cost, narrow) : kernels->rows(p.cost, narrow, job.groups));
    }
  }
  filter(out);
}

// min_d min_w S = min_w min_d S: the minimum filter on the volume is one on the (sum, disparity) keys, ties included.
void Matcher::State::filter(Rows<uint32_t>& out) {
  const int r = p.n_min / 2;
  for (int y = 0; y < height; ++y) images->minimum_along(keys.row(y), r, width, along.row(y));
  for (int y = 0; y < height; ++y) {
    uint32_t* row = out.row(y);
    std::memcpy(row, along.row(y), static_cast<size_t>(width) * sizeof(uint32_t));
    for (int n = std::max(0, y - r); n <= std::min(height - 1, y + r); ++n)
      if (n != y) images->minimum_with(along.row(n), width, row);
  }
}

void Matcher::State::reject_inconsistent(int y, int16_t* disparity) const {
  const uint32_t* other = right_keys.row(y);
  for (int x = 0; x < width; ++x) {
    const int d = disparity[x], xr = x - d;
    if (d < 0) continue;
    if (xr < 0 || std::abs(static_cast<int>((other[width - 1 - xr] & 0xFFFF) >> 1) - d) > 1) disparity[x] = -1;
  }
}

Matcher::Matcher(int width, int height, int channels, const MatcherParameters& parameters) {
  if (const auto wrong = problem(parameters, width, height, channels)) throw std::invalid_argument("stereo: " + *wrong);
  state_ = std::make_unique<State>(width, height, channels, parameters);
}
Matcher::~Matcher() = default;
Matcher::Matcher(Matcher&&) noexcept = default;
Matcher& Matcher::operator=(Matcher&&) noexcept = default;

void Matcher::limit_search(int disparities) { state_->set_range(disparities); }

const MatcherParameters& Matcher::parameters() const { return state_->p; }
const char* Matcher::target() const { return state_->kernels->target; }

bool Matcher::match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, ImageView<int16_t> disparity,
                    ImageView<uint8_t> confidence) {
  State& s = *state_;
  const auto same_size = [&](const auto& view) { return view.width == s.width && view.height == s.height; };
  if (!s.fits(left) || !s.fits(right) || !same_size(disparity) || !same_size(confidence)) return false;
  s.make_planes(left, false, s.left);
  s.make_planes(right, true, s.right_mirrored);
  s.search(s.left, s.right_mirrored, s.left_keys);
  // Seen in a mirror the right image is a left one, and the left image as it is stored is the mirrored right one.
  if (s.p.left_right_check) s.search(s.right_mirrored, s.left, s.right_keys);
  for (int y = 0; y < s.height; ++y) {
    s.images->decode(s.left_keys.row(y), s.p.max_sum(), s.p.min_confidence, s.width, disparity.row(y),
                     confidence.row(y));
    if (s.p.left_right_check) s.reject_inconsistent(y, disparity.row(y));
  }
  return true;
}

}  // namespace takt::stereo
