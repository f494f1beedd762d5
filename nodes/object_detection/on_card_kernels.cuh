// SPDX-License-Identifier: Apache-2.0
// Internal: colour co-occurrences of windows (thesis Sec. 3.4.2; R-6.4), exact numbers as CooccurrenceStage gives them.
//
//   colour_pixels  the colour of each pixel; empty histograms
//   count_pairs    a block counts the pairs of some rows of a window in its shared memory
//   compare        a block finds what each view of an object misses in a window
//   write          into the memory of the call
//
// In count_pairs each lane of a warp has offsets of its own, and bins in a bank of its own, whatever the colours are: a
// number for each pair of colours, in whose halves it counts one ring of distances each. Around a window there is no
// colour, which is one more row and column of its histogram.
#pragma once
#include <cstdint>

#include "nodes/cuda/pixels.cuh"
#include "nodes/object_detection/colour_bins.hpp"
#include "nodes/object_detection/cooccurrence_counter.hpp"
#include "nodes/object_detection/on_card_work.hpp"

namespace takt::cuda {

constexpr int kReach = 28;  // px beside a row, a multiple of 4 above the greatest distance
static_assert(kReach > object_detection::kMaxDistance);
constexpr int kCountingThreads = 512, kComparingThreads = 256;

__global__ void colour_pixels(CooccurrenceWork w) {
  const CooccurrenceCall& call = *w.call;
  const int first = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x),
            step = static_cast<int>(gridDim.x * blockDim.x), fours = (w.width + 3) / 4;
  for (int i = first; i < fours * w.height; i += step) {
    const int y = i / fours, x = 4 * (i - y * fours), count = min(4, w.width - x);
    const FourPixels four(call.bgr + y * call.stride + 3 * x, count, 3);
    for (int n = 0; n < count; ++n)
      w.colour[static_cast<size_t>(y) * w.width + x + n] =
          object_detection::pair_colour(four[n][0], four[n][1], four[n][2], w.colours);
  }
  const size_t bins = static_cast<size_t>(call.windows_count) * w.bins;
  for (auto i = static_cast<size_t>(first); i < bins; i += static_cast<size_t>(step)) w.counts[i] = 0;
}

/// Rows of a window in shared memory: one without colour, then they and those within reach below.
struct Band {
  uint8_t* none;
  uint8_t* first;
};

__device__ inline Band load_band(const CooccurrenceWork& w, const CardWindow& window, int y0, int rows, uint8_t* at) {
  const Band band{at, at + w.pitch};
  const auto none = static_cast<uint32_t>(w.colours) * 0x01010101u;
  auto* words = reinterpret_cast<uint32_t*>(at);
  const int all = (1 + rows + w.distances) * w.pitch / 4;
  for (int i = static_cast<int>(threadIdx.x); i < all; i += static_cast<int>(blockDim.x)) words[i] = none;
  __syncthreads();
  const int there = min(rows + w.distances, w.side - y0);
  for (int i = static_cast<int>(threadIdx.x); i < there * w.side; i += static_cast<int>(blockDim.x)) {
    const int y = i / w.side, x = i - y * w.side;
    band.first[y * w.pitch + kReach + x] = w.colour[static_cast<size_t>(window.y + y0 + y) * w.width + window.x + x];
  }
  return band;
}

/// One row of pixels, each with that at a lane's offset.
__device__ inline void count_row(const uint8_t* row, const uint8_t* other, int side, int colours, uint32_t one,
                                 uint32_t* lane_bins) {
  const auto at = reinterpret_cast<uintptr_t>(other);
  const auto* words = reinterpret_cast<const uint32_t*>(at & ~uintptr_t{3});
  const auto shift = static_cast<unsigned>(at & 3) * 8;
  uint32_t before = words[0];
  for (int x = 0; x < side; x += 4) {
    const uint32_t a = *reinterpret_cast<const uint32_t*>(row + x), next = words[x / 4 + 1],
                   b = __funnelshift_r(before, next, shift);
    before = next;
#pragma unroll
    for (int i = 0; i < 4; ++i) {
      const uint32_t bin = (a >> 8 * i & 255) * static_cast<uint32_t>(colours + 1) + (b >> 8 * i & 255);
      atomicAdd(lane_bins + bin * kLanes, one);
    }
  }
}

/// Of all lanes' bins into the histogram of the window.
__device__ inline void add_pairs(const CooccurrenceWork& w, const uint32_t* bins, uint32_t* counts) {
  const int colours = w.colours, all = colours * colours * w.distances;
  for (int i = static_cast<int>(threadIdx.x); i < all; i += static_cast<int>(blockDim.x)) {
    const int k = i % w.distances + 1, pair = i / w.distances, a = pair / colours, b = pair - a * colours;
    if (a > b) continue;
    const uint32_t *one = bins + (a * (colours + 1) + b) * kLanes, *other = bins + (b * (colours + 1) + a) * kLanes;
    uint32_t sum = 0;
    for (int s = w.first_share[k - 1]; s < w.first_share[k]; ++s) {
      const CardShare share = w.shares[s];
      const int shift = 16 * share.half;
      sum += one[share.lane] >> shift & 0xFFFF;
      if (a != b) sum += other[share.lane] >> shift & 0xFFFF;
    }
    if (sum > 0) atomicAdd(counts + object_detection::pair_bin(a, b, k, colours, w.distances), sum);
  }
}

