// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/estimator.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace takt::ego_motion {
namespace {

constexpr int kParameters = 6;

Matrix6 to_matrix(const Triangle& triangle) {
  Matrix6 m;
  size_t k = 0;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) m(r, c) = m(c, r) = triangle[k++];
  return m;
}

/// What of the six parameters a model has: all, or t_x, t_z and the rotation about y.
template <int kSize>
using Choice = Eigen::Matrix<double, kSize, 6>;
const Choice<3> kPlanar = [] {
  Choice<3> m = Choice<3>::Zero();
  m(0, 0) = m(1, 2) = m(2, 4) = 1;
  return m;
}();
const Choice<6> kAll = Choice<6>::Identity();

/// Small motion that solves the normal equations in the chosen parameters.
template <int kSize>
std::optional<Twist> solution(const Choice<kSize>& of, const Matrix6& A, const Twist& b) {
  const Eigen::LDLT<Eigen::Matrix<double, kSize, kSize>> ldlt(of * A * of.transpose());
  if (ldlt.info() != Eigen::Success) return std::nullopt;
  const Twist s = of.transpose() * ldlt.solve(of * b);
  return s.allFinite() ? std::optional(s) : std::nullopt;
}

/// H^-1 M H^-1 in the chosen parameters.
template <int kSize>
std::optional<Matrix6> sandwich(const Choice<kSize>& of, const Matrix6& H, const Matrix6& M) {
  const Eigen::LDLT<Eigen::Matrix<double, kSize, kSize>> ldlt(of * H * of.transpose());
  if (ldlt.info() != Eigen::Success || !ldlt.isPositive()) return std::nullopt;
  const Eigen::Matrix<double, kSize, 6> half = ldlt.solve(of);
  const Matrix6 full = of.transpose() * half;
  const Matrix6 covariance = full * M * full.transpose();
  return covariance.allFinite() ? std::optional(covariance) : std::nullopt;
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

// T_true = Exp(error) T gives T_true^-1 = T^-1 Exp(-error): the error changes its axes only, from those of the current
// camera to those of the previous one.
UncertainPose camera_in_previous(const Estimate& estimate) {
  const Rigid motion = estimate.T.inverse();
  Matrix6 axes = Matrix6::Zero();
  axes.topLeftCorner<3, 3>() = axes.bottomRightCorner<3, 3>() = motion.R;
  UncertainPose pose{to_transform(motion), {}};
  const Matrix6 covariance = axes * estimate.covariance * axes.transpose();
  Eigen::Map<Matrix6>(pose.covariance.data()) = 0.5 * (covariance + covariance.transpose());  // equal to the last bit
  return pose;
}

MotionEstimator::MotionEstimator(const EstimatorParameters& parameters, size_t capacity)
    : p_(parameters), all_(capacity), sample_(3), use_(capacity + ObservationTable::kLanes) {}

bool MotionEstimator::solve(const ObservationTable& table, const double* use, bool weighted, int iterations,
                            Rigid& T) const {
  for (int i = 0; i < iterations; ++i) {
    const NormalEquations n = motion_kernels().normal(table, to_array(T), {use, weighted ? scale_px() : 0});
    const Matrix6 A = to_matrix(n.matrix);
    const Twist b = Eigen::Map<const Twist>(n.vector.data());
    const auto s = p_.model == Model::six_dof ? solution(kAll, A, b) : solution(kPlanar, A, b);
    if (!s) return false;
    T = Rigid{rotation(s->tail<3>()), s->head<3>()} * T;
    if (!(T.t.norm() < 100)) return false;
    if (s->head<3>().norm() < 1e-7 && s->tail<3>().norm() < 1e-8) break;
  }
  return true;
}

Rigid MotionEstimator::sample_consensus(std::span<const Observation> all, const Rigid& start, uint64_t seed) {
  constexpr double kUse[ObservationTable::kLanes] = {1, 1, 1};
  Random random(seed);
  // Truncated squares: also prefers the better fit of equally many inliers.
  const auto score = [&](const Rigid& T) { return motion_kernels().score(all_, to_array(T), p_.inlier_px); };
  Rigid best = start;
  Score best_score = score(best);
  double needed = p_.iterations;
  for (int i = 0; i < p_.iterations && i < needed; ++i) {
    const size_t a = random.below(all.size()), b = random.below(all.size()), c = random.below(all.size());
    if (a == b || b == c || a == c) continue;
    const Observation sample[] = {all[a], all[b], all[c]};
    sample_.fill(sample, all_.optics());
    Rigid T = best;
    if (!solve(sample_, kUse, false, 6, T)) continue;
    const Score now = score(T);
    if (now.cost >= best_score.cost) continue;
    best_score = now, best = T;
    const double share = static_cast<double>(now.inside) / static_cast<double>(all.size());
    const double good = share * share * share;
    if (good > 1e-9) needed = good > 0.999 ? 1 : std::log(1 - p_.success) / std::log(1 - good);
  }
  return best;
}

// Huber's sandwich H^-1 M H^-1 (Huber, "Robust Statistics", 1981, 7.6), each corner a cluster of three rows: M is how
// much the gradients g = w J^T r of the corners scatter, so neither the size of the noise nor the ratio of its parts is
// assumed. What all corners have in common does not show in the scatter and is added. H is the exact derivative of sum
// g: with Cauchy weights w = 1 / (1 + r^2/s^2) the normal matrix less 2/s^2 sum g g^T.
std::optional<Matrix6> MotionEstimator::covariance(const Rigid& T, bool weighted) const {
  const Weights weights{use_.data(), weighted ? scale_px() : 0};
  const Scatter scatter = motion_kernels().scatter(all_, to_array(T), weights);
  const Matrix6 A = to_matrix(motion_kernels().normal(all_, to_array(T), weights).matrix);
  const Matrix6 independent = to_matrix(scatter.matrix);
  const Matrix6 H = weighted ? Matrix6(A - 2 / (scale_px() * scale_px()) * independent) : A;
  const auto used =
      static_cast<double>(std::count(use_.begin(), use_.begin() + static_cast<ptrdiff_t>(all_.size()), 1.0));
  if (used <= kParameters) return std::nullopt;
  Matrix6 M = used / (used - kParameters) * independent;
  for (const auto& residual : scatter.shared) {
    const Twist g = p_.shared_px * Eigen::Map<const Twist>(residual.data());
    M += g * g.transpose();
  }
  return p_.model == Model::six_dof ? sandwich(kAll, H, M) : sandwich(kPlanar, H, M);
}

Estimate MotionEstimator::estimate(std::span<const Observation> all, const Optics& optics, const Rigid& start,
                                   uint64_t seed) {
  Estimate e;
  if (all.size() < 4) return e;
  all_.fill(all, optics);
  const auto mark = [&](double limit_px) { motion_kernels().mark(all_, to_array(e.T), limit_px, use_.data()); };
  if (!p_.robust) {
    std::fill(use_.begin(), use_.end(), 1.0);
    if (p_.model == Model::planar) {
      const auto planar = planar_least_squares(all, optics, p_.form);
      if (!planar) return e;
      e.T = to_rigid(*planar);
      // The linear T is off for large turns: finish with the exact rotation.
      const bool large = std::abs(planar->alpha_rad) > 0.05 && p_.form == Form::multiplied;
      if (large && !solve(all_, use_.data(), false, 2, e.T)) return e;
    } else if (!solve(all_, use_.data(), false, 10, e.T = start)) {
      return e;
    }
  } else {
    e.T = sample_consensus(all, start, seed);
    for (int round = 0; round < 3; ++round) {
      mark((round == 0 ? 2.0 : 1.5) * p_.inlier_px);
      if (!solve(all_, use_.data(), true, 5, e.T)) return e;
    }
  }
  const auto found = covariance(e.T, p_.robust);
  const Score score = motion_kernels().score(all_, to_array(e.T), p_.inlier_px);
  if (!found || score.inside == 0) return e;
  e.covariance = *found;
  e.inliers = static_cast<int>(score.inside);
  const double outside = static_cast<double>(all.size() - score.inside) * p_.inlier_px * p_.inlier_px;
  e.rms_px = std::sqrt(std::max(0.0, score.cost - outside) / e.inliers);
  e.solved = true;
  return e;
}

}  // namespace takt::ego_motion
