// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>

#include "nodes/mapping_3d/pose.hpp"
#include "nodes/robot_pose/pose_filter.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace robot_pose;
using scan_matching::planar;

UncertainPose uncertain(const Pose& pose) {
  UncertainPose out{pose.transform, {}};
  std::copy(std::begin(pose.covariance), std::end(pose.covariance), out.covariance.begin());
  return out;
}

class RobotPoseNode final : public Node {
 public:
  void setup(Setup&) override {
    if (motion_.connected() != robot_motion_.connected())
      throw SetupError(std::string(motion_.connected() ? "motion" : "robot_motion") + " is connected without " +
                       (motion_.connected() ? "robot_motion" : "motion") +
                       ": connect both of ego_motion, the one tells the interval, the other the covariance");
    if (!odometry_.connected() && !motion_.connected() && !scan_pose_.connected())
      throw SetupError("nothing to join: connect odometry, motion with robot_motion, or scan_pose");
    filter_.emplace(parameters());
  }

  void changed() override { filter_->tune(parameters()); }

  void start(int64_t) override {
    const Pose* pose = pose_.handed_over();
    if (!pose) return;
    const UncertainPose known = uncertain(*pose);
    filter_->begin_at(planar(known.transform), planar(known.covariance));
    resumed_ = true;
  }

  void run(Job& job) override {
    const size_t before = taken_;
    take_odometry();
    take_motion();
    take_scans();
    if (taken_ == before) return job.no_result();
    const Estimate estimate = filter_->newest();
    const bool all = give_pose(estimate) && give_odometry(estimate);
    if (!all) job.no_result();
  }

  void remember(StateArchive& archive) override {
    TAKT_STATE(archive, filter_, last_wheels_, last_scan_, wheels_ns_, scan_ns_, resumed_);
  }

 private:
  FilterParameters parameters() const {
    FilterParameters p;
    p.acceleration = acceleration_;
    p.turn_acceleration = turn_acceleration_;
    p.slip = slip_;
    p.gate = gate_;
    return p;
  }

  void take(const Measured& measured) {
    if (!filter_->begun() && !resumed_ && measured.source == Source::wheels)
      filter_->begin_at(planar(mapping_3d::robot_in_odometry(*last_wheels_)), Covariance::Zero());
    const Taken taken = filter_->add(measured);
    taken_ += taken != Taken::too_late;
  }

  /// Wheels err as a random walk: variances in proportion to the way, however finely it is divided.
  Covariance wheel_covariance(const PlanarPose& moved, double dt_s) const {
    const double way_m = std::hypot(moved.x_m, moved.y_m), turn_rad = std::abs(moved.theta_rad);
    const double place = odometry_error_ * odometry_error_ * (way_m + kStanding_m_s * dt_s);
    const double turn = odometry_turn_error_ * odometry_turn_error_ * (turn_rad + way_m + kStanding_m_s * dt_s);
    return Eigen::Vector3d(place, place, turn).asDiagonal();
  }

  void take_odometry() {
    for (size_t i = 0; i < odometry_.size(); ++i) {
      const int64_t stamp_ns = odometry_.stamp_ns(i);
      if (last_wheels_ && stamp_ns <= wheels_ns_) continue;
      if (!std::isfinite(odometry_[i].x_m + odometry_[i].y_m + odometry_[i].theta_rad)) continue;
      if (last_wheels_) {
        const PlanarPose moved = between(planar(mapping_3d::robot_in_odometry(*last_wheels_)),
                                         planar(mapping_3d::robot_in_odometry(odometry_[i])));
        take({Source::wheels, wheels_ns_, stamp_ns, moved,
              wheel_covariance(moved, static_cast<double>(stamp_ns - wheels_ns_) * 1e-9)});
      }
      last_wheels_ = odometry_[i];
      wheels_ns_ = stamp_ns;
    }
  }

