// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/laser_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nodes/laser_fusion/icp.hpp"

namespace takt::calibration {
namespace {

using laser_fusion::kRoll, laser_fusion::kZ;
using laser_fusion::Nearest, laser_fusion::to_parameters, laser_fusion::to_rigid;

constexpr double kQuantile = 0.01, kInner = 0.03;
constexpr int kSteady = 4;
constexpr int kRounds = 200, kStepsOfRound = 5;
constexpr double kStill = 1e-5;              // m, rad
constexpr size_t kVoxels = size_t{1} << 20;  // of the room

struct Extent {
  double low_m, high_m;
};

/// The returns on the object, whose heights change with the mount.
class ObjectReturns {
 public:
  explicit ObjectReturns(const LaserSweep& sweep) {
    for (const LaserReturn& r : sweep.returns)
      if (r.on_object) places_.push_back(in_scanner(r).head<2>());
    if (places_.empty()) throw std::invalid_argument("no return of scanner " + sweep.name + " is on the object");
    heights_.resize(places_.size());
  }
  Extent extent(const Rigid& mount) {
    for (size_t i = 0; i < places_.size(); ++i)
      heights_[i] = mount.t.z() + mount.R.row(2).head<2>().dot(places_[i].transpose());
    return {end(kQuantile, kInner), end(1 - kQuantile, 1 - kInner)};
  }

 private:
  /// The straight line through two quantiles, followed to the outside until there is nothing beyond.
  double end(double outer, double inner) {
    const double share = kQuantile / (kInner - kQuantile), at_outer = quantile(outer);
    return at_outer + share * (at_outer - quantile(inner));
  }
  double quantile(double share) {
    const double place = share * static_cast<double>(heights_.size() - 1);
    const auto below = heights_.begin() + static_cast<std::ptrdiff_t>(place);
    std::nth_element(heights_.begin(), below, heights_.end());
    const double next = below + 1 == heights_.end() ? *below : *std::min_element(below + 1, heights_.end());
    return *below + (place - std::floor(place)) * (next - *below);
  }

  std::vector<Eigen::Vector2d> places_;  ///< in the scanner's plane
  std::vector<double> heights_;
};

/// Steps of a parameter against an error that grows with it.
class Stepper {
 public:
  Stepper(double step, double eps) : longest_(step), step_(step), eps_(eps) {}
  double against(double error) {
    if (std::abs(error) <= eps_) return 0;
    const double sign = error > 0 ? 1 : -1;
    if (sign == -sign_) {
      step_ /= 2;
      same_ = 0;
    } else if (++same_ > kSteady) {
      step_ = std::min(2 * step_, longest_);
      same_ = 0;
    }
    sign_ = sign;
    return -sign * step_;
  }

