// SPDX-License-Identifier: Apache-2.0
// Inner loops of the renderer, dispatched at run time to the widest SIMD target of the machine. They use neither fused
// multiply-add nor reciprocal estimates, so that every target gives the same bytes.
#pragma once
#include <cstdint>

namespace takt::sim {

/// Elements that a kernel may read and write beyond the end of a row buffer.
constexpr int kRowPadding = 64;

/// Inverse depth a x + row over pixels [x0, x1): wins where it exceeds what is there.
struct PlaneSpan {
  int x0 = 0, x1 = 0;
  float a = 0, row = 0;
  int32_t id = 0;
};
void draw_plane(const PlaneSpan& span, float* inverse_depth, int32_t* id);

/// Capsule in camera coordinates (z forward, unit: m).
struct CameraCapsule {
  float a[3], axis[3];  ///< end point, vector to the other end
  float radius = 0;
  float axis_axis = 0;  ///< axis . axis
  float a_axis = 0;     ///< -a . axis
  float a_a = 0;        ///< a . a
  float light[3];       ///< unit vector towards the light
};
struct CapsuleSpan {
  int x0 = 0, x1 = 0;
  float ray_x_step = 0, ray_x_start = 0;  ///< ray x of pixel x: x * step + start
  float ray_y = 0;
  int32_t id = 0;
};
void draw_capsule(const CameraCapsule& capsule, const CapsuleSpan& span, float* inverse_depth, int32_t* id,
                  float* gain);

/// Texturing of a run of pixels of one surface: u = u0 + z (ua x + ub), the same for v; all in texels of `level`.
struct ShadeRun {
  int x0 = 0, count = 0;  ///< up to 16 pixels
  float ua = 0, ub = 0, u0 = 0, va = 0, vb = 0, v0 = 0;
  const uint32_t* level = nullptr;  ///< tiled as in Texture
  int32_t size = 0;                 ///< of the level, a power of two, at least 4
  float gain = 1;
  const float* gain_row = nullptr;  ///< per-pixel factor, or null
  uint32_t noise_seed = 0;          ///< of this row of this frame
  float read_noise = 0;             ///< standard deviation in levels, of darkness
  float photon_noise = 0;           ///< variance per level of brightness
};
constexpr int kShadeBlock = 16;
void shade(const ShadeRun& run, const float* inverse_depth, uint8_t* b, uint8_t* g, uint8_t* r);

/// Planar row -> BGR interleaved, or grey by the BT.601 weights.
void store_bgr(const uint8_t* b, const uint8_t* g, const uint8_t* r, int width, uint8_t* out);
void store_grey(const uint8_t* b, const uint8_t* g, const uint8_t* r, int width, uint8_t* out);

}  // namespace takt::sim
