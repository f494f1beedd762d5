// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/fusion_kernel.hpp"

#include <limits>

#include "nodes/mapping_3d/median_fusion.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/mapping_3d/fusion_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::mapping_3d::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<float> kFloats;
constexpr hn::RebindToSigned<decltype(kFloats)> kInts;
using Floats = hn::Vec<decltype(kFloats)>;
using Ints = hn::Vec<decltype(kInts)>;
constexpr float kNothing = std::numeric_limits<float>::infinity();

// As warped(): no fused multiply-add.
void WarpRow(const Warp& w, int v, const float* HWY_RESTRICT depth_m, int width, const DepthCamera& to,
             int32_t* HWY_RESTRICT pixel, float* HWY_RESTRICT warped_m) {
  Floats base[3], b[3], t[3];
  for (int i = 0; i < 3; ++i) {
    base[i] = hn::Set(kFloats, w.a[i] + w.c[i] * static_cast<float>(v));
    b[i] = hn::Set(kFloats, w.b[i]);
    t[i] = hn::Set(kFloats, w.t[i]);
  }
  const Floats zero = hn::Zero(kFloats), half = hn::Set(kFloats, 0.5f), one = hn::Set(kFloats, 1.0f);
  const Floats right = hn::Set(kFloats, static_cast<float>(to.width));
  const Floats bottom = hn::Set(kFloats, static_cast<float>(to.height));
  const Ints stride = hn::Set(kInts, to.width), none = hn::Set(kInts, -1);
  const int lanes = static_cast<int>(hn::Lanes(kFloats));
  for (int i = 0; i < width; i += lanes) {
    const Floats u = hn::ConvertTo(kFloats, hn::Iota(kInts, i)), depth = hn::LoadU(kFloats, depth_m + i);
    Floats h[3];
    for (int k = 0; k < 3; ++k) h[k] = hn::Add(hn::Mul(depth, hn::Add(base[k], hn::Mul(b[k], u))), t[k]);
    const Floats inverse = hn::Div(one, h[2]);
    const Floats x = hn::Add(hn::Mul(h[0], inverse), half), y = hn::Add(hn::Mul(h[1], inverse), half);
    auto inside = hn::And(hn::Gt(depth, zero), hn::Gt(h[2], zero));
    inside = hn::And(inside, hn::And(hn::Ge(x, zero), hn::Ge(y, zero)));
    inside = hn::And(inside, hn::And(hn::Lt(x, right), hn::Lt(y, bottom)));
    const Ints column = hn::ConvertTo(kInts, hn::IfThenElseZero(inside, x));
    const Ints row = hn::ConvertTo(kInts, hn::IfThenElseZero(inside, y));
    const Ints at = hn::Add(hn::Mul(row, stride), column);
    hn::StoreU(hn::IfThenElse(hn::RebindMask(kInts, inside), at, none), kInts, pixel + i);
    hn::StoreU(h[2], kFloats, warped_m + i);
  }
}

HWY_INLINE Floats ToleranceAt(Floats depth, Floats per_m2, Floats least) {
  return hn::Max(least, hn::Mul(per_m2, hn::Mul(depth, depth)));
}

bool Nominate(const SeenRun& seen, float* HWY_RESTRICT candidate_m, int32_t* HWY_RESTRICT unsettled) {
  const Floats nothing = hn::Set(kFloats, kNothing), per_m2 = hn::Set(kFloats, seen.tolerance_per_m2);
  const Floats least = hn::Set(kFloats, seen.tolerance_least_m);
  bool any = false;
  for (size_t i = 0; i < seen.pixels; i += hn::Lanes(kFloats)) {
    Floats nearest = nothing;
    for (size_t k = 0; k < seen.count; ++k)
      nearest = hn::Min(nearest, hn::LoadU(kFloats, seen.views[k] + seen.first + i));
    const Floats limit = hn::Add(nearest, ToleranceAt(nearest, per_m2, least));
    // Each view that sees something no farther counts 1, each that sees something farther -1.
    Ints balance = hn::Zero(kInts);
    for (size_t k = 0; k < seen.count; ++k) {
      const Floats depth = hn::LoadU(kFloats, seen.views[k] + seen.first + i);
      const auto near = hn::Le(depth, limit), far = hn::And(hn::Gt(depth, limit), hn::Lt(depth, nothing));
      balance = hn::Sub(balance, hn::VecFromMask(kInts, hn::RebindMask(kInts, near)));
      balance = hn::Add(balance, hn::VecFromMask(kInts, hn::RebindMask(kInts, far)));
    }
    const auto contested = hn::Lt(balance, hn::Zero(kInts));
    any |= !hn::AllFalse(kInts, contested);
    hn::StoreU(nearest, kFloats, candidate_m + i);
    hn::StoreU(hn::VecFromMask(kInts, contested), kInts, unsettled + i);
  }
  return any;
}

