// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/motion_kernel.hpp"

#include <limits>

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/ego_motion/motion_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::ego_motion::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr size_t kAll = ObservationTable::kLanes;
constexpr hn::CappedTag<double, kAll> kTag;
constexpr size_t kLanes = hn::MaxLanes(kTag);
using Vector = hn::Vec<decltype(kTag)>;

/// A vector that is written like a number.
struct Number {
  Vector v;
  Number() = default;
  HWY_INLINE Number(Vector vector) : v(vector) {}
  HWY_INLINE Number(double value) : v(hn::Set(kTag, value)) {}
};
HWY_INLINE Number operator+(Number a, Number b) { return hn::Add(a.v, b.v); }
HWY_INLINE Number operator-(Number a, Number b) { return hn::Sub(a.v, b.v); }
HWY_INLINE Number operator*(Number a, Number b) { return hn::Mul(a.v, b.v); }
HWY_INLINE Number operator/(Number a, Number b) { return hn::Div(a.v, b.v); }
HWY_INLINE Number operator-(Number a) { return hn::Neg(a.v); }
HWY_INLINE Number load(const double* at) { return hn::LoadU(kTag, at); }

/// kLanes observations from i on, under T.
struct Seen {
  Number u, v, inverse_depth;  ///< where T brings the point: X / Z, Y / Z, 1 / Z
  Number rx, ry, rd, square;   ///< residuals in px, the sum of their squares
  Number has_d;
  hn::Mask<decltype(kTag)> usable;  ///< an observation, before the camera
};

HWY_INLINE Seen look(const ObservationTable& o, const Motion12& T, size_t i) {
  using C = ObservationTable;
  const Number px = load(o[C::x] + i), py = load(o[C::y] + i), pz = load(o[C::z] + i);
  const Number x = T[0] * px + T[1] * py + T[2] * pz + T[9], y = T[3] * px + T[4] * py + T[5] * pz + T[10],
               z = T[6] * px + T[7] * py + T[8] * pz + T[11];
  const double f = o.optics().focal_px;
  Seen s;
  s.usable = hn::And(hn::Ge(z.v, hn::Set(kTag, kNearestDepth)), hn::FirstN(kTag, o.size() > i ? o.size() - i : 0));
  s.inverse_depth = Number(1.0) / Number(hn::IfThenElse(s.usable, z.v, hn::Set(kTag, 1.0)));
  s.u = x * s.inverse_depth;
  s.v = y * s.inverse_depth;
  s.has_d = load(o[C::has_d] + i);
  s.rx = load(o[C::u] + i) - f * s.u;
  s.ry = load(o[C::v] + i) - f * s.v;
  s.rd = s.has_d * (kDisparityWeight * (load(o[C::d] + i) - f * o.optics().baseline_m * s.inverse_depth));
  s.square = s.rx * s.rx + s.ry * s.ry + s.rd * s.rd;
  return s;
}

Score score(const ObservationTable& o, const Motion12& T, double limit_px) {
  const Vector limit = hn::Set(kTag, limit_px * limit_px);
  HWY_ALIGN double cost[kAll];
  Score out;
  for (size_t part = 0; part < kAll; part += kLanes) {
    Number sum = 0.0;
    for (size_t i = part; i < o.size(); i += kAll) {
      const Seen s = look(o, T, i);
      const auto inside = hn::And(s.usable, hn::Lt(s.square.v, limit));
      const auto any = hn::FirstN(kTag, o.size() - i);
      sum = sum + Number(hn::IfThenElseZero(any, hn::IfThenElse(inside, s.square.v, limit)));
      out.inside += hn::CountTrue(kTag, inside);
    }
    hn::Store(sum.v, kTag, cost + part);
  }
  out.cost = sum_of_lanes(cost);
  return out;
}

void mark(const ObservationTable& o, const Motion12& T, double limit_px, double* use) {
  const Vector limit = hn::Set(kTag, limit_px * limit_px), one = hn::Set(kTag, 1.0);
  const size_t end = (o.size() + kAll - 1) / kAll * kAll;
  for (size_t i = 0; i < end; i += kLanes) {
    const Seen s = look(o, T, i);
    hn::StoreU(hn::IfThenElseZero(hn::And(s.usable, hn::Lt(s.square.v, limit)), one), kTag, use + i);
  }
}

/// Derivatives of the three residuals by a small motion after T (p' = p + v + w x p), those that are not 0, and the
/// weight.
struct Rows {
  Number x0, x2, x3, x4, x5, y1, y2, y3, y4, y5, d2, d3, d4;
  Number weight;
};

HWY_INLINE Rows rows(const ObservationTable& o, const Seen& s, const Weights& weights, size_t i) {
  const Number f = o.optics().focal_px, fu = f * s.u, fv = f * s.v;
  const Number g = s.has_d * (kDisparityWeight * o.optics().focal_px * o.optics().baseline_m) * s.inverse_depth;
  Rows r;
  r.x0 = r.y1 = f * s.inverse_depth;
  r.x2 = -(fu * s.inverse_depth);
  r.x3 = -(fu * s.v);
  r.x4 = f + fu * s.u;
  r.x5 = -fv;
  r.y2 = -(fv * s.inverse_depth);
  r.y3 = -(f + fv * s.v);
  r.y4 = fu * s.v;
  r.y5 = fu;
  r.d2 = -(g * s.inverse_depth);
  r.d3 = -(g * s.v);
  r.d4 = g * s.u;
  r.weight = hn::IfThenElseZero(s.usable, load(weights.use + i).v);
  if (weights.scale_px > 0) r.weight = r.weight / (1.0 + s.square / (weights.scale_px * weights.scale_px));
  return r;
}

