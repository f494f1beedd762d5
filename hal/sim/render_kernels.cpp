// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/render_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hal/sim/render_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target, as Highway asks.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::sim::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::CappedTag<float, kShadeBlock>;
using I = hn::RebindToSigned<F>;
using U = hn::RebindToUnsigned<F>;

HWY_INLINE hn::Vec<F> pixel_x(F f, int x) { return hn::Iota(f, static_cast<float>(x)); }

void DrawPlane(const PlaneSpan& span, float* inverse_depth, int32_t* id) {
  const F f;
  const I i;
  const int lanes = static_cast<int>(hn::Lanes(f));
  const auto a = hn::Set(f, span.a), row = hn::Set(f, span.row), end = hn::Set(f, static_cast<float>(span.x1));
  const auto surface = hn::Set(i, span.id);
  for (int x = span.x0; x < span.x1; x += lanes) {
    const auto px = pixel_x(f, x);
    const auto value = hn::Add(hn::Mul(a, px), row);
    const auto old = hn::LoadU(f, inverse_depth + x);
    const auto wins = hn::And(hn::Gt(value, old), hn::Lt(px, end));
    hn::StoreU(hn::IfThenElse(wins, value, old), f, inverse_depth + x);
    hn::StoreU(hn::IfThenElse(hn::RebindMask(i, wins), surface, hn::LoadU(i, id + x)), i, id + x);
  }
}

/// Ray-capsule intersection: the infinite cylinder first, then the sphere at the end it passed (quadratics in t = z,
/// because a ray has z = 1).
void DrawCapsule(const CameraCapsule& c, const CapsuleSpan& span, float* inverse_depth, int32_t* id, float* gain) {
  const F f;
  const I i;
  const int lanes = static_cast<int>(hn::Lanes(f));
  const auto set = [&](float v) { return hn::Set(f, v); };
  const auto zero = hn::Zero(f), one = set(1.0f);
  const auto axx = set(c.axis_axis), r2 = set(c.radius * c.radius);
  const auto ry = set(span.ray_y);
  const auto cc = set(c.axis_axis * c.a_a - c.a_axis * c.a_axis - c.radius * c.radius * c.axis_axis);
  for (int x = span.x0; x < span.x1; x += lanes) {
    const auto px = pixel_x(f, x);
    const auto rx = hn::Add(hn::Mul(px, set(span.ray_x_step)), set(span.ray_x_start));
    const auto dot = [&](const float* v) {
      return hn::Add(hn::Add(hn::Mul(rx, set(v[0])), hn::Mul(ry, set(v[1]))), set(v[2]));
    };
    const auto dd = hn::Add(hn::Add(hn::Mul(rx, rx), hn::Mul(ry, ry)), one);
    const auto d_axis = dot(c.axis);
    const auto d_oa = hn::Neg(dot(c.a));  // ray . (origin - a)
    const auto qa = hn::Sub(hn::Mul(axx, dd), hn::Mul(d_axis, d_axis));
    const auto qb = hn::Sub(hn::Mul(axx, d_oa), hn::Mul(set(c.a_axis), d_axis));
    const auto qh = hn::Sub(hn::Mul(qb, qb), hn::Mul(qa, cc));
    const auto body_hit = hn::Ge(qh, zero);
    if (hn::AllFalse(f, body_hit)) continue;  // what misses the infinite cylinder misses the capsule
    const auto t_body = hn::Div(hn::Sub(hn::Neg(qb), hn::Sqrt(hn::Max(qh, zero))), qa);
    const auto along = hn::Add(set(c.a_axis), hn::Mul(t_body, d_axis));
    const auto on_body = hn::And(body_hit, hn::And(hn::Gt(along, zero), hn::Lt(along, axx)));
    // Sphere of the end beyond which the ray met the cylinder.
    const auto far_end = hn::Ge(along, axx);
    const auto shift = hn::IfThenElse(far_end, one, zero);
    const auto sb = hn::Sub(d_oa, hn::Mul(shift, d_axis));
    const auto o_o = hn::Sub(set(c.a_a), hn::Mul(shift, hn::Sub(set(2.0f * c.a_axis), axx)));
    const auto sh = hn::Sub(hn::Mul(sb, sb), hn::Mul(dd, hn::Sub(o_o, r2)));
    const auto t_cap = hn::Div(hn::Sub(hn::Neg(sb), hn::Sqrt(hn::Max(sh, zero))), dd);
    const auto hit = hn::Or(on_body, hn::And(body_hit, hn::Ge(sh, zero)));
    const auto t = hn::IfThenElse(on_body, t_body, t_cap);
    const auto inverse = hn::Div(one, t);
    const auto old = hn::LoadU(f, inverse_depth + x);
    const auto inside = hn::And(hn::Lt(px, set(static_cast<float>(span.x1))), hn::Gt(t, set(0.01f)));
    const auto wins = hn::And(hn::And(hit, inside), hn::Gt(inverse, old));
    if (hn::AllFalse(f, wins)) continue;
    // Normal = (hit - nearest point of the axis) / radius, dotted with the light.
    const auto h = hn::IfThenElse(on_body, hn::Div(along, axx), shift);
    const auto p_light = hn::Mul(t, dot(c.light));
    const float al = c.a[0] * c.light[0] + c.a[1] * c.light[1] + c.a[2] * c.light[2];
    const float xl = c.axis[0] * c.light[0] + c.axis[1] * c.light[1] + c.axis[2] * c.light[2];
    const auto n_light = hn::Div(hn::Sub(hn::Sub(p_light, set(al)), hn::Mul(h, set(xl))), set(c.radius));
    const auto shading = hn::Add(set(0.78f), hn::Mul(set(0.22f), n_light));
    hn::StoreU(hn::IfThenElse(wins, inverse, old), f, inverse_depth + x);
    hn::StoreU(hn::IfThenElse(hn::RebindMask(i, wins), hn::Set(i, span.id), hn::LoadU(i, id + x)), i, id + x);
    hn::StoreU(hn::IfThenElse(wins, shading, hn::LoadU(f, gain + x)), f, gain + x);
  }
}

