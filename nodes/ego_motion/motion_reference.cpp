// SPDX-License-Identifier: Apache-2.0
// The table, and the slow versions of its kernels.
#include <algorithm>
#include <limits>

#include "nodes/ego_motion/motion_kernel.hpp"

namespace takt::ego_motion {

ObservationTable::ObservationTable(size_t capacity)
    : stride_((capacity + kLanes - 1) / kLanes * kLanes), values_(columns * stride_) {}

void ObservationTable::fill(std::span<const Observation> observations, const Optics& optics) {
  size_ = std::min(observations.size(), stride_);
  optics_ = optics;
  for (size_t i = 0; i < size_; ++i) {
    const Observation& o = observations[i];
    const Eigen::Vector3d p = point(o, optics);
    const double row[columns] = {
        p.x(), p.y(), p.z(), o.x_current, o.y_current, o.d_current, o.d_current >= 0 ? 1.0 : 0.0};
    for (size_t column = 0; column < columns; ++column) values_[column * stride_ + i] = row[column];
  }
}

Motion12 to_array(const Rigid& motion) {
  Motion12 a;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) a[static_cast<size_t>(3 * r + c)] = motion.R(r, c);
    a[static_cast<size_t>(9 + r)] = motion.t[r];
  }
  return a;
}

namespace {

constexpr size_t kLanes = ObservationTable::kLanes;

/// An observation under T: derivatives of its residuals by a small motion after T (p' = p + v + w x p).
struct Seen {
  bool usable = false;  ///< before the camera
  double x_row[6], y_row[6], d_row[6];
  double rx, ry, rd, square = std::numeric_limits<double>::infinity();
};

Seen look(const ObservationTable& o, const Motion12& T, size_t i) {
  using C = ObservationTable;
  const double px = o[C::x][i], py = o[C::y][i], pz = o[C::z][i], f = o.optics().focal_px, B = o.optics().baseline_m;
  const double x = T[0] * px + T[1] * py + T[2] * pz + T[9], y = T[3] * px + T[4] * py + T[5] * pz + T[10],
               z = T[6] * px + T[7] * py + T[8] * pz + T[11];
  Seen s;
  s.usable = z >= kNearestDepth;
  if (!s.usable) return s;
  const double iz = 1 / z, u = x * iz, v = y * iz, fu = f * u, fv = f * v;
  const double g = o[C::has_d][i] * (kDisparityWeight * f * B) * iz;
  s = {true,
       {f * iz, 0, -(fu * iz), -(fu * v), f + fu * u, -fv},
       {0, f * iz, -(fv * iz), -(f + fv * v), fu * v, fu},
       {0, 0, -(g * iz), -(g * v), g * u, 0},
       o[C::u][i] - f * u,
       o[C::v][i] - f * v,
       o[C::has_d][i] * (kDisparityWeight * (o[C::d][i] - f * B * iz)),
       0};
  s.square = s.rx * s.rx + s.ry * s.ry + s.rd * s.rd;
  return s;
}

double weight(const Seen& s, const Weights& weights, size_t i) {
  if (!s.usable) return 0;
  return weights.scale_px > 0 ? weights.use[i] / (1 + s.square / (weights.scale_px * weights.scale_px))
                              : weights.use[i];
}

double gradient(const Seen& s, double weight, size_t k) {
  return weight * (s.x_row[k] * s.rx + s.y_row[k] * s.ry + s.d_row[k] * s.rd);
}

/// Sum of term(i), observation i in accumulator i mod kLanes.
template <class Term>
double sum(const ObservationTable& o, Term term) {
  double lanes[kLanes] = {};
  for (size_t i = 0; i < o.size(); ++i) lanes[i % kLanes] += term(i);
  return sum_of_lanes(lanes);
}

Score score(const ObservationTable& o, const Motion12& T, double limit_px) {
  Score out;
  for (size_t i = 0; i < o.size(); ++i) out.inside += look(o, T, i).square < limit_px * limit_px;
  out.cost = sum(o, [&](size_t i) { return std::min(limit_px * limit_px, look(o, T, i).square); });
  return out;
}

void mark(const ObservationTable& o, const Motion12& T, double limit_px, double* use) {
  for (size_t i = 0; i < o.size(); ++i) use[i] = look(o, T, i).square < limit_px * limit_px;
}

NormalEquations normal(const ObservationTable& o, const Motion12& T, const Weights& weights) {
  NormalEquations n;
  size_t k = 0;
  for (size_t r = 0; r < 6; ++r) {
    for (size_t c = r; c < 6; ++c)
      n.matrix[k++] = sum(o, [&](size_t i) {
        const Seen s = look(o, T, i);
        if (!s.usable) return 0.0;
        return weight(s, weights, i) * (s.x_row[r] * s.x_row[c] + s.y_row[r] * s.y_row[c] + s.d_row[r] * s.d_row[c]);
      });
    n.vector[r] = sum(o, [&](size_t i) {
      const Seen s = look(o, T, i);
      return s.usable ? gradient(s, weight(s, weights, i), r) : 0;
    });
  }
  return n;
}

Scatter scatter(const ObservationTable& o, const Motion12& T, const Weights& weights) {
  Scatter m;
  size_t k = 0;
  for (size_t r = 0; r < 6; ++r) {
    for (size_t c = r; c < 6; ++c)
      m.matrix[k++] = sum(o, [&](size_t i) {
        const Seen s = look(o, T, i);
        const double w = weight(s, weights, i);
        return s.usable ? gradient(s, w, r) * gradient(s, w, c) : 0;
      });
    for (size_t residual = 0; residual < 3; ++residual)
      m.shared[residual][r] = sum(o, [&](size_t i) {
        const Seen s = look(o, T, i);
        const double* rows[] = {s.x_row, s.y_row, s.d_row};
        return s.usable ? weight(s, weights, i) * rows[residual][r] : 0;
      });
  }
  return m;
}

}  // namespace

const MotionKernels& motion_references() {
  static const MotionKernels table{score, mark, normal, scatter};
  return table;
}

}  // namespace takt::ego_motion
