// SPDX-License-Identifier: Apache-2.0
// Internal: semi-global matching of the census cost, bit for bit as stereo::reference::semi_global.
//
//   paths         the cheapest paths to each pixel from the left, the right and above: a volume of bytes each
//   decide_paths  their sums, winner, fraction, ambiguity: a key for each pixel (on_card_windows.cuh)
#pragma once
#include "nodes/stereo/on_card_windows.cuh"

namespace takt::cuda {

constexpr int kPaths = 3;
constexpr int kUnsearched = 85;  // of one path: the sum of three is no less than any that problem() allows

/// A warp goes along a row, back along one, or down a column. Its lanes have the disparities lane, lane + 32, ...
template <int kSlots, int kStep>
__global__ void paths(Work w) {
  constexpr int kNever = 1 << 14;
  const StereoShape& s = w.shape;
  const int lane = static_cast<int>(threadIdx.x) % kWarp, disparities = w.call->disparities, p1 = w.call->p1,
            p2 = w.call->p2;
  int line = static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / kWarp);
  if (line >= 2 * s.height + s.width) return;
  const int path_kind = line < s.height ? 0 : line < 2 * s.height ? 1 : 2;
  line -= path_kind * s.height;
  const Features &reference = kStep < 0 ? w.left : w.right, &other = kStep < 0 ? w.right : w.left;
  const size_t depth = static_cast<size_t>(w.groups) * kGroup, pixels = static_cast<size_t>(s.width) * s.height;
  auto* volume = static_cast<uint8_t*>(w.volume) + path_kind * pixels * depth;
  const int count = path_kind == 2 ? s.height : s.width;
  int path[kSlots] = {}, least = 0;
  for (int i = 0; i < count; ++i) {
    const int x = path_kind == 0 ? i : path_kind == 1 ? s.width - 1 - i : line, y = path_kind == 2 ? i : line;
    const size_t row = static_cast<size_t>(y) * s.width;
    const uint64_t bits = reference.census[row + x];
    int lower[kSlots], upper[kSlots];
#pragma unroll
    for (int j = 0; j < kSlots; ++j) {
      lower[j] = __shfl_sync(0xFFFFFFFF, path[j], (lane + kWarp - 1) % kWarp);
      upper[j] = __shfl_sync(0xFFFFFFFF, path[j], (lane + 1) % kWarp);
    }
    int smallest = kNever;
    uint8_t* to = volume + (row + x) * depth;
#pragma unroll
    for (int j = 0; j < kSlots; ++j) {
      const int disparity = lane + kWarp * j, at = x + kStep * disparity;
      const int before = lane > 0 ? lower[j] : j > 0 ? lower[j - 1] : kNever;
      const int after = lane + 1 < kWarp ? upper[j] : j + 1 < kSlots ? upper[j + 1] : kNever;
      const int cost = at < 0 || at >= s.width ? s.c_max : min(__popcll(bits ^ other.census[row + at]), s.c_max);
      const int way = min(min(path[j], least + p2), min(before, after) + p1);
      const bool searched = disparity < disparities;
      path[j] = searched ? cost + way - least : kNever;
      smallest = min(smallest, path[j]);
      if (disparity < static_cast<int>(depth)) to[disparity] = static_cast<uint8_t>(searched ? path[j] : kUnsearched);
    }
    least = static_cast<int>(warp_min(static_cast<uint32_t>(smallest)));
  }
}

template <int kWords>
__global__ void decide_paths(Work w) {
  const StereoShape& s = w.shape;
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  const auto first = static_cast<size_t>((blockIdx.x * blockDim.x + threadIdx.x) / kWarp) * kRun,
             pixels = static_cast<size_t>(s.width) * s.height;
  const auto* volume = static_cast<const uint32_t*>(w.volume);
  const size_t path = pixels * w.groups;
  LaneSums<kWords> sums(lane, w.call->disparities);
  uint32_t mine = kNoKey;
  for (int i = 0; i < kRun && first + i < pixels; ++i) {
    const uint32_t* at = volume + (first + i) * w.groups + lane;
#pragma unroll
    for (int k = 0; k < kWords; ++k)
      if (sums.within[k] > 0)
        sums.of[k] = Narrow::pairs(at[kWarp * k] + at[path + kWarp * k] + at[2 * path + kWarp * k]);
    const uint32_t key =
        finished(warp_min(sums.smallest()), sums, s, w.call->disparities, kPaths * (s.c_max + w.call->p2));
    if (lane == i) mine = key;
  }
  if (first + lane < pixels) w.keys[first + lane] = mine;
}

}  // namespace takt::cuda
