// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/block_kernel.hpp"

#include <algorithm>
#include <array>

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/ego_motion/block_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::ego_motion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<uint8_t> kBytes;
constexpr hn::ScalableTag<uint64_t> kKeys;
constexpr int kByteLanes = static_cast<int>(hn::MaxLanes(kBytes));
constexpr int kKeyLanes = static_cast<int>(hn::MaxLanes(kKeys));
using Bytes = hn::Vec<decltype(kBytes)>;
using Keys = hn::Vec<decltype(kKeys)>;
constexpr uint8_t kNothing = 0x80;  // as a place in a table: zero

/// Sum of |a - b| over each group of eight bytes.
HWY_INLINE Keys distance_of_8(Bytes a, Bytes b) {
#if HWY_TARGET == HWY_AVX3
  return Keys{_mm512_sad_epu8(a.raw, b.raw)};
#elif HWY_TARGET == HWY_AVX2
  return Keys{_mm256_sad_epu8(a.raw, b.raw)};
#elif HWY_TARGET == HWY_SSE4
  return Keys{_mm_sad_epu8(a.raw, b.raw)};
#else
  return hn::SumsOf8(hn::Sub(hn::Max(a, b), hn::Min(a, b)));
#endif
}

/// A vector holds neighbouring positions of the block: one for each eight bytes if its rows fit in there (narrow), else
/// one for each sixteen. All of them are cut from the same 16 bytes of the image.
struct Layout {
  alignas(64) uint8_t pixels[kByteLanes];  ///< place among the 16 bytes
  alignas(64) uint8_t means[kByteLanes];   ///< the position's number, where it has a pixel
  alignas(64) uint64_t number[kKeyLanes];  ///< the position's, or all ones where there is none
  int positions;
};

constexpr Layout layout(int half) {
  const bool narrow = half <= Patch::kNarrowHalf;
  const int size = 2 * half + 1, room = narrow ? 8 : 16, keys = room / 8;
  Layout l{};
  l.positions = std::min(kByteLanes / room, 16 - size + 1);
  for (int i = 0; i < kByteLanes; ++i) {
    const int position = i / room, column = i % room;
    const bool used = position < l.positions && column < size;
    l.pixels[i] = used ? static_cast<uint8_t>(position + column) : kNothing;
    l.means[i] = used ? static_cast<uint8_t>(position) : kNothing;
  }
  for (int k = 0; k < kKeyLanes; ++k) {
    const int position = k / keys;
    l.number[k] = k % keys == 0 && position < l.positions ? static_cast<uint64_t>(position) : ~uint64_t{0};
  }
  return l;
}

template <bool kNarrow>
HWY_INLINE BlockMatch Search(const Patch& patch, const Level& level, const SearchWindow& w, const Layout& l) {
  const Bytes pixels = hn::Load(kBytes, l.pixels), means = hn::Load(kBytes, l.means);
  const Keys number = hn::Load(kKeys, l.number);
  const Bytes own_mean = hn::TableLookupBytesOr0(hn::Set(kBytes, patch.mean), means);
  const int half = patch.half, size = 2 * half + 1;
  const ptrdiff_t stride = level.image.stride();
  Keys best = hn::Set(kKeys, ~uint64_t{0});
  uint64_t row_first = 0;  // number of the first position of a row
  for (int y = w.top; y <= w.bottom; ++y, row_first += static_cast<uint64_t>(w.right - w.left + 1))
    for (int x = w.left; x <= w.right; x += l.positions) {
      const Bytes there = hn::TableLookupBytesOr0(hn::LoadDup128(kBytes, level.mean.row(y) + x), means);
      const Bytes brighter = hn::SaturatedSub(there, own_mean), darker = hn::SaturatedSub(own_mean, there);
      const uint8_t* row = level.image.row(y - half) + x - half;
      Keys sum = hn::Zero(kKeys);
      for (int v = 0; v < size; ++v, row += stride) {
        const Bytes image = hn::TableLookupBytesOr0(hn::LoadDup128(kBytes, row), pixels);
        const Bytes own = hn::LoadDup128(kBytes, patch.values[v]);
        sum = hn::Add(sum, distance_of_8(hn::SaturatedSub(hn::SaturatedAdd(own, brighter), darker), image));
      }
      if constexpr (!kNarrow) sum = hn::Add(sum, hn::Shuffle01(sum));
      // Cost and number of the position: one minimum finds both, the first of equal costs.
      const auto outside = hn::Gt(number, hn::Set(kKeys, static_cast<uint64_t>(w.right - x)));
      const Keys at = hn::Add(number, hn::Set(kKeys, row_first + static_cast<uint64_t>(x - w.left)));
      const Keys key = hn::Add(hn::ShiftLeft<32>(sum), at);
      best = hn::Min(best, hn::IfThenElse(outside, best, key));
    }
  HWY_ALIGN uint64_t lanes[kKeyLanes];
  hn::Store(best, kKeys, lanes);
  const uint64_t least = *std::min_element(lanes, lanes + kKeyLanes);
  const int columns = w.right - w.left + 1, index = static_cast<int>(least & 0xFFFFFFFF);
  return {w.left + index % columns, w.top + index / columns, static_cast<uint32_t>(least >> 32)};
}

BlockMatch Blocks(const Patch& patch, const Level& level, const SearchWindow& window) {
  static constexpr std::array<Layout, Patch::kMaximumHalf + 1> kLayouts{layout(0), layout(1), layout(2), layout(3),
                                                                        layout(4), layout(5), layout(6), layout(7)};
  const Layout& l = kLayouts[static_cast<size_t>(patch.half)];
  return patch.half <= Patch::kNarrowHalf ? Search<true>(patch, level, window, l)
                                          : Search<false>(patch, level, window, l);
}

}  // namespace takt::ego_motion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::ego_motion {
HWY_EXPORT(Blocks);
BlockMatch search_blocks(const Patch& patch, const Level& level, const SearchWindow& window) {
  return HWY_DYNAMIC_DISPATCH(Blocks)(patch, level, window);
}
}  // namespace takt::ego_motion
#endif
