// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace takt::ego_motion {
namespace {

constexpr double kDisparityWeight = 0.70710678118654752;  // 1/sqrt(2), see residual_px
constexpr double kMinimumDisparity = 0.1;                 // px; beyond it depth is noise

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

/// Moves the previous side of an observation by T; false behind the camera.
bool moved(const Observation& o, const Optics& c, const Rigid& T, Observation& out) {
  const double s = c.baseline_m / std::max(o.d, kMinimumDisparity);
  const Eigen::Vector3d p = T * Eigen::Vector3d(o.x * s, o.y * s, c.focal_px * s);
  if (p.z() < 0.05) return false;
  out = {c.focal_px * p.x() / p.z(),
         c.focal_px * p.y() / p.z(),
         c.focal_px * c.baseline_m / p.z(),
         o.x_current,
         o.y_current,
         o.d_current};
  return true;
}

struct Normal6 {
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  Twist b = Twist::Zero();
  void add(const Twist& row, double residual, double weight) {
    A.noalias() += (weight * row) * row.transpose();
    b.noalias() += (weight * residual) * row;
  }
};

// One corner's rows for a small motion applied after T: p' = p + v + w x p.
void add_rows(Normal6& n, const Observation& o, const Optics& c, const Rigid& T, bool weighted, double scale_px) {
  const double s = c.baseline_m / std::max(o.d, kMinimumDisparity);
  const Eigen::Vector3d p = T * Eigen::Vector3d(o.x * s, o.y * s, c.focal_px * s);
  if (p.z() < 0.05) return;
  const double iz = 1 / p.z(), f = c.focal_px, u = p.x() * iz, v = p.y() * iz;
  const double rx = o.x_current - f * u, ry = o.y_current - f * v;
  const bool has_d = o.d_current >= 0;
  const double rd = has_d ? kDisparityWeight * (o.d_current - f * c.baseline_m * iz) : 0;
  double weight = 1;
  if (weighted) {  // Cauchy: a residual of the scale counts half
    const double e = (rx * rx + ry * ry + rd * rd) / (scale_px * scale_px);
    weight = 1 / (1 + e);
  }
  Twist jx, jy, jd;
  jx << f * iz, 0, -f * u * iz, -f * u * v, f * (1 + u * u), -f * v;
  jy << 0, f * iz, -f * v * iz, -f * (1 + v * v), f * u * v, f * u;
  n.add(jx, rx, weight);
  n.add(jy, ry, weight);
  if (!has_d) return;
  const double g = kDisparityWeight * f * c.baseline_m * iz;
  jd << 0, 0, -g * iz, -g * v, g * u, 0;
  n.add(jd, rd, weight);
}

class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ull + 0xD1B54A32D192ED03ull) {}
  size_t below(size_t n) {
    state_ ^= state_ << 13, state_ ^= state_ >> 7, state_ ^= state_ << 17;
    return static_cast<size_t>((state_ >> 33) % n);
  }

 private:
  uint64_t state_;
};

}  // namespace

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

double residual_px(const Rigid& T, const Observation& o, const Optics& optics) {
  Observation p;
  if (!moved(o, optics, T, p)) return std::numeric_limits<double>::infinity();
  const double rx = o.x_current - p.x, ry = o.y_current - p.y;
  const double rd = o.d_current >= 0 ? kDisparityWeight * (o.d_current - p.d) : 0;
  return std::sqrt(rx * rx + ry * ry + rd * rd);
}

