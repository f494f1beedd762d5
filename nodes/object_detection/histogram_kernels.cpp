// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/histogram_kernels.hpp"

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/object_detection/histogram_kernels.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::object_detection::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<uint16_t, kLaneBlock> kCounts;
constexpr hn::CappedTag<uint32_t, kLaneBlock> kSums;
constexpr hn::CappedTag<uint8_t, kByteBlock> kBytes;
constexpr hn::Repartition<uint64_t, decltype(kBytes)> kByteSums;
using Bytes = hn::Vec<decltype(kBytes)>;

void Add(uint16_t* counts, const uint16_t* come, size_t size) {
  for (size_t i = 0; i < size; i += hn::Lanes(kCounts))
    hn::StoreU(hn::Add(hn::LoadU(kCounts, counts + i), hn::LoadU(kCounts, come + i)), kCounts, counts + i);
}

void Subtract(uint16_t* counts, const uint16_t* gone, size_t size) {
  for (size_t i = 0; i < size; i += hn::Lanes(kCounts))
    hn::StoreU(hn::Sub(hn::LoadU(kCounts, counts + i), hn::LoadU(kCounts, gone + i)), kCounts, counts + i);
}

void Saturate(const uint16_t* counts, uint8_t* bytes, size_t size) {
  const hn::RebindToSigned<decltype(kCounts)> numbers;
  const hn::Rebind<uint8_t, decltype(kCounts)> half;
  const auto most = hn::Set(kCounts, UINT8_MAX);
  for (size_t i = 0; i < size; i += hn::Lanes(kCounts))
    hn::StoreU(hn::DemoteTo(half, hn::BitCast(numbers, hn::Min(most, hn::LoadU(kCounts, counts + i)))), half,
               bytes + i);
}

void Missing32(const uint32_t* window, const uint32_t* rows, size_t bins, size_t references, uint32_t* out) {
  for (size_t r = 0; r < references; ++r, rows += bins) {
    auto sum = hn::Zero(kSums);
    for (size_t i = 0; i < bins; i += hn::Lanes(kSums)) {
      const auto reference = hn::LoadU(kSums, rows + i), present = hn::LoadU(kSums, window + i);
      sum = hn::Add(sum, hn::Sub(reference, hn::Min(reference, present)));
    }
    out[r] = hn::GetLane(hn::SumOfLanes(kSums, sum));
  }
}

/// What one reference lacks.
class MissingBytes {
 public:
  HWY_INLINE MissingBytes() : sum_(hn::Zero(kByteSums)) {}
  HWY_INLINE void add(const uint8_t* reference, Bytes present) {
    sum_ = hn::Add(sum_, hn::SumsOf8(hn::SaturatedSub(hn::LoadU(kBytes, reference), present)));
  }
  HWY_INLINE uint16_t total() const { return static_cast<uint16_t>(hn::GetLane(hn::SumOfLanes(kByteSums, sum_))); }

 private:
  hn::Vec<decltype(kByteSums)> sum_;
};

/// Four references at once: what is loaded of the window serves them all.
void Missing8(const uint8_t* window, const size_t* blocks, size_t count, const uint8_t* rows, size_t references,
              uint16_t* out) {
  const size_t bins = count * kByteBlock;
  size_t r = 0;
  for (; r + 4 <= references; r += 4, rows += 4 * bins) {
    MissingBytes a, b, c, d;
    for (size_t i = 0; i < bins; i += hn::Lanes(kBytes)) {
      const Bytes present = hn::LoadU(kBytes, window + blocks[i / kByteBlock] + i % kByteBlock);
      a.add(rows + i, present);
      b.add(rows + bins + i, present);
      c.add(rows + 2 * bins + i, present);
      d.add(rows + 3 * bins + i, present);
    }
    out[r] = a.total();
    out[r + 1] = b.total();
    out[r + 2] = c.total();
    out[r + 3] = d.total();
  }
  for (; r < references; ++r, rows += bins) {
    MissingBytes missing;
    for (size_t i = 0; i < bins; i += hn::Lanes(kBytes))
      missing.add(rows + i, hn::LoadU(kBytes, window + blocks[i / kByteBlock] + i % kByteBlock));
    out[r] = missing.total();
  }
}

}  // namespace takt::object_detection::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::object_detection {

HWY_EXPORT(Add);
HWY_EXPORT(Subtract);
HWY_EXPORT(Saturate);
HWY_EXPORT(Missing32);
HWY_EXPORT(Missing8);

void add_counts(uint16_t* counts, const uint16_t* come, size_t slots) {
  HWY_DYNAMIC_DISPATCH(Add)(counts, come, slots);
}

void subtract_counts(uint16_t* counts, const uint16_t* gone, size_t slots) {
  HWY_DYNAMIC_DISPATCH(Subtract)(counts, gone, slots);
}

void saturate_counts(std::span<const uint16_t> counts, uint8_t* bytes) {
  HWY_DYNAMIC_DISPATCH(Saturate)(counts.data(), bytes, counts.size());
}

void missing_masses(const uint32_t* window, const uint32_t* reference_rows, size_t bins, size_t references,
                    uint32_t* out) {
  HWY_DYNAMIC_DISPATCH(Missing32)(window, reference_rows, bins, references, out);
}

void missing_masses(const uint8_t* window, std::span<const size_t> blocks, const uint8_t* reference_rows,
                    size_t references, uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(Missing8)(window, blocks.data(), blocks.size(), reference_rows, references, out);
}

}  // namespace takt::object_detection
#endif
