// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/cooccurrence_kernel.hpp"

#include <algorithm>
#include <bit>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/object_detection/cooccurrence_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::object_detection::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<uint8_t, kPixelBlock> kBytes;
constexpr hn::Repartition<uint64_t, decltype(kBytes)> kSums;

void RunLengths(const uint8_t* row, uint8_t colour, size_t width, int widest, uint8_t* out) {
  const auto wanted = hn::Set(kBytes, colour);
  const auto is = [&](const uint8_t* at) HWY_ATTR {
    return hn::VecFromMask(kBytes, hn::Eq(hn::LoadU(kBytes, at), wanted));  // -1 where it is
  };
  for (size_t x = 0; x < width; x += hn::Lanes(kBytes)) {
    auto length = hn::Sub(hn::Zero(kBytes), is(row + x));
    hn::StoreU(length, kBytes, out + x);
    for (int w = 1; w <= widest; ++w) {
      length = hn::Sub(hn::Sub(length, is(row + x - w)), is(row + x + w));
      hn::StoreU(length, kBytes, out + static_cast<size_t>(w) * width + x);
    }
  }
}

void AddRings(const RingRow& row, uint64_t* sums) {
  const auto b = hn::Set(kBytes, row.b), one = hn::Set(kBytes, 1);
  for (size_t x = 0; x < row.width; x += hn::Lanes(kBytes)) {
    const auto own = hn::LoadU(kBytes, row.colours + x);
    const size_t* run = row.run_of;
    auto disc = hn::Zero(kBytes);
    for (int k = 1; k <= row.distances; ++k) {
      const auto smaller = disc;
      disc = hn::Zero(kBytes);
      const int rows = std::min(k, row.below);
      for (int dy = 0; dy < rows; ++dy) disc = hn::Add(disc, hn::LoadU(kBytes, row.runs + run[dy] + x));
      run += k;
      const auto right = hn::IfThenElseZero(hn::Eq(hn::LoadU(kBytes, row.colours + x + k), b), one);
      const auto ring = hn::Add(hn::Sub(disc, smaller), right);
      for (uint32_t left = row.present; left != 0; left &= left - 1) {
        const int a = std::countr_zero(left);
        uint64_t* sum = sums + static_cast<size_t>(a * row.distances + k - 1) * kPartialSums;
        const auto of_a = hn::IfThenElseZero(hn::Eq(own, hn::Set(kBytes, static_cast<uint8_t>(a))), ring);
        hn::StoreU(hn::Add(hn::LoadU(kSums, sum), hn::SumsOf8(of_a)), kSums, sum);
      }
    }
  }
}

}  // namespace takt::object_detection::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::object_detection {

HWY_EXPORT(RunLengths);
HWY_EXPORT(AddRings);

void run_lengths(const uint8_t* row, uint8_t colour, size_t width, int widest, uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(RunLengths)(row, colour, width, widest, out);
}

void add_rings(const RingRow& row, uint64_t* sums) { HWY_DYNAMIC_DISPATCH(AddRings)(row, sums); }

}  // namespace takt::object_detection
#endif