 private:
  double longest_, step_, eps_;
  double sign_ = 0;  ///< of the last error beyond eps
  int same_ = 0;     ///< steps since it changed
};

void set_height(const LaserSweep& sweep, double object_height_m, const HeightParameters& p,
                CalibratedScanner& scanner) {
  scanner.height = fit_height(sweep, scanner.mount, object_height_m, p);
  scanner.mount[kZ] = scanner.height.z_m;
  scanner.mount[kRoll] = scanner.height.roll_rad;
}

/// Both stages in turns, each with what the other found, until nothing moves; second(mount) gives the next one.
template <class Second>
void agree(const LaserSweep& sweep, double object_height_m, const HeightParameters& p, CalibratedScanner& scanner,
           const Second& second) {
  scanner.converged = false;
  for (int round = 0; round < kRounds && !scanner.converged; ++round) {
    const PoseParameters before = scanner.mount;
    set_height(sweep, object_height_m, p, scanner);
    scanner.converged = scanner.height.converged;
    scanner.mount = second(scanner.mount);
    for (size_t i = 0; i < 6; ++i) scanner.converged &= std::abs(scanner.mount[i] - before[i]) < kStill;
  }
}

/// Stage 2 of a scanner whose height and roll are about known: genetic ICP, then exactly.
void fit_into_room(const LaserRecording& recording, const Rigid& first, const LaserSweep& sweep,
                   const LaserCalibrationParameters& p, CalibratedScanner& scanner) {
  const LaserSweep& room = recording.sweeps.front();
  SweepMatcher matcher(room, first, sweep, p.search);
  laser_fusion::GeneticIcp genetic(matcher, p.genetic);
  genetic.begin(to_rigid(scanner.mount), p.seed);
  genetic.run([] { return true; });
  scanner.mount = to_parameters(genetic.best());
  agree(sweep, recording.object_height_m, p.height, scanner, [&](const PoseParameters& mount) {
    return to_parameters(
        icp(matcher, to_rigid(mount), {.eps_conv = 0, .iterations = kStepsOfRound, .locks = p.genetic.locks})
            .moving_in_fixed);
  });
  const RoomPatches patches(in_room(room, first), p.fine.edge_m);
  agree(sweep, recording.object_height_m, p.height, scanner, [&](const PoseParameters& mount) {
    const PatchFit fit = step_onto(patches, sweep, mount, p.fine);
    scanner.residual_m = fit.residual_m;
    scanner.paired = fit.paired;
    return fit.mount;
  });
}

}  // namespace

HeightFit fit_height(const LaserSweep& sweep, const PoseParameters& mount, double object_height_m,
                     const HeightParameters& p) {
  ObjectReturns object(sweep);
  PoseParameters tried = mount;
  const double side = mount[kRoll] < 0 ? -1 : 1;
  Stepper z(p.step_z_m, p.eps_m), roll(p.step_roll_rad, p.eps_m);
  HeightFit fit;
  for (;; ++fit.iterations) {
    const Extent extent = object.extent(to_rigid(tried));
    fit.z_m = tried[kZ];
    fit.roll_rad = tried[kRoll];
    fit.bottom_m = extent.low_m;
    fit.height_error_m = extent.high_m - extent.low_m - object_height_m;
    fit.converged = std::abs(fit.bottom_m) <= p.eps_m && std::abs(fit.height_error_m) <= p.eps_m;
    if (fit.converged || fit.iterations == p.iterations) return fit;
    tried[kZ] += z.against(fit.bottom_m);
    tried[kRoll] += side * roll.against(fit.height_error_m);
  }
}

SweepMatcher::SweepMatcher(const LaserSweep& room, const Rigid& room_mount, const LaserSweep& sweep,
                           const SweepMatchParameters& p)
    : room_(p.room_points, kVoxels), quality_{.cut_m = p.cut_m} {
  room_.build(in_room(room, room_mount, stride(room.returns.size(), p.room_points)), p.cut_m);
  for (size_t i = 0; i < sweep.returns.size(); i += stride(sweep.returns.size(), p.returns)) {
    const LaserReturn& r = sweep.returns[i];
    const Eigen::Vector3f place = in_scanner(r).cast<float>();
    returns_.push_back({place.x(), place.y(), place.z()});
    turns_.push_back({static_cast<float>(std::cos(r.heading_rad)), static_cast<float>(std::sin(r.heading_rad))});
  }
  partners_.resize(returns_.size());
  nearest_.resize(returns_.size());
}

laser_fusion::Quality SweepMatcher::evaluate(const Rigid& mount) {
  const Eigen::Matrix3f r = mount.R.cast<float>();
  const Eigen::Vector3f t = mount.t.cast<float>();
  for (uint32_t i = 0; i < returns_.size(); ++i) {
    const auto [c, s] = turns_[i];
    const Eigen::Vector3f p = r * Eigen::Vector3f(returns_[i].x, returns_[i].y, returns_[i].z) + t;
    nearest_[i] = room_.nearest({c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z()});
    if (nearest_[i].index == Nearest::kNoPoint) continue;
    const Point& partner = room_.points()[nearest_[i].index];
    partners_[i] = {c * partner.x + s * partner.y, c * partner.y - s * partner.x, partner.z};
    nearest_[i].index = i;
  }
  return judge({partners_, returns_, nearest_}, quality_, sums_);
}

std::vector<CalibratedScanner> calibrate_lasers(const LaserRecording& recording, const LaserCalibrationParameters& p) {
  std::vector<CalibratedScanner> scanners;
  for (const LaserSweep& sweep : recording.sweeps) {
    CalibratedScanner scanner{sweep.name, sweep.mount, {}, 0, 0, false};
    set_height(sweep, recording.object_height_m, p.height, scanner);
    scanner.converged = scanner.height.converged;
    if (!scanners.empty()) fit_into_room(recording, to_rigid(scanners.front().mount), sweep, p, scanner);
    scanners.push_back(scanner);
  }
  return scanners;
}

}  // namespace takt::calibration
