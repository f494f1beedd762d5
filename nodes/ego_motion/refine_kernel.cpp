// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/refine_kernel.hpp"

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/ego_motion/refine_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::ego_motion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kRow = RefinePatch::kRow;
constexpr hn::CappedTag<float, kRow> kFloats;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(kFloats));
constexpr int kParts = kRow / kLanes;  // vectors of a row
using Floats = hn::Vec<decltype(kFloats)>;

/// Accumulators of the columns.
struct Columns {
  Floats part[kParts];
  HWY_INLINE Columns() {
    for (Floats& p : part) p = hn::Zero(kFloats);
  }
  HWY_INLINE void add(int p, Floats v) { part[p] = hn::Add(part[p], v); }
  HWY_INLINE float sum() const {
    HWY_ALIGN float columns[kRow];
    for (int p = 0; p < kParts; ++p) hn::Store(part[p], kFloats, columns + p * kLanes);
    return sum_of_columns(columns);
  }
};

HWY_INLINE Floats pixels(const uint8_t* at) {
  const hn::Rebind<uint8_t, decltype(kFloats)> bytes;
  const hn::Rebind<int32_t, decltype(kFloats)> whole;
  return hn::ConvertTo(kFloats, hn::PromoteTo(whole, hn::LoadU(bytes, at)));
}

/// Bilinear interpolation, row after row: along the row first, then between the row before and this one.
class Sampler {
 public:
  HWY_INLINE explicit Sampler(const BilinearOrigin& at)
      : left_(hn::Set(kFloats, 1 - at.fx)),
        right_(hn::Set(kFloats, at.fx)),
        upper_(hn::Set(kFloats, 1 - at.fy)),
        lower_(hn::Set(kFloats, at.fy)) {}
  HWY_INLINE Floats along(const uint8_t* at) const {
    return hn::Add(hn::Mul(left_, pixels(at)), hn::Mul(right_, pixels(at + 1)));
  }
  HWY_INLINE Floats between(Floats above, Floats below) const {
    return hn::Add(hn::Mul(upper_, above), hn::Mul(lower_, below));
  }

 private:
  Floats left_, right_, upper_, lower_;
};

void take(const BilinearOrigin& at, RefinePatch::Samples& out) {
  const int size = 2 * out.half + 1;
  // One sample more on each side for central differences.
  constexpr int kMaximum = 2 * RefinePatch::kMaximumHalf + 3;
  HWY_ALIGN float samples[kMaximum][2 * kRow];
  const Sampler sampler(at);
  for (int u = 0; u < size + 2; u += kLanes) {
    Floats above = sampler.along(at.pixel + u);
    for (int v = 0; v < size + 2; ++v) {
      const Floats below = sampler.along(at.pixel + (v + 1) * at.stride + u);
      hn::Store(sampler.between(above, below), kFloats, samples[v] + u);
      above = below;
    }
  }
  const Floats half = hn::Set(kFloats, 0.5f);
  const auto difference = [&](const float* after, const float* before) HWY_ATTR {
    return hn::Mul(half, hn::Sub(hn::LoadU(kFloats, after), hn::LoadU(kFloats, before)));
  };
  Columns sum_value, sum_x, sum_y;
  for (int p = 0; p < kParts; ++p) {
    const int u = p * kLanes;
    const auto used = hn::FirstN(kFloats, static_cast<size_t>(size > u ? size - u : 0));
    for (int v = 0; v < size; ++v) {
      const float* centre = samples[v + 1] + u + 1;
      const Floats value = hn::IfThenElseZero(used, hn::LoadU(kFloats, centre));
      const Floats gx = hn::IfThenElseZero(used, difference(centre + 1, centre - 1));
      const Floats gy = hn::IfThenElseZero(used, difference(centre + 2 * kRow, centre - 2 * kRow));
      hn::Store(value, kFloats, out.value[v] + u);
      hn::Store(gx, kFloats, out.gx[v] + u);
      hn::Store(gy, kFloats, out.gy[v] + u);
      sum_value.add(p, value);
      sum_x.add(p, gx);
      sum_y.add(p, gy);
    }
  }
  const auto count = static_cast<float>(size * size);
  const Floats mean = hn::Set(kFloats, sum_value.sum() / count);
  const Floats mean_x = hn::Set(kFloats, sum_x.sum() / count), mean_y = hn::Set(kFloats, sum_y.sum() / count);
  Columns square, along_x, along_y;
  for (int p = 0; p < kParts; ++p) {
    const int u = p * kLanes;
    const auto used = hn::FirstN(kFloats, static_cast<size_t>(size > u ? size - u : 0));
    for (int v = 0; v < size; ++v) {
      const Floats value = hn::IfThenElseZero(used, hn::Sub(hn::Load(kFloats, out.value[v] + u), mean));
      hn::Store(value, kFloats, out.value[v] + u);
      square.add(p, hn::Mul(value, value));
      along_x.add(p, hn::Mul(hn::Load(kFloats, out.gx[v] + u), value));
      along_y.add(p, hn::Mul(hn::Load(kFloats, out.gy[v] + u), value));
    }
  }
  out.square = square.sum();
  const Floats share_x = hn::Set(kFloats, out.square > 0 ? along_x.sum() / out.square : 0);
  const Floats share_y = hn::Set(kFloats, out.square > 0 ? along_y.sum() / out.square : 0);
  Columns xx, xy, yy;
  for (int p = 0; p < kParts; ++p) {
    const int u = p * kLanes;
    const auto used = hn::FirstN(kFloats, static_cast<size_t>(size > u ? size - u : 0));
    for (int v = 0; v < size; ++v) {
      const Floats value = hn::Load(kFloats, out.value[v] + u);
      const auto orthogonal = [&](const float* gradient, Floats mean_gradient, Floats share) HWY_ATTR {
        const Floats centred = hn::Sub(hn::Load(kFloats, gradient), mean_gradient);
        return hn::IfThenElseZero(used, hn::Sub(centred, hn::Mul(share, value)));
      };
      const Floats gx = orthogonal(out.gx[v] + u, mean_x, share_x), gy = orthogonal(out.gy[v] + u, mean_y, share_y);
      hn::Store(gx, kFloats, out.gx[v] + u);
      hn::Store(gy, kFloats, out.gy[v] + u);
      xx.add(p, hn::Mul(gx, gx));
      xy.add(p, hn::Mul(gx, gy));
      yy.add(p, hn::Mul(gy, gy));
    }
  }
  out.xx = xx.sum();
  out.xy = xy.sum();
  out.yy = yy.sum();
}

