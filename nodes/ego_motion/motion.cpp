// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace takt::ego_motion {
namespace {

struct Normal3 {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  void add(double a, double x, double z, double rhs) {
    const Eigen::Vector3d row(a, x, z);
    A.noalias() += row * row.transpose();
    b.noalias() += row * rhs;
  }
};

// Thesis Eq. 4.13 / C.6 multiplied by xc/f, yc/f and dc/f; x and d without index are the previous frame's (E-23).
void add_multiplied(Normal3& n, const Observation& o, double f, double B) {
  n.add(-(f + o.x * o.x_current / f), -o.d / B, o.x_current * o.d / (f * B), o.x - o.x_current);
  n.add(-o.x * o.y_current / f, 0, o.y_current * o.d / (f * B), o.y - o.y_current);
  if (o.d_current >= 0) n.add(-o.x * o.d_current / f, 0, o.d_current * o.d / (f * B), o.d - o.d_current);
}

// As printed; rows whose denominator is zero cannot be written down and are left out.
void add_division(Normal3& n, const Observation& o, double f, double B) {
  if (o.x_current != 0)
    n.add(-(o.x + f * f / o.x_current), -f * o.d / (B * o.x_current), o.d / B, f * (o.x / o.x_current - 1));
  if (o.y_current != 0) n.add(-o.x, 0, o.d / B, f * (o.y / o.y_current - 1));
  if (o.d_current > 0) n.add(-o.x, 0, o.d / B, f * (o.d / o.d_current - 1));
}

}  // namespace

Eigen::Vector3d point(const Observation& o, const Optics& c) {
  const double s = c.baseline_m / std::max(o.d, kLeastDisparity);
  return {o.x * s, o.y * s, c.focal_px * s};
}

std::optional<PlanarMotion> planar_least_squares(std::span<const Observation> observations, const Optics& optics,
                                                 Form form) {
  Normal3 n;
  for (const Observation& o : observations) {
    if (form == Form::multiplied) add_multiplied(n, o, optics.focal_px, optics.baseline_m);
    else add_division(n, o, optics.focal_px, optics.baseline_m);
  }
  if (observations.size() < 2) return std::nullopt;
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(n.A);
  if (ldlt.info() != Eigen::Success || !(ldlt.rcond() > 1e-14)) return std::nullopt;
  const Eigen::Vector3d s = ldlt.solve(n.b);
  if (!s.allFinite()) return std::nullopt;
  return PlanarMotion{s[0], s[1], s[2]};
}

Rigid to_rigid(const PlanarMotion& m) {
  return {rotation(Eigen::Vector3d(0, m.alpha_rad, 0)), Eigen::Vector3d(m.tx_m, 0, m.tz_m)};
}

double residual_px(const Rigid& T, const Observation& o, const Optics& c) {
  const Eigen::Vector3d p = T * point(o, c);
  if (p.z() < kNearestDepth) return std::numeric_limits<double>::infinity();
  const double rx = o.x_current - c.focal_px * p.x() / p.z(), ry = o.y_current - c.focal_px * p.y() / p.z();
  const double rd = o.d_current >= 0 ? kDisparityWeight * (o.d_current - c.focal_px * c.baseline_m / p.z()) : 0;
  return std::sqrt(rx * rx + ry * ry + rd * rd);
}

}  // namespace takt::ego_motion
