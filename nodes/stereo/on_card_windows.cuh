// SPDX-License-Identifier: Apache-2.0
// Internal: square windows, minimum filter and winner takes all (thesis Sec. 3.2), bit for bit as
// stereo::reference::match.
//
//   load            pixels of both images, grey or by channel
//   make_features   what a cost compares: derivatives, or the census bits
//   column_sums     for each pixel and disparity the sum of n_square costs above one another, into a volume
//   decide          sums of n_square columns, winner, fraction, ambiguity: a key for each pixel
//   filter          the smallest key of n_min x n_min pixels (the minimum filter on the volume, ties included)
//   write           median, confidence, rejection
//
// A key is sum << 16 | disparity << 7 | fraction << 1 | ambiguous. Four disparities, a group, lie in a word of the
// volume.
#pragma once
#include <cstdint>

#include "nodes/cuda/pixels.cuh"
#include "nodes/stereo/on_card_work.hpp"
#include "nodes/stereo/parameters.hpp"

namespace takt::cuda {

constexpr int kWarp = 32;
constexpr int kRun = 32;    // pixels that a warp decides
constexpr int kStrip = 48;  // rows that a thread goes down in column_sums
constexpr int kFilterWidth = 32, kFilterHeight = 16;
constexpr int kMostRadius = 15;
using stereo::kFractions, stereo::kNoFraction;
constexpr uint32_t kNoKey = 0xFFFFFFFF;

__device__ inline int clamp_to(int value, int count) { return value < 0 ? 0 : value >= count ? count - 1 : value; }

__device__ inline uint32_t warp_min(uint32_t value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_min_sync(0xFFFFFFFF, value);
#else
  for (int step = kWarp / 2; step > 0; step /= 2) value = min(value, __shfl_xor_sync(0xFFFFFFFF, value, step));
  return value;
#endif
}

// --- load, make_features

/// A thread takes four pixels of a row; blockIdx.z is the image.
__global__ void load(Work w) {
  const StereoShape& s = w.shape;
  const int x0 = 4 * static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x), y = static_cast<int>(blockIdx.y);
  if (x0 >= s.width) return;
  const bool right = blockIdx.z != 0;
  const uint8_t* row =
      (right ? w.call->right : w.call->left) + y * (right ? w.call->right_stride : w.call->left_stride);
  const int count = min(4, s.width - x0);
  const FourPixels four(row + x0 * s.channels, count, s.channels);
  uint8_t* out = (right ? w.right : w.left).pixels + static_cast<size_t>(y) * s.width + x0;
  const size_t plane = static_cast<size_t>(s.width) * s.height;
  const bool grey = s.cost == kGradient || s.cost == kCensus;
  for (int i = 0; i < count; ++i) {
    const uint8_t* pixel = four[i];
    if (s.channels == 1) out[i] = pixel[0];
    else if (grey) out[i] = stereo::grey_of(pixel[0], pixel[1], pixel[2]);
    else
      for (int c = 0; c < 3; ++c) out[c * plane + i] = pixel[c];
  }
}

__device__ inline uint8_t derivative(int before, int after) {
  return static_cast<uint8_t>(stereo::twice_derivative(before, after) + 128);
}

__global__ void make_features(Work w) {
  const StereoShape& s = w.shape;
  const int x = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x), y = static_cast<int>(blockIdx.y);
  if (x >= s.width) return;
  const Features& f = blockIdx.z != 0 ? w.right : w.left;
  const auto grey = [&](int column, int row) -> int {
    return f.pixels[static_cast<size_t>(clamp_to(row, s.height)) * s.width + clamp_to(column, s.width)];
  };
  const size_t at = static_cast<size_t>(y) * s.width + x;
  if (s.cost == kGradient) {
    f.bytes[at] = derivative(grey(x - 1, y), grey(x + 1, y));
    f.bytes[at + static_cast<size_t>(s.width) * s.height] = derivative(grey(x, y - 1), grey(x, y + 1));
    return;
  }
  const int centre = grey(x, y);
  uint64_t bits = 0;
  int bit = 0;
  for (int dy = -3; dy <= 3; ++dy)
    for (int dx = -3; dx <= 3; ++dx)
      if (dx != 0 || dy != 0) bits |= static_cast<uint64_t>(grey(x + dx, y + dy) < centre) << bit++;
  f.census[at] = bits;
}

