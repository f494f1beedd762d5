// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/count_kernel.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/cloud/count_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::cloud::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<float> kFloats;
constexpr hn::ScalableTag<int32_t> kCounts;
using Floats = hn::Vec<decltype(kFloats)>;
using Counts = hn::Vec<decltype(kCounts)>;
constexpr uint32_t kLanes = static_cast<uint32_t>(hn::MaxLanes(kFloats));

/// One query a lane, so that each of them has its own count and nothing is added up across lanes. Queries have many
/// candidates in common: one is loaded once and compared with all of them.
class Queries {
 public:
  HWY_INLINE void load(const SortedPoint* points) {
    Floats index;
    hn::LoadInterleaved4(kFloats, &points->x, x_, y_, z_, index);
    count_ = hn::Zero(kCounts);
  }
  // No fused multiply-add: the scalar reference has none.
  HWY_INLINE void compare(Floats x, Floats y, Floats z, Floats radius2) {
    const Floats dx = hn::Sub(x, x_), dy = hn::Sub(y, y_), dz = hn::Sub(z, z_);
    const auto within =
        hn::RebindMask(kCounts, hn::Le(hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz)), radius2));
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
    count_ = hn::IfThenElse(within, hn::Add(count_, hn::Set(kCounts, 1)), count_);  // one masked addition
#else
    count_ = hn::Sub(count_, hn::VecFromMask(kCounts, within));
#endif
  }
  /// True if each of the first `size` lanes has counted `needed`.
  HWY_INLINE bool done(uint32_t size, Counts needed) const {
    return hn::AllFalse(kCounts, hn::And(hn::Lt(count_, needed), hn::FirstN(kCounts, size)));
  }
  HWY_INLINE void store(uint32_t size, int32_t needed, uint8_t* pass) const {
    HWY_ALIGN int32_t counts[kLanes];
    hn::Store(count_, kCounts, counts);
    for (uint32_t i = 0; i < size; ++i) pass[i] = counts[i] >= needed;
  }

 private:
  Floats x_, y_, z_;
  Counts count_;
};

Bounds BoundsOf(const Point* points, size_t count, float farthest_m) {
  const Floats farthest = hn::Set(kFloats, farthest_m);
  Floats low[3], high[3];
  for (int a = 0; a < 3; ++a) low[a] = farthest, high[a] = hn::Neg(farthest);
  Bounds bounds{};
  const auto add = [&](const Point* at, size_t size) HWY_ATTR {
    Floats v[3];
    hn::LoadInterleaved3(kFloats, &at->x, v[0], v[1], v[2]);
    auto usable = hn::FirstN(kFloats, size);
    for (const Floats& c : v) usable = hn::And(usable, hn::Le(hn::Abs(c), farthest));  // NaN fails
    for (int a = 0; a < 3; ++a) {
      low[a] = hn::Min(low[a], hn::IfThenElse(usable, v[a], low[a]));
      high[a] = hn::Max(high[a], hn::IfThenElse(usable, v[a], high[a]));
    }
    bounds.points += hn::CountTrue(kFloats, usable);
  };
  size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) add(points + i, kLanes);
  Point rest[kLanes] = {};
  std::copy(points + i, points + count, rest);
  add(rest, count - i);
  for (int a = 0; a < 3; ++a) {
    bounds.low[a] = hn::GetLane(hn::MinOfLanes(kFloats, low[a]));
    bounds.high[a] = hn::GetLane(hn::MaxOfLanes(kFloats, high[a]));
  }
  return bounds;
}

void Decide(const SortedPoint* p, const Run* runs, size_t run_count, Run queries, float radius2, uint32_t needed,
            uint8_t* pass) {
  constexpr uint32_t kBetweenChecks = 16;
  const Floats limit = hn::Set(kFloats, radius2);
  const Counts enough = hn::Set(kCounts, static_cast<int32_t>(needed));
  // Two vectors at a time: their additions do not wait for one another.
  for (uint32_t q = queries.first; q < queries.last; q += 2 * kLanes) {
    const uint32_t size = std::min(kLanes, queries.last - q);
    const uint32_t more = std::min(kLanes, queries.last - q - size);
    Queries a, b;
    a.load(p + q);
    b.load(p + q + size);
    bool done = false;
    for (size_t r = 0; r < run_count && !done; ++r) {
      for (uint32_t i = runs[r].first; i < runs[r].last && !done;) {
        const uint32_t check = std::min(runs[r].last, i + kBetweenChecks);
        if (more == 0) {
          for (; i < check; ++i)
            a.compare(hn::Set(kFloats, p[i].x), hn::Set(kFloats, p[i].y), hn::Set(kFloats, p[i].z), limit);
        } else {
          for (; i < check; ++i) {
            const Floats x = hn::Set(kFloats, p[i].x), y = hn::Set(kFloats, p[i].y), z = hn::Set(kFloats, p[i].z);
            a.compare(x, y, z, limit);
            b.compare(x, y, z, limit);
          }
        }
        done = a.done(size, enough) && (more == 0 || b.done(more, enough));
      }
    }
    a.store(size, static_cast<int32_t>(needed), pass + q);
    if (more != 0) b.store(more, static_cast<int32_t>(needed), pass + q + size);
  }
}

}  // namespace takt::cloud::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::cloud {

HWY_EXPORT(BoundsOf);
HWY_EXPORT(Decide);

Bounds bounds_of(std::span<const Point> points, float farthest_m) {
  return HWY_DYNAMIC_DISPATCH(BoundsOf)(points.data(), points.size(), farthest_m);
}

void decide(const SortedPoint* points, std::span<const Run> runs, Run queries, float radius2, uint32_t needed,
            uint8_t* pass) {
  HWY_DYNAMIC_DISPATCH(Decide)(points, runs.data(), runs.size(), queries, radius2, needed, pass);
}

const char* simd_target() {
  const int64_t supported = hwy::SupportedTargets();
  return hwy::TargetName(supported & -supported);
}

}  // namespace takt::cloud
#endif