void Conclude(const SeenRun& seen, bool median, int support, const float* HWY_RESTRICT candidate_m,
              float* HWY_RESTRICT depth_m) {
  const Floats nothing = hn::Set(kFloats, kNothing), per_m2 = hn::Set(kFloats, seen.tolerance_per_m2);
  const Floats least = hn::Set(kFloats, seen.tolerance_least_m);
  const Ints enough = hn::Set(kInts, support - 1), one = hn::Set(kInts, 1);
  Floats alike[MedianFusion::kMostViews];
  for (size_t i = 0; i < seen.pixels; i += hn::Lanes(kFloats)) {
    const Floats candidate = hn::LoadU(kFloats, candidate_m + i);
    const Floats tolerance = ToleranceAt(candidate, per_m2, least);
    const auto known = hn::Lt(candidate, nothing);
    Ints count = hn::Zero(kInts);
    for (size_t k = 0; k < seen.count; ++k) {
      const Floats depth = hn::LoadU(kFloats, seen.views[k] + seen.first + i);
      const auto near = hn::And(known, hn::Le(hn::Abs(hn::Sub(depth, candidate)), tolerance));
      alike[k] = hn::IfThenElse(near, depth, nothing);
      count = hn::Sub(count, hn::VecFromMask(kInts, hn::RebindMask(kInts, near)));
    }
    Floats result = candidate;
    if (median) {
      for (size_t pass = 0; pass < seen.count; ++pass)  // odd-even transposition sort
        for (size_t k = pass & 1; k + 1 < seen.count; k += 2) {
          const Floats low = hn::Min(alike[k], alike[k + 1]);
          alike[k + 1] = hn::Max(alike[k], alike[k + 1]);
          alike[k] = low;
        }
      const Ints middle = hn::ShiftRight<1>(hn::Sub(count, one));
      for (size_t k = 0; k < seen.count; ++k) {
        const auto here = hn::Eq(middle, hn::Set(kInts, static_cast<int32_t>(k)));
        result = hn::IfThenElse(hn::RebindMask(kFloats, here), alike[k], result);
      }
    }
    const auto supported = hn::And(known, hn::RebindMask(kFloats, hn::Gt(count, enough)));
    hn::StoreU(hn::IfThenElseZero(supported, result), kFloats, depth_m + i);
  }
}

}  // namespace takt::mapping_3d::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::mapping_3d {

HWY_EXPORT(WarpRow);
HWY_EXPORT(Nominate);
HWY_EXPORT(Conclude);

void warp_row(const Warp& warp, int v, const float* depth_m, int width, const DepthCamera& to, int32_t* pixel,
              float* warped_m) {
  HWY_DYNAMIC_DISPATCH(WarpRow)(warp, v, depth_m, width, to, pixel, warped_m);
}

bool nominate(const SeenRun& seen, float* candidate_m, int32_t* unsettled) {
  return HWY_DYNAMIC_DISPATCH(Nominate)(seen, candidate_m, unsettled);
}

void conclude(const SeenRun& seen, bool median, int support, const float* candidate_m, float* depth_m) {
  HWY_DYNAMIC_DISPATCH(Conclude)(seen, median, support, candidate_m, depth_m);
}

}  // namespace takt::mapping_3d
#endif