// --- column_sums

template <int kCost>
struct PixelCost;

template <>
struct PixelCost<kGradient> {
  int x, y;
  __device__ PixelCost(const Features& f, size_t at, size_t plane, int) : x(f.bytes[at]), y(f.bytes[at + plane]) {}
  __device__ int against(const Features& f, size_t at, size_t plane) const {
    return (abs(x - f.bytes[at]) + abs(y - f.bytes[at + plane]) + 1) >> 1;
  }
};

template <>
struct PixelCost<kCensus> {
  uint64_t bits;
  __device__ PixelCost(const Features& f, size_t at, size_t, int) : bits(f.census[at]) {}
  __device__ int against(const Features& f, size_t at, size_t) const { return __popcll(bits ^ f.census[at]); }
};

template <bool kSquared>
struct ChannelCost {
  int of[3] = {}, channels;
  __device__ ChannelCost(const Features& f, size_t at, size_t plane, int channels_) : channels(channels_) {
    for (int c = 0; c < 3; ++c)
      if (c < channels) of[c] = f.pixels[at + c * plane];
  }
  __device__ int against(const Features& f, size_t at, size_t plane) const {
    int sum = 0;
    for (int c = 0; c < 3; ++c)
      if (c < channels) {
        const int differ = of[c] - f.pixels[at + c * plane];
        sum += kSquared ? differ * differ : abs(differ);
      }
    return sum;
  }
};
template <>
struct PixelCost<kSsd> : ChannelCost<true> {
  using ChannelCost<true>::ChannelCost;
};
template <>
struct PixelCost<kSad> : ChannelCost<false> {
  using ChannelCost<false>::ChannelCost;
};

/// Sums of a group as they lie in the volume. Narrow: four bytes, where all column sums fit them; wide: of disparities
/// 0 and 2, then of 1 and 3. Pairs is the latter, for both.
struct Pairs {
  uint32_t even, odd;
};
__device__ inline Pairs operator+(const Pairs& a, const Pairs& b) { return {a.even + b.even, a.odd + b.odd}; }
__device__ inline Pairs operator-(const Pairs& a, const Pairs& b) { return {a.even - b.even, a.odd - b.odd}; }

struct Narrow {
  using Word = uint32_t;
  __device__ static Word pack(const uint32_t (&of)[kGroup]) { return of[0] | of[1] << 8 | of[2] << 16 | of[3] << 24; }
  __device__ static Word next(Word sums, Word leaves, Word enters) {
    return sums - leaves + enters;
  }  // no byte borrows or carries
  __device__ static Pairs pairs(Word word) { return {word & 0x00FF00FF, word >> 8 & 0x00FF00FF}; }
};
struct Wide {
  using Word = uint2;
  __device__ static Word pack(const uint32_t (&of)[kGroup]) { return {of[0] | of[2] << 16, of[1] | of[3] << 16}; }
  __device__ static Word next(Word sums, Word leaves, Word enters) {
    return {sums.x - leaves.x + enters.x, sums.y - leaves.y + enters.y};
  }
  __device__ static Pairs pairs(Word word) { return {word.x, word.y}; }
};

/// What is the same for all rows of a thread of column_sums: a group of one column.
struct Group {
  Features reference, other;
  size_t plane;
  int channels, c_max, x, first;
  int inside;  ///< so many of its disparities are searched, and have their other pixel in the image
};

/// Costs against one pixel of the reference; c_max beyond what is inside, which then wins nothing. kStep -1: the other
/// pixel lies to the left (the left image is the reference), 1: to the right.
template <int kCost, class Lanes, int kStep>
struct GroupCosts {
  __device__ static typename Lanes::Word at(const Group& g, size_t row) {
    const PixelCost<kCost> pixel(g.reference, row + g.x, g.plane, g.channels);
    uint32_t cost[kGroup];
    for (int i = 0; i < kGroup; ++i)
      cost[i] = static_cast<uint32_t>(
          i < g.inside ? min(pixel.against(g.other, row + g.x + kStep * (g.first + i), g.plane), g.c_max) : g.c_max);
    return Lanes::pack(cost);
  }
};

