// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_pose/pose_filter.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "rt/time/units.hpp"

namespace takt::robot_pose {
namespace {

constexpr int kSpeed = 3, kTurn = 4;

/// Where the pose stands in the state that a source's next measurement starts from.
int clone_at(Source source) { return 5 + 3 * static_cast<int>(source); }

}  // namespace

PoseFilter::PoseFilter(const FilterParameters& parameters, size_t history) : p_(parameters), history_(history) {
  entries_.reserve(history + 1);
  base_.cloned_ns.fill(INT64_MIN);
}

void PoseFilter::remember(StateArchive& archive) {
  TAKT_STATE(archive, begun_, base_, entries_);
  if (archive.loads() && entries_.size() > history_) archive.fail();
}

void PoseFilter::begin_at(const PlanarPose& robot_in_map, const Covariance& covariance) {
  base_.mean.head<3>() << robot_in_map.x_m, robot_in_map.y_m, robot_in_map.theta_rad;
  base_.covariance.topLeftCorner<3, 3>() = covariance;
}

// The robot drives along its y axis: speed v, turn rate w, constant but for white noise on their derivatives.
//   theta' = theta + w t,  (x, y)' = (x, y) + v t (-sin m, cos m),  m = theta + w t / 2
void PoseFilter::predict(State& state, int64_t stamp_ns) const {
  const double t = to_seconds(stamp_ns - state.stamp_ns);
  state.stamp_ns = stamp_ns;
  if (t <= 0) return;
  const double v = state.mean(kSpeed), w = state.mean(kTurn), middle = state.mean(2) + w * t / 2;
  const Eigen::Vector2d ahead(-std::sin(middle), std::cos(middle)), right(std::cos(middle), std::sin(middle));
  state.mean.head<2>() += v * t * ahead;
  state.mean(2) = wrapped(state.mean(2) + w * t);

  Matrix by_state = Matrix::Identity();
  by_state.block<2, 1>(0, 2) = -v * t * right;  // d ahead / d middle = -right
  by_state.block<2, 1>(0, kSpeed) = t * ahead;
  by_state.block<2, 1>(0, kTurn) = -v * t * t / 2 * right;
  by_state(2, kTurn) = t;
  state.covariance = by_state * state.covariance * by_state.transpose();

  // White acceleration over t: variance q t^3 / 3 of the place, q t of the speed, q t^2 / 2 between them (Bar-Shalom,
  // Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001, 6.2.2).
  const double q = p_.acceleration * p_.acceleration, q_turn = p_.turn_acceleration * p_.turn_acceleration;
  Matrix& c = state.covariance;
  c.topLeftCorner<2, 2>() +=
      q * t * t * t / 3 * ahead * ahead.transpose() + p_.slip * p_.slip * t * right * right.transpose();
  c.block<2, 1>(0, kSpeed) += q * t * t / 2 * ahead;
  c.block<1, 2>(kSpeed, 0) += q * t * t / 2 * ahead.transpose();
  c(kSpeed, kSpeed) += q * t;
  c(2, 2) += q_turn * t * t * t / 3;
  c(2, kTurn) += q_turn * t * t / 2;
  c(kTurn, 2) += q_turn * t * t / 2;
  c(kTurn, kTurn) += q_turn * t;
}

/// The present pose becomes the one that the source's next measurement starts from.
void PoseFilter::clone(State& state, Source source) {
  const int at = clone_at(source);
  state.mean.segment<3>(at) = state.mean.head<3>();
  const Matrix& c = state.covariance;
  const Eigen::Matrix<double, 3, kSize> rows = c.topRows<3>();
  state.covariance.middleRows<3>(at) = rows;
  state.covariance.middleCols<3>(at) = rows.transpose();
  state.covariance.block<3, 3>(at, at) = rows.leftCols<3>();
  state.cloned_ns[static_cast<size_t>(source)] = state.stamp_ns;
}

/// Measured is the present pose in the clone's frame. False if the gate keeps it out.
bool PoseFilter::update(State& state, const Measured& measured) const {
  const int at = clone_at(measured.source);
  const PlanarPose then{state.mean(at), state.mean(at + 1), state.mean(at + 2)};
  const PlanarPose now{state.mean(0), state.mean(1), state.mean(2)};
  const PlanarPose expected = between(then, now);
  const double c = std::cos(then.theta_rad), s = std::sin(then.theta_rad);
  Eigen::Matrix3d to_then;
  to_then << c, s, 0, -s, c, 0, 0, 0, 1;
  Eigen::Matrix<double, 3, kSize> by_state = Eigen::Matrix<double, 3, kSize>::Zero();
  by_state.leftCols<3>() = to_then;
  by_state.block<3, 3>(0, at) = -to_then;
  by_state(0, at + 2) = expected.y_m;
  by_state(1, at + 2) = -expected.x_m;

  const PlanarPose& z = measured.robot_in_previous;
  const Eigen::Vector3d innovation(z.x_m - expected.x_m, z.y_m - expected.y_m,
                                   wrapped(z.theta_rad - expected.theta_rad));
  const Eigen::Matrix<double, kSize, 3> cross = state.covariance * by_state.transpose();
  const Eigen::LLT<Eigen::Matrix3d> spread(by_state * cross + measured.covariance);
  const double distance = innovation.dot(spread.solve(innovation));
  if (spread.info() != Eigen::Success || !std::isfinite(distance)) return false;  // damaged, and never believed
  const bool trusted = to_seconds(state.stamp_ns - state.used_ns) <= p_.trust_s;
  if (trusted && distance > p_.gate) return false;

  const Eigen::Matrix<double, kSize, 3> gain = spread.solve(cross.transpose()).transpose();
  state.mean += gain * innovation;
  for (int angle = 2; angle < kSize; angle = angle == 2 ? kNow + 2 : angle + 3)
    state.mean(angle) = wrapped(state.mean(angle));
  // Joseph's form keeps it positive.
  const Matrix rest = Matrix::Identity() - gain * by_state;
  state.covariance = rest * state.covariance * rest.transpose() + gain * measured.covariance * gain.transpose();
  state.used_ns = state.stamp_ns;
  return true;
}

Taken PoseFilter::process(State& state, const Measured& measured) const {
  predict(state, measured.to_ns);
  const bool joined = measured.valid && state.cloned_ns[static_cast<size_t>(measured.source)] == measured.from_ns;
  const Taken taken = !joined ? Taken::begun : update(state, measured) ? Taken::used : Taken::rejected;
  // What rounding makes unequal about the diagonal would grow with every update.
  state.covariance = (0.5 * (state.covariance + state.covariance.transpose())).eval();
  clone(state, measured.source);
  return taken;
}

bool PoseFilter::before(const Measured& a, const Measured& b) {
  return std::tie(a.to_ns, a.source) < std::tie(b.to_ns, b.source);
}

Taken PoseFilter::add(const Measured& measured) {
  if (!begun_) {
    base_.stamp_ns = base_.used_ns = measured.from_ns;
    base_.covariance(kSpeed, kSpeed) = p_.begin_speed_m_s * p_.begin_speed_m_s;
    base_.covariance(kTurn, kTurn) = p_.begin_turn_rad_s * p_.begin_turn_rad_s;
    clone(base_, measured.source);
    begun_ = true;
  }
  const auto at = std::upper_bound(entries_.begin(), entries_.end(), measured,
                                   [](const Measured& m, const Entry& entry) { return before(m, entry.measured); });
  const bool known = at != entries_.begin() && !before((at - 1)->measured, measured);
  if (known || measured.to_ns < base_.stamp_ns) return Taken::too_late;
  const auto changed = entries_.insert(at, Entry{measured, at == entries_.begin() ? base_ : (at - 1)->after});
  const Taken taken = process(changed->after, measured);
  for (auto later = changed + 1; later != entries_.end(); ++later) {
    later->after = (later - 1)->after;
    process(later->after, later->measured);
  }
  if (entries_.size() > history_) {
    base_ = entries_.front().after;
    entries_.erase(entries_.begin());
  }
  return taken;
}

Estimate PoseFilter::estimate(const State& state) {
  return {state.stamp_ns,
          {state.mean(0), state.mean(1), state.mean(2)},
          state.covariance.topLeftCorner<3, 3>(),
          state.mean(kSpeed),
          state.mean(kTurn)};
}

Estimate PoseFilter::newest() const { return estimate(last()); }

Estimate PoseFilter::predicted(int64_t stamp_ns) const {
  State state = last();
  predict(state, stamp_ns);
  return estimate(state);
}

Covariance step_covariance(const UncertainPose& from, const UncertainPose& to) {
  const PlanarPose a = scan_matching::planar(from.transform), b = scan_matching::planar(to.transform);
  // compose: C_to = J C_from J^T + R C_step R^T, J moving errors along the arm from a to b.
  Covariance along = Covariance::Identity();
  along(0, 2) = -(b.y_m - a.y_m);
  along(1, 2) = b.x_m - a.x_m;
  const Covariance rest =
      scan_matching::planar(to.covariance) - along * scan_matching::planar(from.covariance) * along.transpose();
  return scan_matching::turned(0.5 * (rest + rest.transpose()), -a.theta_rad);
}

}  // namespace takt::robot_pose
