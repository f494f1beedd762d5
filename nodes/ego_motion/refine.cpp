// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/refine.hpp"

#include <cmath>

namespace takt::ego_motion {
namespace {

constexpr int kIterations = 8;
constexpr double kStop = 0.005;  // px

struct Weights {
  float a, b, c, d;
};

Weights weights(double fx, double fy) {
  return {static_cast<float>((1 - fx) * (1 - fy)), static_cast<float>(fx * (1 - fy)), static_cast<float>((1 - fx) * fy),
          static_cast<float>(fx * fy)};
}

// Whether the square of +-half around (x, y), with one more pixel for interpolation, lies inside.
bool inside(const Plane& image, double x, double y, int half) {
  return x >= half && y >= half && x < image.width() - 1 - half && y < image.height() - 1 - half;
}

}  // namespace

bool RefinePatch::take(const Plane& image, double x, double y, int half) {
  if (!inside(image, x, y, half + 1)) return false;
  half_ = half;
  const int size = 2 * half + 1;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const Weights w = weights(x - x0, y - y0);
  float sample[17][kRow + 2];  // one more on each side for central differences; columns beyond the patch are not used
  for (int v = 0; v < size + 2; ++v) {
    const uint8_t* p = image.row(y0 - half - 1 + v) + x0 - half - 1;
    const uint8_t* q = p + image.stride();
    for (int u = 0; u < kRow + 2; ++u) sample[v][u] = w.a * p[u] + w.b * p[u + 1] + w.c * q[u] + w.d * q[u + 1];
  }
  float in[kRow];
  for (int u = 0; u < kRow; ++u) in[u] = u < size ? 1.0f : 0.0f;
  // Column-wise accumulators, as in sums().
  float column_x[kRow] = {}, column_y[kRow] = {};
  for (int v = 0; v < size; ++v)
    for (int u = 0; u < kRow; ++u) {
      value_[v][u] = sample[v + 1][u + 1];
      gx_[v][u] = 0.5f * in[u] * (sample[v + 1][u + 2] - sample[v + 1][u]);
      gy_[v][u] = 0.5f * in[u] * (sample[v + 2][u + 1] - sample[v][u + 1]);
      column_x[u] += gx_[v][u];
      column_y[u] += gy_[v][u];
    }
  float mean_x = 0, mean_y = 0;
  for (int u = 0; u < kRow; ++u) mean_x += column_x[u], mean_y += column_y[u];
  mean_x /= static_cast<float>(size * size);
  mean_y /= static_cast<float>(size * size);
  float xx[kRow] = {}, xy[kRow] = {}, yy[kRow] = {};
  for (int v = 0; v < size; ++v)
    for (int u = 0; u < kRow; ++u) {
      const float x_gradient = gx_[v][u] - in[u] * mean_x, y_gradient = gy_[v][u] - in[u] * mean_y;
      gx_[v][u] = x_gradient;
      gy_[v][u] = y_gradient;
      xx[u] += x_gradient * x_gradient;
      xy[u] += x_gradient * y_gradient;
      yy[u] += y_gradient * y_gradient;
    }
  xx_ = xy_ = yy_ = 0;
  for (int u = 0; u < kRow; ++u) xx_ += xx[u], xy_ += xy[u], yy_ += yy[u];
  return true;
}

bool RefinePatch::sums(const Plane& image, double x, double y, Sums& out) const {
  if (!inside(image, x, y, half_)) return false;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const Weights w = weights(x - x0, y - y0);
  // One accumulator per column: the order of additions is fixed, whatever the vector width.
  float sum_x[kRow] = {}, sum_y[kRow] = {};
  for (int v = 0; v <= 2 * half_; ++v) {
    const uint8_t* p = image.row(y0 - half_ + v) + x0 - half_;
    const uint8_t* q = p + image.stride();
    for (int u = 0; u < kRow; ++u) {
      const float difference = w.a * p[u] + w.b * p[u + 1] + w.c * q[u] + w.d * q[u + 1] - value_[v][u];
      sum_x[u] += gx_[v][u] * difference;
      sum_y[u] += gy_[v][u] * difference;
    }
  }
  for (int u = 0; u < kRow; ++u) out.x += sum_x[u], out.y += sum_y[u];
  return true;
}

SubPixel RefinePatch::refine(const Plane& image, double x, double y, double limit_px) const {
  SubPixel at{x, y, false};
  const double determinant = static_cast<double>(xx_) * yy_ - static_cast<double>(xy_) * xy_;
  if (determinant < 1e-3 * (static_cast<double>(xx_) + yy_) * (static_cast<double>(xx_) + yy_) || xx_ + yy_ < 100)
    return at;
  for (int i = 0; i < kIterations; ++i) {
    Sums s;
    if (!sums(image, at.x, at.y, s)) return at;
    const double dx = (static_cast<double>(yy_) * s.x - static_cast<double>(xy_) * s.y) / determinant;
    const double dy = (static_cast<double>(xx_) * s.y - static_cast<double>(xy_) * s.x) / determinant;
    at.x -= dx;
    at.y -= dy;
    if (!(std::abs(at.x - x) <= limit_px && std::abs(at.y - y) <= limit_px)) return at;
    if (dx * dx + dy * dy < kStop * kStop) break;
  }
  at.converged = true;
  return at;
}

SubPixel RefinePatch::refine_in_row(const Plane& image, double x, double y, double limit_px) const {
  SubPixel at{x, y, false};
  if (xx_ < 50) return at;
  for (int i = 0; i < kIterations; ++i) {
    Sums s;
    if (!sums(image, at.x, at.y, s)) return at;
    const double dx = static_cast<double>(s.x) / xx_;
    at.x -= dx;
    if (!(std::abs(at.x - x) <= limit_px)) return at;
    if (std::abs(dx) < kStop) break;
  }
  at.converged = true;
  return at;
}

}  // namespace takt::ego_motion