__global__ void __launch_bounds__(kCountingThreads) count_pairs(CooccurrenceWork w) {
  extern __shared__ uint32_t bins[];
  const CooccurrenceCall& call = *w.call;
  const int windows = call.windows_count, lane = static_cast<int>(threadIdx.x) % kLanes,
            warp = static_cast<int>(threadIdx.x) / kLanes, warps = static_cast<int>(blockDim.x) / kLanes;
  if (windows == 0) return;
  // All blocks have something to do, if there are few windows.
  const int parts = max((w.side + w.rows - 1) / w.rows,
                        min((static_cast<int>(gridDim.x) + windows - 1) / windows, (w.side + 3) / 4)),
            rows = (w.side + parts - 1) / parts, all_bins = (w.colours + 1) * (w.colours + 1) * kLanes;
  auto* plane = reinterpret_cast<uint8_t*>(bins + all_bins);
  for (int task = static_cast<int>(blockIdx.x); task < windows * parts; task += static_cast<int>(gridDim.x)) {
    const int index = task / parts, y0 = (task - index * parts) * rows;
    if (y0 >= w.side) continue;
    for (int i = static_cast<int>(threadIdx.x); i < all_bins; i += static_cast<int>(blockDim.x)) bins[i] = 0;
    const Band band = load_band(w, call.windows[index], y0, min(rows, w.side - y0), plane);
    __syncthreads();
    for (int y = warp; y < rows && y0 + y < w.side; y += warps)
      for (int step = 0; step < w.steps; ++step) {
        const CardOffset offset = w.offsets[step * kLanes + lane];
        const bool there = y0 + y + offset.below < w.side;
        if (!__any_sync(0xFFFFFFFF, there)) break;
        const uint8_t* row = band.first + y * w.pitch + kReach;
        count_row(row, there ? row + offset.at : band.none, w.side, w.colours, 1u << 16 * offset.half, bins + lane);
      }
    __syncthreads();
    add_pairs(w, bins, w.counts + static_cast<size_t>(index) * w.bins);
    __syncthreads();
  }
}

/// A block has a window and an object.
__global__ void __launch_bounds__(kComparingThreads) compare(CooccurrenceWork w) {
  extern __shared__ uint32_t count[];
  const CooccurrenceCall& call = *w.call;
  const int lane = static_cast<int>(threadIdx.x) % kLanes, warp = static_cast<int>(threadIdx.x) / kLanes;
  for (int q = static_cast<int>(blockIdx.x); q < call.questions_count; q += static_cast<int>(gridDim.x)) {
    const CardReferences& object = w.objects[call.questions[q].object];
    const uint32_t* counts = w.counts + static_cast<size_t>(call.questions[q].window) * w.bins;
    const int used = object.colours;
    for (int i = static_cast<int>(threadIdx.x); i < used * used * w.distances; i += static_cast<int>(blockDim.x)) {
      const int k = i % w.distances + 1, b = i / w.distances % used, a = i / w.distances / used;
      if (a > b) continue;
      count[object_detection::pair_bin(a, b, k, used, w.distances)] = counts[object_detection::pair_bin(
          object.colour_of_slot[a], object.colour_of_slot[b], k, w.colours, w.distances)];
    }
    __syncthreads();
    for (int view = warp; view < object.views; view += static_cast<int>(blockDim.x) / kLanes) {
      const uint32_t* row = object.rows + static_cast<size_t>(view) * object.bins;
      uint32_t missing = 0;
      for (size_t i = static_cast<size_t>(lane); i < object.bins; i += kLanes)
        missing += row[i] > count[i] ? row[i] - count[i] : 0;
      for (int step = kLanes / 2; step > 0; step /= 2) missing += __shfl_xor_sync(0xFFFFFFFF, missing, step);
      if (lane == 0) w.found[static_cast<size_t>(q) * w.most_views + view] = missing;
    }
    __syncthreads();
  }
}

__global__ void write_missing(CooccurrenceWork w) {
  if (*w.withdrawn) return;
  const size_t count = static_cast<size_t>(w.call->questions_count) * w.most_views;
  for (size_t i = blockIdx.x * blockDim.x + threadIdx.x; i < count; i += gridDim.x * blockDim.x)
    w.call->missing[i] = w.found[i];
}

}  // namespace takt::cuda