HWY_INLINE hn::Vec<U> hash_pixels(U u, hn::Vec<U> x, uint32_t seed) {
  auto h = hn::Xor(hn::Mul(x, hn::Set(u, 0x9E3779B1u)), hn::Set(u, seed));
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<15>(h)), hn::Set(u, 0x85EBCA77u));
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<13>(h)), hn::Set(u, 0xC2B2AE3Du));
  return hn::Xor(h, hn::ShiftRight<16>(h));
}

struct Corners {
  hn::Vec<U> t00, t01, t10, t11;
  hn::Vec<F> wx, wy;
};

template <int kShift>
HWY_INLINE hn::Vec<F> bilinear(F f, const Corners& c) {
  const I i;
  const U u;
  const auto mask = hn::Set(u, 255u);
  const auto channel = [&](hn::Vec<U> t) {
    return hn::ConvertTo(f, hn::BitCast(i, hn::And(hn::ShiftRight<kShift>(t), mask)));
  };
  const auto a = channel(c.t00), b = channel(c.t10);
  const auto top = hn::Add(a, hn::Mul(c.wx, hn::Sub(channel(c.t01), a)));
  const auto bottom = hn::Add(b, hn::Mul(c.wx, hn::Sub(channel(c.t11), b)));
  return hn::Add(top, hn::Mul(c.wy, hn::Sub(bottom, top)));
}