HWY_INLINE void gradient(const Seen& s, const Rows& r, Number (&g)[6]) {
  g[0] = r.weight * (r.x0 * s.rx);
  g[1] = r.weight * (r.y1 * s.ry);
  g[2] = r.weight * (r.x2 * s.rx + r.y2 * s.ry + r.d2 * s.rd);
  g[3] = r.weight * (r.x3 * s.rx + r.y3 * s.ry + r.d3 * s.rd);
  g[4] = r.weight * (r.x4 * s.rx + r.y4 * s.ry + r.d4 * s.rd);
  g[5] = r.weight * (r.x5 * s.rx + r.y5 * s.ry);
}

/// Adds a visitor's terms of all observations, kCount of them, each in its lanes.
template <size_t kCount, class Terms>
HWY_INLINE std::array<double, kCount> add_up(const ObservationTable& o, Terms terms) {
  HWY_ALIGN double lanes[kCount][kAll];
  for (size_t part = 0; part < kAll; part += kLanes) {
    Number sums[kCount];
    for (Number& sum : sums) sum = 0.0;
    for (size_t i = part; i < o.size(); i += kAll) terms(i, sums);
    for (size_t k = 0; k < kCount; ++k) hn::Store(sums[k].v, kTag, lanes[k] + part);
  }
  std::array<double, kCount> out;
  for (size_t k = 0; k < kCount; ++k) out[k] = sum_of_lanes(lanes[k]);
  return out;
}

NormalEquations normal(const ObservationTable& o, const Motion12& T, const Weights& weights) {
  const auto all = add_up<27>(o, [&](size_t i, Number(&a)[27]) HWY_ATTR {
    const Seen s = look(o, T, i);
    const Rows r = rows(o, s, weights, i);
    const Number w = r.weight;
    // Row after row of the triangle; element 1 is always 0.
    a[0] = a[0] + w * (r.x0 * r.x0);
    a[2] = a[2] + w * (r.x0 * r.x2);
    a[3] = a[3] + w * (r.x0 * r.x3);
    a[4] = a[4] + w * (r.x0 * r.x4);
    a[5] = a[5] + w * (r.x0 * r.x5);
    a[6] = a[6] + w * (r.y1 * r.y1);
    a[7] = a[7] + w * (r.y1 * r.y2);
    a[8] = a[8] + w * (r.y1 * r.y3);
    a[9] = a[9] + w * (r.y1 * r.y4);
    a[10] = a[10] + w * (r.y1 * r.y5);
    a[11] = a[11] + w * (r.x2 * r.x2 + r.y2 * r.y2 + r.d2 * r.d2);
    a[12] = a[12] + w * (r.x2 * r.x3 + r.y2 * r.y3 + r.d2 * r.d3);
    a[13] = a[13] + w * (r.x2 * r.x4 + r.y2 * r.y4 + r.d2 * r.d4);
    a[14] = a[14] + w * (r.x2 * r.x5 + r.y2 * r.y5);
    a[15] = a[15] + w * (r.x3 * r.x3 + r.y3 * r.y3 + r.d3 * r.d3);
    a[16] = a[16] + w * (r.x3 * r.x4 + r.y3 * r.y4 + r.d3 * r.d4);
    a[17] = a[17] + w * (r.x3 * r.x5 + r.y3 * r.y5);
    a[18] = a[18] + w * (r.x4 * r.x4 + r.y4 * r.y4 + r.d4 * r.d4);
    a[19] = a[19] + w * (r.x4 * r.x5 + r.y4 * r.y5);
    a[20] = a[20] + w * (r.x5 * r.x5 + r.y5 * r.y5);
    Number g[6];
    gradient(s, r, g);
    for (size_t k = 0; k < 6; ++k) a[21 + k] = a[21 + k] + g[k];
  });
  NormalEquations n;
  for (size_t k = 0; k < 21; ++k) n.matrix[k] = all[k];
  for (size_t k = 0; k < 6; ++k) n.vector[k] = all[21 + k];
  return n;
}

Scatter scatter(const ObservationTable& o, const Motion12& T, const Weights& weights) {
  const auto all = add_up<39>(o, [&](size_t i, Number(&a)[39]) HWY_ATTR {
    const Seen s = look(o, T, i);
    const Rows r = rows(o, s, weights, i);
    Number g[6];
    gradient(s, r, g);
    size_t k = 0;
    for (size_t row = 0; row < 6; ++row)
      for (size_t c = row; c < 6; ++c, ++k) a[k] = a[k] + g[row] * g[c];
    const Number zero = 0.0;
    const Number of_residuals[18] = {r.x0, zero, r.x2, r.x3, r.x4, r.x5, zero, r.y1, r.y2,
                                     r.y3, r.y4, r.y5, zero, zero, r.d2, r.d3, r.d4, zero};
    for (size_t j = 0; j < 18; ++j, ++k) a[k] = a[k] + r.weight * of_residuals[j];
  });
  Scatter out;
  for (size_t k = 0; k < 21; ++k) out.matrix[k] = all[k];
  for (size_t k = 0; k < 18; ++k) out.shared[k / 6][k % 6] = all[21 + k];
  return out;
}

const MotionKernels& target_motion_kernels() {
  static const MotionKernels table{score, mark, normal, scatter};
  return table;
}

}  // namespace takt::ego_motion::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::ego_motion {
HWY_EXPORT(target_motion_kernels);
const MotionKernels& motion_kernels() { return HWY_DYNAMIC_DISPATCH(target_motion_kernels)(); }
}  // namespace takt::ego_motion
#endif