/// The four bytes from there on; around each plane there are as many that nobody owns.
__device__ inline uint32_t four_from(const uint8_t* at) {
  const auto address = reinterpret_cast<uintptr_t>(at);
  const auto* words = reinterpret_cast<const uint32_t*>(address & ~uintptr_t{3});
  return __funnelshift_r(words[0], words[1], 8 * static_cast<uint32_t>(address & 3));
}

template <int kStep>
struct GroupCosts<kGradient, Narrow, kStep> {
  __device__ static uint32_t at(const Group& g, size_t row) {
    const uint32_t limit = static_cast<uint32_t>(g.c_max) * 0x01010101U;
    if (g.inside <= 0) return limit;
    const uint32_t cost = __vminu4(__vavgu4(differences(g, row), differences(g, row + g.plane)), limit);
    const uint32_t mask = g.inside >= kGroup ? 0xFFFFFFFF : (1U << 8 * g.inside) - 1;
    return (cost & mask) | (limit & ~mask);
  }
  __device__ static uint32_t differences(const Group& g, size_t row) {
    const uint8_t *pixel = g.reference.bytes + row + g.x, *other = g.other.bytes + row + g.x + kStep * g.first;
    const uint32_t four = kStep < 0 ? __byte_perm(four_from(other - 3), 0, 0x0123) : four_from(other);
    return __vabsdiffu4(*pixel * 0x01010101U, four);
  }
};

/// A thread has one group of one column, and goes down kStrip rows; its last n_square costs lie in shared memory.
template <int kCost, class Lanes, int kStep>
__global__ void column_sums(Work w) {
  using Word = typename Lanes::Word;
  const StereoShape& s = w.shape;
  const int index = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x), x = index / w.groups,
            first = kGroup * (index - x * w.groups);
  const int disparities = w.call->disparities, radius = s.n_square / 2;
  if (x >= s.width || first >= disparities) return;
  const Group group{kStep < 0 ? w.left : w.right,
                    kStep < 0 ? w.right : w.left,
                    static_cast<size_t>(s.width) * s.height,
                    s.channels,
                    s.c_max,
                    x,
                    first,
                    min(disparities, kStep < 0 ? x + 1 : s.width - x) - first};
  const auto costs = [&](int y) {
    return GroupCosts<kCost, Lanes, kStep>::at(group, static_cast<size_t>(clamp_to(y, s.height)) * s.width);
  };
  const int top = static_cast<int>(blockIdx.y) * kStrip, bottom = min(top + kStrip, s.height);
  extern __shared__ uint64_t shared[];
  Word* const ring = reinterpret_cast<Word*>(shared) + threadIdx.x;
  Word sums{};
  for (int i = 0; i < s.n_square; ++i) {
    const Word cost = costs(top - radius + i);
    ring[i * blockDim.x] = cost;
    sums = Lanes::next(sums, {}, cost);
  }
  const size_t row = static_cast<size_t>(s.width) * w.groups;
  auto* out = static_cast<Word*>(w.volume) + top * row + index;
  *out = sums;
  for (int y = top + 1, oldest = 0; y < bottom; ++y, oldest = oldest + 1 == s.n_square ? 0 : oldest + 1) {
    const Word enters = costs(y + radius), leaves = ring[oldest * blockDim.x];
    ring[oldest * blockDim.x] = enters;
    *(out += row) = sums = Lanes::next(sums, leaves, enters);
  }
}

// --- decide

/// The groups of one lane of a warp that decides a pixel: lane, lane + 32, ...
template <int kWords>
struct LaneSums {
  Pairs of[kWords];
  int first[kWords], within[kWords];  ///< of each word the first disparity, and how many from there on are searched