bool MotionEstimator::solve(std::span<const Observation> observations, const Optics& optics, bool weighted,
                            int iterations, Rigid& T) const {
  for (int i = 0; i < iterations; ++i) {
    Normal6 n;
    for (const Observation& o : observations) add_rows(n, o, optics, T, weighted, 0.5 * p_.inlier_px);
    Rigid step;
    if (p_.model == Model::six_dof) {
      const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> ldlt(n.A);
      if (ldlt.info() != Eigen::Success) return false;
      const Twist s = ldlt.solve(n.b);
      if (!s.allFinite()) return false;
      step = {rotation(s.tail<3>()), s.head<3>()};
    } else {  // columns t_x, t_z and the rotation about y only
      const int k[3] = {0, 2, 4};
      Eigen::Matrix3d A;
      Eigen::Vector3d b;
      for (int r = 0; r < 3; ++r) {
        b[r] = n.b[k[r]];
        for (int c = 0; c < 3; ++c) A(r, c) = n.A(k[r], k[c]);
      }
      const Eigen::LDLT<Eigen::Matrix3d> ldlt(A);
      const Eigen::Vector3d s = ldlt.solve(b);
      if (ldlt.info() != Eigen::Success || !s.allFinite()) return false;
      step = to_rigid({s[2], s[0], s[1]});
    }
    T = step * T;
    if (!(T.t.norm() < 100)) return false;
    if (step.t.norm() < 1e-7 && rotation_vector(step.R).norm() < 1e-8) break;
  }
  return true;
}

Rigid MotionEstimator::sample_consensus(std::span<const Observation> all, const Optics& optics, const Rigid& start,
                                        uint64_t seed) {
  Random random(seed);
  const auto score = [&](const Rigid& T) {  // truncated squares: also prefers the better fit of equally many inliers
    const double limit = p_.inlier_px * p_.inlier_px;
    double cost = 0;
    size_t inside = 0;
    for (const Observation& o : all) {
      const double r = residual_px(T, o, optics);
      inside += r < p_.inlier_px;
      cost += std::min(limit, r * r);
    }
    return std::pair{cost, inside};
  };
  Rigid best = start;
  auto [best_cost, best_inside] = score(best);
  double needed = p_.iterations;
  for (int i = 0; i < p_.iterations && i < needed; ++i) {
    Observation sample[3];
    const size_t a = random.below(all.size()), b = random.below(all.size()), c = random.below(all.size());
    if (a == b || b == c || a == c) continue;
    sample[0] = all[a], sample[1] = all[b], sample[2] = all[c];
    Rigid T = best;
    if (!solve(sample, optics, false, 6, T)) continue;
    const auto [cost, inside] = score(T);
    if (cost >= best_cost) continue;
    best_cost = cost, best_inside = inside, best = T;
    const double share = static_cast<double>(best_inside) / static_cast<double>(all.size());
    const double good = share * share * share;
    if (good > 1e-9) needed = good > 0.999 ? 1 : std::log(1 - p_.success) / std::log(1 - good);
  }
  return best;
}

void MotionEstimator::collect(std::span<const Observation> all, const Optics& optics, const Rigid& T, double limit_px) {
  inliers_.clear();
  for (const Observation& o : all)
    if (residual_px(T, o, optics) < limit_px) inliers_.push_back(o);
}

Estimate MotionEstimator::estimate(std::span<const Observation> all, const Optics& optics, const Rigid& start,
                                   uint64_t seed) {
  Estimate e;
  if (all.size() < 4) return e;
  if (!p_.robust) {
    if (p_.model == Model::planar) {
      const auto planar = planar_least_squares(all, optics, p_.form);
      if (!planar) return e;
      e.T = to_rigid(*planar);
      // The linear T is off for large turns: finish with the exact rotation (algorithm reference, 8.2).
      if (std::abs(planar->alpha_rad) > 0.05 && p_.form == Form::multiplied && !solve(all, optics, false, 2, e.T))
        return e;
    } else if (!solve(all, optics, false, 10, e.T = start)) {
      return e;
    }
  } else {
    e.T = sample_consensus(all, optics, start, seed);
    for (int round = 0; round < 3; ++round) {
      collect(all, optics, e.T, (round == 0 ? 2.0 : 1.5) * p_.inlier_px);
      if (inliers_.size() < 4 || !solve(inliers_, optics, true, 5, e.T)) return e;
    }
  }
  double sum = 0;
  for (const Observation& o : all) {
    const double r = residual_px(e.T, o, optics);
    if (r >= p_.inlier_px) continue;
    ++e.inliers;
    sum += r * r;
  }
  e.rms_px = e.inliers ? std::sqrt(sum / e.inliers) : 0;
  e.solved = e.inliers > 0;
  return e;
}

}  // namespace takt::ego_motion
