// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/count_kernel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/cloud/count_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::cloud::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// No fused multiply-add: the scalar reference has none.
void Decide(const Coordinates& p, const Run* runs, size_t run_count, Run queries, float radius2, uint32_t needed,
            uint8_t* pass) {
  const hn::ScalableTag<float> d;
  const uint32_t lanes = static_cast<uint32_t>(hn::Lanes(d));
  const auto limit = hn::Set(d, radius2);
  for (uint32_t q = queries.first; q < queries.last; ++q) {
    const auto qx = hn::Set(d, p.x[q]), qy = hn::Set(d, p.y[q]), qz = hn::Set(d, p.z[q]);
    const auto within = [&](uint32_t i) HWY_ATTR {
      const auto dx = hn::Sub(hn::LoadU(d, p.x + i), qx);
      const auto dy = hn::Sub(hn::LoadU(d, p.y + i), qy);
      const auto dz = hn::Sub(hn::LoadU(d, p.z + i), qz);
      return hn::Le(hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz)), limit);
    };
    uint32_t count = 0;
    for (size_t r = 0; r < run_count && count < needed; ++r) {
      uint32_t i = runs[r].first;
      const uint32_t last = runs[r].last;
      for (; i + lanes <= last && count < needed; i += lanes)
        count += static_cast<uint32_t>(hn::CountTrue(d, within(i)));
      if (i < last && count < needed)
        count += static_cast<uint32_t>(hn::CountTrue(d, hn::And(within(i), hn::FirstN(d, last - i))));
    }
    pass[q] = count >= needed;
  }
}

}  // namespace takt::cloud::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::cloud {

HWY_EXPORT(Decide);

void decide(const Coordinates& points, std::span<const Run> runs, Run queries, float radius2, uint32_t needed,
            uint8_t* pass) {
  HWY_DYNAMIC_DISPATCH(Decide)(points, runs.data(), runs.size(), queries, radius2, needed, pass);
}

const char* simd_target() {
  const int64_t supported = hwy::SupportedTargets();
  return hwy::TargetName(supported & -supported);
}

}  // namespace takt::cloud
#endif