  /// Words that are not searched have a sum that never wins, and never get another one.
  __device__ LaneSums(int lane, int disparities) {
#pragma unroll
    for (int k = 0; k < kWords; ++k) {
      first[k] = kGroup * (lane + kWarp * k);
      within[k] = disparities - first[k];
      of[k] = within[k] > 0 ? Pairs{} : Pairs{0xFFFFFFFF, 0xFFFFFFFF};
    }
  }
  /// The smallest key, without fraction. What a word has beyond the search has the largest sum of all.
  __device__ uint32_t smallest() const {
    uint32_t best = kNoKey;
#pragma unroll
    for (int k = 0; k < kWords; ++k) {
      const uint32_t low = static_cast<uint32_t>(first[k]) << 7;
      constexpr uint32_t kLowHalf = 0x1054, kHighHalf = 0x3254;  // of a pair, above the disparity
      best = min(best, __byte_perm(of[k].even, low, kLowHalf));
      best = min(best, __byte_perm(of[k].odd, low + (1 << 7), kLowHalf));
      best = min(best, __byte_perm(of[k].even, low + (2 << 7), kHighHalf));
      best = min(best, __byte_perm(of[k].odd, low + (3 << 7), kHighHalf));
    }
    return best;
  }
  /// `body(disparity, sum)` for each that is searched.
  template <class Body>
  __device__ void each(Body body) const {
#pragma unroll
    for (int k = 0; k < kWords; ++k) {
      if (within[k] > 0) body(first[k], of[k].even & 0xFFFF);
      if (within[k] > 1) body(first[k] + 1, of[k].odd & 0xFFFF);
      if (within[k] > 2) body(first[k] + 2, of[k].even >> 16);
      if (within[k] > 3) body(first[k] + 3, of[k].odd >> 16);
    }
  }
};

/// With fraction and ambiguity; `most` stands for the second best where there is none. All lanes of the warp.
template <int kWords>
__device__ inline uint32_t finished(uint32_t key, const LaneSums<kWords>& sums, const StereoShape& s, int disparities,
                                    uint32_t most) {
  if (!s.subpixel && s.uniqueness == 0) return key | kNoFraction << 1;
  const int winner = static_cast<int>(key >> 7 & 511), best = static_cast<int>(key >> 16);
  uint32_t second = most, before = kNoKey, after = kNoKey;
  sums.each([&](int disparity, uint32_t sum) {
    if (disparity == winner - 1) before = sum;
    if (disparity == winner + 1) after = sum;
    if (abs(disparity - winner) > 1) second = min(second, sum);
  });
  int fraction = kNoFraction;
  if (s.subpixel && winner > 0 && winner + 1 < disparities)
    fraction = stereo::fraction_of(static_cast<int>(warp_min(before)), best, static_cast<int>(warp_min(after)));
  bool ambiguous = false;
  if (s.uniqueness > 0) {
    second = warp_min(second);
    ambiguous = (static_cast<int64_t>(second) - best) * 256 <= static_cast<int64_t>(s.uniqueness) * second;
  }
  return key | static_cast<uint32_t>(fraction) << 1 | (ambiguous ? 1U : 0U);
}

/// A warp has kRun pixels of a row; its lanes have the disparities.
template <class Lanes, int kWords>
__global__ void decide(Work w) {
  const StereoShape& s = w.shape;
  const int lane = static_cast<int>(threadIdx.x) % kWarp, disparities = w.call->disparities;
  const int run = static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / kWarp), runs = (s.width + kRun - 1) / kRun;
  const int y = run / runs, begin = (run - y * runs) * kRun, radius = s.n_square / 2;
  if (y >= s.height) return;
  const auto* row = static_cast<const typename Lanes::Word*>(w.volume) + static_cast<size_t>(y) * s.width * w.groups;
  LaneSums<kWords> sums(lane, disparities);
  const auto column = [&](int x, int k) -> Pairs {
    if (sums.within[k] <= 0) return {};
    return Lanes::pairs(row[static_cast<size_t>(clamp_to(x, s.width)) * w.groups + lane + kWarp * k]);
  };
  for (int x = begin - radius; x <= begin + radius; ++x)
#pragma unroll
    for (int k = 0; k < kWords; ++k) sums.of[k] = sums.of[k] + column(x, k);
  uint32_t mine = kNoKey;
  const int end = min(begin + kRun, s.width);
  for (int x = begin; x < end; ++x) {
    const uint32_t key = finished(warp_min(sums.smallest()), sums, s, disparities, 65535);
    if (lane == x - begin) mine = key;
#pragma unroll
    for (int k = 0; k < kWords; ++k) sums.of[k] = sums.of[k] - column(x - radius, k) + column(x + radius + 1, k);
  }
  if (begin + lane < end) w.keys[static_cast<size_t>(y) * s.width + begin + lane] = mine;
}

