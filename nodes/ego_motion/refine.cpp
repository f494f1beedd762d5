// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/refine.hpp"

#include <cmath>

#include "nodes/ego_motion/refine_kernel.hpp"

namespace takt::ego_motion {
namespace {

constexpr int kIterations = 8;
constexpr double kStop = 0.005;            // px
constexpr float kLeastTexture = 50;        // of gx^2 summed over the patch
constexpr double kLeastCornerness = 1e-3;  // determinant over squared trace
constexpr float kLeastGain = 0.5, kMostGain = 2;

// Whether the square of +-half around (x, y), with one more pixel for interpolation, lies inside.
bool inside(const Plane& image, double x, double y, int half) {
  return x >= half && y >= half && x < image.width() - 1 - half && y < image.height() - 1 - half;
}

// The references ---------------------------------------------------------------------------------------------------

using Samples = RefinePatch::Samples;

float bilinear(const BilinearOrigin& at, int u, int v) {
  const uint8_t* above = at.pixel + v * at.stride + u;
  const uint8_t* below = above + at.stride;
  const float upper = (1 - at.fx) * above[0] + at.fx * above[1], lower = (1 - at.fx) * below[0] + at.fx * below[1];
  return (1 - at.fy) * upper + at.fy * lower;
}

/// Sum of term(u, v) over the patch.
template <class Term>
float sum(int size, Term term) {
  float columns[RefinePatch::kRow] = {};
  for (int v = 0; v < size; ++v)
    for (int u = 0; u < size; ++u) columns[u] += term(u, v);
  return sum_of_columns(columns);
}

void take_reference(const BilinearOrigin& at, Samples& out) {
  const int size = 2 * out.half + 1;
  for (int v = 0; v < size; ++v)
    for (int u = 0; u < RefinePatch::kRow; ++u) {
      const bool used = u < size;
      out.value[v][u] = used ? bilinear(at, u + 1, v + 1) : 0;
      out.gx[v][u] = used ? 0.5f * (bilinear(at, u + 2, v + 1) - bilinear(at, u, v + 1)) : 0;
      out.gy[v][u] = used ? 0.5f * (bilinear(at, u + 1, v + 2) - bilinear(at, u + 1, v)) : 0;
    }
  const auto count = static_cast<float>(size * size);
  const float mean = sum(size, [&](int u, int v) { return out.value[v][u]; }) / count;
  for (int v = 0; v < size; ++v)
    for (int u = 0; u < size; ++u) out.value[v][u] -= mean;
  out.square = sum(size, [&](int u, int v) { return out.value[v][u] * out.value[v][u]; });
  for (auto* gradient : {&out.gx, &out.gy}) {
    const float mean_gradient = sum(size, [&](int u, int v) { return (*gradient)[v][u]; }) / count;
    const float along = sum(size, [&](int u, int v) { return (*gradient)[v][u] * out.value[v][u]; });
    const float share = out.square > 0 ? along / out.square : 0;
    for (int v = 0; v < size; ++v)
      for (int u = 0; u < size; ++u) (*gradient)[v][u] = ((*gradient)[v][u] - mean_gradient) - share * out.value[v][u];
  }
  out.xx = sum(size, [&](int u, int v) { return out.gx[v][u] * out.gx[v][u]; });
  out.xy = sum(size, [&](int u, int v) { return out.gx[v][u] * out.gy[v][u]; });
  out.yy = sum(size, [&](int u, int v) { return out.gy[v][u] * out.gy[v][u]; });
}

float sum_x_reference(const Samples& patch, const BilinearOrigin& at) {
  return sum(2 * patch.half + 1, [&](int u, int v) { return patch.gx[v][u] * bilinear(at, u, v); });
}

float sum_value_reference(const Samples& patch, const BilinearOrigin& at) {
  return sum(2 * patch.half + 1, [&](int u, int v) { return patch.value[v][u] * bilinear(at, u, v); });
}

void sums_reference(const Samples& patch, const BilinearOrigin& at, float& x, float& y) {
  x = sum_x_reference(patch, at);
  y = sum(2 * patch.half + 1, [&](int u, int v) { return patch.gy[v][u] * bilinear(at, u, v); });
}

/// Whether the image shows the patch there, and not something else that its gradients do not see.
bool shows(const Plane& image, const SubPixel& at, const RefineKernels& kernels, const Samples& patch) {
  if (!inside(image, at.x, at.y, patch.half)) return false;
  const float gain = kernels.sum_value(patch, origin(image, at.x, at.y, -patch.half, -patch.half)) / patch.square;
  return gain >= kLeastGain && gain <= kMostGain;
}

}  // namespace

const RefineKernels& refine_references() {
  static const RefineKernels table{take_reference, sums_reference, sum_x_reference, sum_value_reference};
  return table;
}

bool RefinePatch::take(const Plane& image, double x, double y, int half) {
  if (!inside(image, x, y, half + 1)) return false;
  samples_.half = half;
  kernels_.take(origin(image, x, y, -half - 1, -half - 1), samples_);
  return true;
}

SubPixel RefinePatch::refine(const Plane& image, double x, double y, double limit_px) const {
  SubPixel at{x, y, false};
  const double xx = samples_.xx, xy = samples_.xy, yy = samples_.yy, determinant = xx * yy - xy * xy;
  if (xx + yy < 2 * kLeastTexture || determinant < kLeastCornerness * (xx + yy) * (xx + yy)) return at;
  const int half = samples_.half;
  for (int i = 0; i < kIterations; ++i) {
    if (!inside(image, at.x, at.y, half)) return at;
    float x_sum = 0, y_sum = 0;
    kernels_.sums(samples_, origin(image, at.x, at.y, -half, -half), x_sum, y_sum);
    const double dx = (yy * x_sum - xy * y_sum) / determinant, dy = (xx * y_sum - xy * x_sum) / determinant;
    at.x -= dx;
    at.y -= dy;
    if (!(std::abs(at.x - x) <= limit_px && std::abs(at.y - y) <= limit_px)) return at;
    if (dx * dx + dy * dy < kStop * kStop) break;
  }
  at.converged = shows(image, at, kernels_, samples_);
  return at;
}

SubPixel RefinePatch::refine_in_row(const Plane& image, double x, double y, double limit_px) const {
  SubPixel at{x, y, false};
  if (samples_.xx < kLeastTexture) return at;
  const int half = samples_.half;
  for (int i = 0; i < kIterations; ++i) {
    if (!inside(image, at.x, at.y, half)) return at;
    const double dx =
        static_cast<double>(kernels_.sum_x(samples_, origin(image, at.x, at.y, -half, -half))) / samples_.xx;
    at.x -= dx;
    if (!(std::abs(at.x - x) <= limit_px)) return at;
    if (std::abs(dx) < kStop) break;
  }
  at.converged = shows(image, at, kernels_, samples_);
  return at;
}

}  // namespace takt::ego_motion