/// Calls visit(part, row, samples of the image) for all pixels of the patch.
template <class Visit>
HWY_INLINE void sample(int half, const BilinearOrigin& at, Visit visit) {
  const Sampler sampler(at);
  const int size = 2 * half + 1;
  for (int p = 0; p * kLanes < size; ++p) {
    const uint8_t* pixel = at.pixel + p * kLanes;
    Floats above = sampler.along(pixel);
    for (int v = 0; v < size; ++v) {
      pixel += at.stride;
      const Floats below = sampler.along(pixel);
      visit(p, v, sampler.between(above, below));
      above = below;
    }
  }
}

void sums(const RefinePatch::Samples& patch, const BilinearOrigin& at, float& x, float& y) {
  Columns sum_x, sum_y;
  sample(patch.half, at, [&](int p, int v, Floats image) HWY_ATTR {
    sum_x.add(p, hn::Mul(hn::Load(kFloats, patch.gx[v] + p * kLanes), image));
    sum_y.add(p, hn::Mul(hn::Load(kFloats, patch.gy[v] + p * kLanes), image));
  });
  x = sum_x.sum();
  y = sum_y.sum();
}

template <class Rows>
HWY_INLINE float sum_with(const Rows& rows, int half, const BilinearOrigin& at) {
  Columns sum;
  sample(half, at, [&](int p, int v, Floats image) HWY_ATTR {
    sum.add(p, hn::Mul(hn::Load(kFloats, rows[v] + p * kLanes), image));
  });
  return sum.sum();
}

float sum_x(const RefinePatch::Samples& patch, const BilinearOrigin& at) { return sum_with(patch.gx, patch.half, at); }
float sum_value(const RefinePatch::Samples& patch, const BilinearOrigin& at) {
  return sum_with(patch.value, patch.half, at);
}

const RefineKernels& target_refine_kernels() {
  static const RefineKernels table{take, sums, sum_x, sum_value};
  return table;
}

}  // namespace takt::ego_motion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::ego_motion {
HWY_EXPORT(target_refine_kernels);
const RefineKernels& refine_kernels() { return HWY_DYNAMIC_DISPATCH(target_refine_kernels)(); }
}  // namespace takt::ego_motion
#endif