// --- filter, write

__global__ void filter(Work w, bool of_right) {
  __shared__ uint32_t near[kFilterHeight + 2 * kMostRadius][kFilterWidth + 2 * kMostRadius],
      along[kFilterHeight + 2 * kMostRadius][kFilterWidth];
  const StereoShape& s = w.shape;
  const int r = s.n_min / 2, left = static_cast<int>(blockIdx.x) * kFilterWidth,
            top = static_cast<int>(blockIdx.y) * kFilterHeight;
  const int tx = static_cast<int>(threadIdx.x), ty = static_cast<int>(threadIdx.y);
  for (int row = ty; row < kFilterHeight + 2 * r; row += kFilterHeight)
    for (int column = tx; column < kFilterWidth + 2 * r; column += kFilterWidth) {
      const int x = left + column - r, y = top + row - r;
      near[row][column] =
          x < 0 || y < 0 || x >= s.width || y >= s.height ? kNoKey : w.keys[static_cast<size_t>(y) * s.width + x];
    }
  __syncthreads();
  for (int row = ty; row < kFilterHeight + 2 * r; row += kFilterHeight) {
    uint32_t least = kNoKey;
    for (int i = 0; i <= 2 * r; ++i) least = min(least, near[row][tx + i]);
    along[row][tx] = least;
  }
  __syncthreads();
  const int x = left + tx, y = top + ty;
  if (x >= s.width || y >= s.height) return;
  uint32_t least = kNoKey;
  for (int i = 0; i <= 2 * r; ++i) least = min(least, along[ty + i][tx]);
  (of_right ? w.right_keys : w.left_keys)[static_cast<size_t>(y) * s.width + x] = least;
}

__device__ inline void sort_two(int& a, int& b) {
  const int low = min(a, b);
  b = max(a, b);
  a = low;
}

/// Disparity and fraction of the median of nine.
__device__ inline int median_fine(const uint32_t* keys, const StereoShape& s, int x, int y) {
  int nine[9], n = 0;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      nine[n++] = static_cast<int>(
          (keys[static_cast<size_t>(clamp_to(y + dy, s.height)) * s.width + clamp_to(x + dx, s.width)] & 0xFFFF) >> 1);
#pragma unroll
  for (int low = 0; low < 5; ++low)  // five passes of a selection sort
#pragma unroll
    for (int i = low + 1; i < 9; ++i) sort_two(nine[low], nine[i]);
  return nine[4];
}

__global__ void write(Work w) {
  if (*w.withdrawn) return;
  const StereoShape& s = w.shape;
  const StereoCall& call = *w.call;
  const int x = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x), y = static_cast<int>(blockIdx.y);
  if (x >= s.width) return;
  const uint32_t key = w.left_keys[static_cast<size_t>(y) * s.width + x];
  const int fine = s.median ? median_fine(w.left_keys, s, x, y) : static_cast<int>((key & 0xFFFF) >> 1);
  const int most = s.semi_global ? 3 * (s.c_max + call.p2) : s.c_max * s.n_square * s.n_square;
  const int disparity = fine / kFractions, sum = static_cast<int>(key >> 16);
  const uint8_t confidence = stereo::confidence_of(sum, most);
  bool keep = confidence >= call.min_confidence && (key & 1) == 0;
  if (keep && s.left_right_check) {
    const int xr = x - disparity;
    keep = xr >= 0 &&
           abs(static_cast<int>(w.right_keys[static_cast<size_t>(y) * s.width + xr] >> 7 & 511) - disparity) <= 1;
  }
  call.disparity[y * call.disparity_stride + x] = static_cast<int16_t>(keep ? disparity : -1);
  call.confidence[y * call.confidence_stride + x] = confidence;
  if (call.fraction != nullptr) call.fraction[y * call.fraction_stride + x] = static_cast<uint8_t>(fine % kFractions);
}

}  // namespace takt::cuda