  void take_motion() {
    for (size_t i = 0; i < robot_motion_.size(); ++i) {
      if (!robot_motion_.is_new(i)) continue;
      const int64_t stamp_ns = robot_motion_.stamp_ns(i);
      for (size_t k = 0; k < motion_.size(); ++k) {
        if (motion_.stamp_ns(k) != stamp_ns || motion_[k].keyframe) continue;
        const UncertainPose step = uncertain(robot_motion_[i]);
        take({Source::ego_motion, motion_[k].from_stamp_ns, stamp_ns, planar(step.transform),
              planar(step.covariance) + kLeastVariance * Covariance::Identity(), motion_[k].valid != 0});
      }
    }
  }

  void take_scans() {
    for (size_t i = 0; i < scan_pose_.size(); ++i) {
      const int64_t stamp_ns = scan_pose_.stamp_ns(i);
      if (last_scan_ && stamp_ns <= scan_ns_) continue;
      const UncertainPose pose = uncertain(scan_pose_[i]);
      if (last_scan_)
        take({Source::scans, scan_ns_, stamp_ns, between(planar(last_scan_->transform), planar(pose.transform)),
              step_covariance(*last_scan_, pose) + kLeastVariance * Covariance::Identity()});
      last_scan_ = pose;
      scan_ns_ = stamp_ns;
    }
  }

  // False if no memory was to be had.

  bool give_pose(const Estimate& estimate) {
    Pose* out = pose_.loan();
    if (!out) return false;
    const UncertainPose pose = scan_matching::spatial(estimate.robot_in_map, estimate.covariance);
    out->transform = pose.transform;
    std::copy(pose.covariance.begin(), pose.covariance.end(), out->covariance);
    pose_.send(estimate.stamp_ns);
    return true;
  }

  bool give_odometry(const Estimate& estimate) {
    Odometry* out = joined_.loan();
    if (!out) return false;
    *out = scan_matching::to_odometry(estimate.robot_in_map);
    out->speed_m_s = estimate.speed_m_s;
    out->turn_rad_s = estimate.turn_rad_s;
    joined_.send(estimate.stamp_ns);
    return true;
  }

  static constexpr double kStanding_m_s = 0.01;   ///< what a base that stands is taken to move
  static constexpr double kLeastVariance = 1e-8;  ///< (0.1 mm)^2, (0.006 deg)^2: keeps a covariance regular

  Input<Odometry> odometry_{this, "odometry", "of the wheels; depth 16", Need::optional};
  Input<Motion> motion_{this, "motion", "of ego_motion, for the intervals; depth 16", Need::optional};
  Input<Pose> robot_motion_{this, "robot_motion", "of ego_motion, together with motion; depth 16", Need::optional};
  Input<Pose> scan_pose_{this, "scan_pose", "of scan_matching; depth 16", Need::optional};
  Output<Pose> pose_{this, "pose",
                     "robot where the wheels' odometry, or else the first measurement, began; with covariance"};
  Output<Odometry> joined_{this, "odometry", "the same as an odometry, for nodes that take one"};

  Param<double> acceleration_{
      this, "acceleration", 0.5, {0.001, 100.0}, "", "by how many m/s the speed changes in a second"};
  Param<double> turn_acceleration_{
      this, "turn_acceleration", 1.0, {0.001, 100.0}, "", "by how many rad/s the turn rate changes"};
  Param<double> slip_{this, "slip", 0.01, {0.0, 1.0}, "", "by how many m it moves sideways in a second"};
  Param<double> gate_{this,       "gate", 16.27,
                      {1.0, 1e9}, "",     "largest normalised innovation squared of a measurement that is used"};
  Param<double> odometry_error_{this, "odometry_error", 0.05, {0.001, 1.0}, "", "of the wheels after a metre, m"};
  Param<double> odometry_turn_error_{
      this, "odometry_turn_error", 0.05, {0.001, 1.0}, "", "of the wheels after a metre, or a radian, rad"};

  std::optional<PoseFilter> filter_;
  std::optional<Odometry> last_wheels_;
  std::optional<UncertainPose> last_scan_;
  int64_t wheels_ns_ = 0, scan_ns_ = 0;
  size_t taken_ = 0;
  bool resumed_ = false;  ///< begins where an earlier process was
};

}  // namespace

void register_robot_pose(NodeTypes& types) {
  types.add<RobotPoseNode>("robot_pose", Layer::perception, "One pose from wheels, ego-motion and scan matching");
}

}  // namespace takt