void Shade(const ShadeRun& run, const float* inverse_depth, uint8_t* b, uint8_t* g, uint8_t* r) {
  const F f;
  const I i;
  const U u;
  const hn::Rebind<uint8_t, F> u8;
  const int lanes = static_cast<int>(hn::Lanes(f));
  const auto set = [&](float v) { return hn::Set(f, v); };
  const auto mask = hn::Set(i, run.size - 1), pitch = hn::Set(i, 4 * run.size), one = hn::Set(i, 1),
             low = hn::Set(i, 3);
  // Texels lie in tiles of 4 x 4, one cache line each: the address is a part of u plus a part of v.
  const auto column = [&](hn::Vec<I> v) {
    const auto wrapped = hn::And(v, mask);
    return hn::Add(hn::ShiftLeft<4>(hn::ShiftRight<2>(wrapped)), hn::And(wrapped, low));
  };
  const auto line = [&](hn::Vec<I> v) {
    const auto wrapped = hn::And(v, mask);
    return hn::Add(hn::Mul(hn::ShiftRight<2>(wrapped), pitch), hn::ShiftLeft<2>(hn::And(wrapped, low)));
  };
  const auto* texels = reinterpret_cast<const int32_t*>(run.level);
  for (int k = 0; k < run.count; k += lanes) {
    const int x = run.x0 + k;
    const auto px = pixel_x(f, x);
    const auto z = hn::Div(set(1.0f), hn::LoadU(f, inverse_depth + x));
    const auto tu = hn::Add(set(run.u0), hn::Mul(z, hn::Add(hn::Mul(px, set(run.ua)), set(run.ub))));
    const auto tv = hn::Add(set(run.v0), hn::Mul(z, hn::Add(hn::Mul(px, set(run.va)), set(run.vb))));
    const auto fu = hn::Floor(tu), fv = hn::Floor(tv);
    const auto iu = hn::ConvertTo(i, fu), iv = hn::ConvertTo(i, fv);
    const auto u_0 = column(iu), u_1 = column(hn::Add(iu, one)), v_0 = line(iv), v_1 = line(hn::Add(iv, one));
    Corners c;
    c.t00 = hn::BitCast(u, hn::GatherIndex(i, texels, hn::Add(v_0, u_0)));
    c.t01 = hn::BitCast(u, hn::GatherIndex(i, texels, hn::Add(v_0, u_1)));
    c.t10 = hn::BitCast(u, hn::GatherIndex(i, texels, hn::Add(v_1, u_0)));
    c.t11 = hn::BitCast(u, hn::GatherIndex(i, texels, hn::Add(v_1, u_1)));
    c.wx = hn::Sub(tu, fu);
    c.wy = hn::Sub(tv, fv);
    auto gain = set(run.gain);
    if (run.gain_row != nullptr) gain = hn::Mul(gain, hn::LoadU(f, run.gain_row + x));
    const auto blue = hn::Mul(bilinear<0>(f, c), gain), green = hn::Mul(bilinear<8>(f, c), gain),
               red = hn::Mul(bilinear<16>(f, c), gain);
    // Triangular noise of three independent pairs of 5-bit draws; 13.06 is the standard deviation of such a sum.
    const auto h = hash_pixels(u, hn::BitCast(u, hn::Iota(i, x)), run.noise_seed);
    const auto bits = hn::Set(u, 31u);
    const auto sigma = hn::Sqrt(hn::Add(set(run.read_noise * run.read_noise), hn::Mul(set(run.photon_noise), green)));
    const auto amplitude = hn::Mul(sigma, set(1.0f / 13.06f));
    const auto noisy = [&](hn::Vec<F> level, hn::Vec<U> first, hn::Vec<U> second) {
      const auto draw = hn::BitCast(i, hn::Add(hn::And(first, bits), hn::And(second, bits)));
      const auto centred = hn::Sub(hn::ConvertTo(f, draw), set(31.0f));
      return hn::DemoteTo(u8, hn::NearestInt(hn::Add(level, hn::Mul(amplitude, centred))));
    };
    hn::StoreU(noisy(blue, h, hn::ShiftRight<5>(h)), u8, b + x);
    hn::StoreU(noisy(green, hn::ShiftRight<10>(h), hn::ShiftRight<15>(h)), u8, g + x);
    hn::StoreU(noisy(red, hn::ShiftRight<20>(h), hn::ShiftRight<25>(h)), u8, r + x);
  }
}

void StoreBgr(const uint8_t* b, const uint8_t* g, const uint8_t* r, int width, uint8_t* out) {
  const hn::CappedTag<uint8_t, 64> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int x = 0;
  for (; x + lanes <= width; x += lanes) {
    hn::StoreInterleaved3(hn::LoadU(d, b + x), hn::LoadU(d, g + x), hn::LoadU(d, r + x), d, out + 3 * x);
  }
  for (; x < width; ++x) {
    out[3 * x] = b[x];
    out[3 * x + 1] = g[x];
    out[3 * x + 2] = r[x];
  }
}

}  // namespace takt::sim::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::sim {

HWY_EXPORT(DrawPlane);
HWY_EXPORT(DrawCapsule);
HWY_EXPORT(Shade);
HWY_EXPORT(StoreBgr);

void draw_plane(const PlaneSpan& span, float* inverse_depth, int32_t* id) {
  HWY_DYNAMIC_DISPATCH(DrawPlane)(span, inverse_depth, id);
}
void draw_capsule(const CameraCapsule& capsule, const CapsuleSpan& span, float* inverse_depth, int32_t* id,
                  float* gain) {
  HWY_DYNAMIC_DISPATCH(DrawCapsule)(capsule, span, inverse_depth, id, gain);
}
void shade(const ShadeRun& run, const float* inverse_depth, uint8_t* b, uint8_t* g, uint8_t* r) {
  HWY_DYNAMIC_DISPATCH(Shade)(run, inverse_depth, b, g, r);
}
void store_bgr(const uint8_t* b, const uint8_t* g, const uint8_t* r, int width, uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(StoreBgr)(b, g, r, width, out);
}
void store_grey(const uint8_t* b, const uint8_t* g, const uint8_t* r, int width, uint8_t* out) {
  for (int x = 0; x < width; ++x) out[x] = static_cast<uint8_t>((29 * b[x] + 150 * g[x] + 77 * r[x] + 128) >> 8);
}

}  // namespace takt::sim
#endif
