// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/intersection_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/object_detection/intersection_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::object_detection::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void Missing(const uint16_t* window, const uint16_t* rows, size_t bins, size_t references, uint16_t* out) {
  const hn::CappedTag<uint16_t, kLaneBlock> d;
  const size_t lanes = hn::Lanes(d);
  HWY_ALIGN uint16_t partial[kLaneBlock];
  for (size_t r = 0; r < references; ++r, rows += bins) {
    auto sum = hn::Zero(d);
    for (size_t i = 0; i < bins; i += lanes)
      sum = hn::Add(sum, hn::SaturatedSub(hn::LoadU(d, rows + i), hn::LoadU(d, window + i)));
    hn::Store(sum, d, partial);
    uint32_t total = 0;
    for (size_t i = 0; i < lanes; ++i) total += partial[i];
    out[r] = static_cast<uint16_t>(total);
  }
}

}  // namespace takt::object_detection::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::object_detection {

HWY_EXPORT(Missing);

void missing_masses(const uint16_t* window, const uint16_t* reference_rows, size_t bins, size_t references,
                    uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(Missing)(window, reference_rows, bins, references, out);
}

}  // namespace takt::object_detection
#endif
