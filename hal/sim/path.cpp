// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/path.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace takt::sim {
namespace {

constexpr int kSamplesPerSegment = 256;

/// Slopes at the knots of a cubic spline with uniform parameter: D[i-1] + 4 D[i] + D[i+1] = 3 (p[i+1] - p[i-1]), cyclic
/// for a loop, natural at open ends. Paths have a handful of knots: a dense solve is fine.
Eigen::VectorXd slopes(const Eigen::VectorXd& p, bool loop) {
  const Eigen::Index n = p.size();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!loop && (i == 0 || i == n - 1)) {
      const Eigen::Index other = i == 0 ? 1 : n - 2;
      a(i, i) = 2;
      a(i, other) = 1;
      b(i) = i == 0 ? 3 * (p(1) - p(0)) : 3 * (p(n - 1) - p(n - 2));
      continue;
    }
    const Eigen::Index before = (i + n - 1) % n, after = (i + 1) % n;
    a(i, before) += 1;
    a(i, i) += 4;
    a(i, after) += 1;
    b(i) = 3 * (p(after) - p(before));
  }
  return a.partialPivLu().solve(b);
}

}  // namespace

Path::Path(const PathRequest& request) : loop_(request.loop) {
  const auto n = static_cast<Eigen::Index>(request.waypoints.size());
  if (n < 3) return;
  Eigen::VectorXd x(n), y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    x(i) = request.waypoints[static_cast<size_t>(i)].x_m;
    y(i) = request.waypoints[static_cast<size_t>(i)].y_m;
  }
  const Eigen::VectorXd dx = slopes(x, loop_), dy = slopes(y, loop_);
  const Eigen::Index segments = loop_ ? n : n - 1;
  for (Eigen::Index i = 0; i < segments; ++i) {
    const Eigen::Index j = (i + 1) % n;
    const auto hermite = [&](const Eigen::VectorXd& p, const Eigen::VectorXd& d, double* out) {
      out[0] = p(i);
      out[1] = d(i);
      out[2] = 3 * (p(j) - p(i)) - 2 * d(i) - d(j);
      out[3] = 2 * (p(i) - p(j)) + d(i) + d(j);
    };
    Segment segment;
    hermite(x, dx, segment.x);
    hermite(y, dy, segment.y);
    spline_.push_back(segment);
  }
  const size_t samples = spline_.size() * kSamplesPerSegment + 1;
  distance_.resize(samples, 0.0);
  for (size_t i = 1; i < samples; ++i) {
    // Simpson's rule on the speed of the parameter.
    const auto rate = [&](double k) {
      const Point p = point(k / kSamplesPerSegment);
      return std::hypot(p.dx, p.dy);
    };
    const double k = static_cast<double>(i);
    distance_[i] = distance_[i - 1] + (rate(k - 1) + 4 * rate(k - 0.5) + rate(k)) / 6.0 / kSamplesPerSegment;
  }
  length_ = distance_.back();
  if (loop_) {
    // A lap begins with the speed that it ends with; two passes settle it.
    double speed = request.speed_m_s;
    for (int pass = 0; pass < 3; ++pass) {
      lap_ = profile(request, speed, speed);
      speed = std::min(lap_.speed.front(), lap_.speed.back());
    }
    first_ = profile(request, 0.0, lap_.speed.front());
  } else {
    first_ = profile(request, 0.0, 0.0);
  }
}

Path::Point Path::point(double u) const {
  const size_t i = std::min(static_cast<size_t>(std::max(u, 0.0)), spline_.size() - 1);
  const double t = u - static_cast<double>(i);
  const auto value = [t](const double* c) { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); };
  const auto slope = [t](const double* c) { return c[1] + t * (2 * c[2] + t * 3 * c[3]); };
  const auto bend = [t](const double* c) { return 2 * c[2] + 6 * t * c[3]; };
  const Segment& s = spline_[i];
  Point p{value(s.x), value(s.y), slope(s.x), slope(s.y), 0};
  const double rate = std::hypot(p.dx, p.dy);
  p.curvature = (p.dx * bend(s.y) - p.dy * bend(s.x)) / std::max(rate * rate * rate, 1e-9);
  return p;
}

Path::Profile Path::profile(const PathRequest& request, double start_speed, double end_speed) const {
  const size_t n = distance_.size();
  Profile result;
  result.speed.resize(n);
  result.time.resize(n, 0.0);
  for (size_t i = 0; i < n; ++i) {
    const double curvature = std::abs(point(static_cast<double>(i) / kSamplesPerSegment).curvature);
    result.speed[i] = std::min(request.speed_m_s, request.turn_rad_s / std::max(curvature, 1e-6));
  }
  result.speed.front() = std::min(result.speed.front(), start_speed);
  result.speed.back() = std::min(result.speed.back(), end_speed);
  const double a = request.acceleration_m_s2;
  const auto limit = [&](size_t from, size_t to) {
    const double step = std::abs(distance_[to] - distance_[from]);
    result.speed[to] = std::min(result.speed[to], std::sqrt(result.speed[from] * result.speed[from] + 2 * a * step));
  };
  for (size_t i = 1; i < n; ++i) limit(i - 1, i);
  for (size_t i = n - 1; i > 0; --i) limit(i, i - 1);
  for (size_t i = 1; i < n; ++i) {
    const double mean = (result.speed[i] + result.speed[i - 1]) / 2;
    result.time[i] = result.time[i - 1] + (distance_[i] - distance_[i - 1]) / std::max(mean, 1e-6);
  }
  return result;
}

RobotState Path::at(double t) const {
  t = std::max(t, 0.0);
  const Profile* profile = &first_;
  if (loop_ && t >= first_.time.back()) {
    t = std::fmod(t - first_.time.back(), lap_.time.back());
    profile = &lap_;
  }
  const auto& time = profile->time;
  const size_t after = std::clamp<size_t>(
      static_cast<size_t>(std::upper_bound(time.begin(), time.end(), t) - time.begin()), 1, time.size() - 1);
  const size_t i = after - 1;
  const double span = time[after] - time[i], local = std::clamp(t - time[i], 0.0, span);
  // Constant acceleration between two samples.
  const double v0 = profile->speed[i], v1 = profile->speed[after], speed = v0 + (v1 - v0) * local / span;
  const double s = (v0 + speed) / 2 * local, whole = distance_[after] - distance_[i];
  const Point p = point((static_cast<double>(i) + std::clamp(s / whole, 0.0, 1.0)) / kSamplesPerSegment);
  return {p.x, p.y, std::atan2(p.dy, p.dx), speed, speed * p.curvature};
}

}  // namespace takt::sim
