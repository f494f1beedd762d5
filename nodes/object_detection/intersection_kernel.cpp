// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/intersection_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/object_detection/intersection_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::object_detection::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class Count>
HWY_INLINE void Missing(const Count* window, const Count* rows, size_t bins, size_t references, Count* out) {
  const hn::CappedTag<Count, kLaneBlock> d;
  const size_t lanes = hn::Lanes(d);
  HWY_ALIGN Count partial[kLaneBlock];
  for (size_t r = 0; r < references; ++r, rows += bins) {
    auto sum = hn::Zero(d);
    for (size_t i = 0; i < bins; i += lanes) {
      const auto reference = hn::LoadU(d, rows + i), present = hn::LoadU(d, window + i);
      if constexpr (sizeof(Count) == 2) sum = hn::Add(sum, hn::SaturatedSub(reference, present));
      else sum = hn::Add(sum, hn::Sub(reference, hn::Min(reference, present)));
    }
    hn::Store(sum, d, partial);
    uint32_t total = 0;
    for (size_t i = 0; i < lanes; ++i) total += partial[i];
    out[r] = static_cast<Count>(total);
  }
}

void Missing16(const uint16_t* window, const uint16_t* rows, size_t bins, size_t references, uint16_t* out) {
  Missing(window, rows, bins, references, out);
}

void Missing32(const uint32_t* window, const uint32_t* rows, size_t bins, size_t references, uint32_t* out) {
  Missing(window, rows, bins, references, out);
}

}  // namespace takt::object_detection::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::object_detection {

HWY_EXPORT(Missing16);
HWY_EXPORT(Missing32);

void missing_masses(const uint16_t* window, const uint16_t* reference_rows, size_t bins, size_t references,
                    uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(Missing16)(window, reference_rows, bins, references, out);
}

void missing_masses(const uint32_t* window, const uint32_t* reference_rows, size_t bins, size_t references,
                    uint32_t* out) {
  HWY_DYNAMIC_DISPATCH(Missing32)(window, reference_rows, bins, references, out);
}

}  // namespace takt::object_detection
#endif
