// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/window_kernel.hpp"

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/traffic_signs/window_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::traffic_signs::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<float> kFloats;
constexpr hn::ScalableTag<double> kDoubles;
constexpr hn::ScalableTag<int32_t> kInts;
constexpr hn::Half<decltype(kFloats)> kHalfFloats;
constexpr hn::Half<decltype(kInts)> kHalfInts;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(kFloats));
using Floats = hn::Vec<decltype(kFloats)>;
using Doubles = hn::Vec<decltype(kDoubles)>;
using Ints = hn::Vec<decltype(kInts)>;
using Mask = hn::Mask<decltype(kFloats)>;

HWY_INLINE Ints rect_sum(const int32_t* sums, const Corners& at) {
  return hn::Add(
      hn::Sub(hn::Sub(hn::LoadU(kInts, sums + at.a), hn::LoadU(kInts, sums + at.b)), hn::LoadU(kInts, sums + at.c)),
      hn::LoadU(kInts, sums + at.d));
}

/// 1 / (area x standard deviation), or a number below 0 if the windows are flat.
HWY_INLINE hn::Vec<decltype(kHalfFloats)> half_norm(hn::Vec<decltype(kHalfInts)> sum,
                                                    hn::Vec<decltype(kHalfInts)> square, double inner_area) {
  const Doubles area = hn::Set(kDoubles, inner_area), s = hn::PromoteTo(kDoubles, sum);
  const Doubles spread = hn::Sub(hn::Mul(area, hn::PromoteTo(kDoubles, square)), hn::Mul(s, s));
  const auto varies = hn::Gt(spread, hn::Zero(kDoubles));
  const Doubles root = hn::Sqrt(hn::IfThenElse(varies, spread, hn::Set(kDoubles, 1.0)));
  const auto norm = hn::DemoteTo(kHalfFloats, hn::Div(hn::Set(kDoubles, 1.0), root));
  const auto contrast = hn::Lt(hn::Mul(area, hn::PromoteTo(kDoubles, norm)), hn::Set(kDoubles, 0.1));
  return hn::DemoteTo(
      kHalfFloats, hn::IfThenElse(hn::And(varies, contrast), hn::PromoteTo(kDoubles, norm), hn::Set(kDoubles, -1.0)));
}

HWY_INLINE Floats norms(const PlacedCascade& cascade, const int32_t* sums, const int32_t* squares) {
  const Ints s = rect_sum(sums, cascade.inner), q = rect_sum(squares, cascade.inner);
  return hn::Combine(kFloats, half_norm(hn::UpperHalf(kHalfInts, s), hn::UpperHalf(kHalfInts, q), cascade.inner_area),
                     half_norm(hn::LowerHalf(kHalfInts, s), hn::LowerHalf(kHalfInts, q), cascade.inner_area));
}

/// Stumps are summed as doubles, one after another, as OpenCV does: no window decides otherwise by a rounding.
HWY_INLINE Mask passes(const PlacedStump* stump, const PlacedStage& stage, const int32_t* sums, Floats norm) {
  Doubles lower = hn::Zero(kDoubles), upper = hn::Zero(kDoubles);
  for (const PlacedStump* end = stump + stage.stumps; stump != end; ++stump) {
    const auto weighted = [&](int i) HWY_ATTR {
      return hn::Mul(hn::Set(kFloats, stump->weights[i]), hn::ConvertTo(kFloats, rect_sum(sums, stump->rects[i])));
    };
    Floats value = hn::Add(weighted(0), weighted(1));
    if (stump->weights[2] != 0) value = hn::Add(value, weighted(2));
    const Floats leaf = hn::IfThenElse(hn::Lt(hn::Mul(value, norm), hn::Set(kFloats, stump->threshold)),
                                       hn::Set(kFloats, stump->below), hn::Set(kFloats, stump->otherwise));
    lower = hn::Add(lower, hn::PromoteTo(kDoubles, hn::LowerHalf(kHalfFloats, leaf)));
    upper = hn::Add(upper, hn::PromoteTo(kDoubles, hn::UpperHalf(kHalfFloats, leaf)));
  }
  // A difference keeps its sign as a float: it is 0, or no smaller than a double's last digit.
  const Doubles threshold = hn::Set(kDoubles, static_cast<double>(stage.threshold));
  const Floats margin = hn::Combine(kFloats, hn::DemoteTo(kHalfFloats, hn::Sub(upper, threshold)),
                                    hn::DemoteTo(kHalfFloats, hn::Sub(lower, threshold)));
  return hn::Ge(margin, hn::Zero(kFloats));
}

void pass(const PlacedCascade& cascade, const int32_t* sums, const int32_t* squares, int count, const uint8_t* wanted,
          uint8_t* passed) {
  HWY_ALIGN int32_t depth[kLanes];
  for (int first = 0; first < count; first += kLanes, sums += kLanes, squares += kLanes) {
    const int lanes = HWY_MIN(kLanes, count - first);
    bool any = wanted == nullptr;
    for (int i = 0; i < lanes && !any; ++i) any = wanted[first + i] != 0;
    if (!any) {
      for (int i = 0; i < lanes; ++i) passed[first + i] = kNotSearched;
      continue;
    }
    const Floats norm = norms(cascade, sums, squares);
    const Mask flat = hn::Lt(norm, hn::Zero(kFloats));
    Mask alive = hn::AndNot(flat, hn::FirstN(kFloats, static_cast<size_t>(lanes)));
    if (wanted != nullptr) {
      for (int i = 0; i < kLanes; ++i) depth[i] = i < lanes ? wanted[first + i] : 0;
      alive = hn::And(alive, hn::RebindMask(kFloats, hn::Ne(hn::Load(kInts, depth), hn::Zero(kInts))));
    }
    Ints stages = hn::IfThenElseZero(hn::RebindMask(kInts, flat), hn::Set(kInts, kFlat));
    const PlacedStump* stump = cascade.stumps.data();
    for (const PlacedStage& stage : cascade.stages) {
      if (hn::AllFalse(kFloats, alive)) break;
      alive = hn::And(alive, passes(stump, stage, sums, norm));
      stages = hn::Sub(stages, hn::VecFromMask(kInts, hn::RebindMask(kInts, alive)));
      stump += stage.stumps;
    }
    hn::Store(stages, kInts, depth);
    for (int i = 0; i < lanes; ++i)
      passed[first + i] = wanted == nullptr || wanted[first + i] != 0 ? static_cast<uint8_t>(depth[i]) : kNotSearched;
  }
}

}  // namespace takt::traffic_signs::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::traffic_signs {
HWY_EXPORT(pass);
void pass_windows(const PlacedCascade& cascade, const int32_t* sums, const int32_t* squares, int count,
                  const uint8_t* wanted, uint8_t* passed) {
  HWY_DYNAMIC_DISPATCH(pass)(cascade, sums, squares, count, wanted, passed);
}
}  // namespace takt::traffic_signs
#endif
