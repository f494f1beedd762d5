// SPDX-License-Identifier: Apache-2.0
#include <optional>

#include "nodes/laser_cloud/sweep_points.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/node.hpp"
#include "rt/transform/transform_buffer.hpp"

namespace takt {
namespace {

class LaserCloudNode final : public Node {
 public:
  void setup(Setup&) override { cloud_.reserve({0, 0, 1, scan_.capacity().count * static_cast<uint32_t>(sweeps_())}); }

  void run(Job& job) override {
    for (size_t i = 0; i < odometry_.size(); ++i)
      track_.insert(odometry_.stamp_ns(i), {mapping_3d::robot_in_odometry(odometry_[i]), {}});
    const std::optional<size_t> newest = newest_with_pose();
    PointCloud* out = newest ? cloud_.loan() : nullptr;
    if (!out) return job.no_result();
    last_stamp_ns_ = scan_.stamp_ns(*newest);
    out->sensor_in_robot = scan_[*newest].sensor_in_robot;
    const UncertainPose to_cloud = inverse(*scanner(*newest));
    const size_t most = std::min(*newest + 1, static_cast<size_t>(sweeps_()));
    for (size_t i = *newest + 1 - most; i <= *newest; ++i)
      if (const auto seen_from = scanner(i))
        laser_cloud::add_points(scan_[i], mapping_3d::to_affine(compose(to_cloud, *seen_from).transform), range_max_,
                                out->points);
    cloud_.send(last_stamp_ns_);
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, track_, last_stamp_ns_); }

 private:
  /// The scanner's pose in the odometry frame; without odometry the robot stands still.
  std::optional<UncertainPose> scanner(size_t i) const {
    const UncertainPose mount{scan_[i].sensor_in_robot, {}};
    if (!odometry_.connected()) return mount;
    const auto robot = track_.at(scan_.stamp_ns(i));
    return robot ? std::optional(compose(*robot, mount)) : std::nullopt;
  }

  std::optional<size_t> newest_with_pose() const {
    for (size_t i = scan_.size(); i-- > 0 && scan_.stamp_ns(i) > last_stamp_ns_;)
      if (scanner(i)) return i;
    return std::nullopt;
  }

  static constexpr int64_t kLongestGapNs = 500'000'000;  ///< between two poses of the odometry

  Input<LaserScan> scan_{this, "scan", "sweeps; depth as many as `sweeps`, and a few for those without a pose yet"};
  Input<Odometry> odometry_{this, "odometry", "the robot's poses around the scans' stamps; depth 32", Need::optional};
  Output<PointCloud> cloud_{this, "cloud", "the returns, in the scanner's frame at the newest sweep with a pose"};
  Param<int> sweeps_{this, "sweeps", 8, {1, 32}, "", "that make one cloud", kSizesMemory};
  Param<double> range_max_{this, "range_max", 15.0, {0.1, 100.0}, "m", "farther returns are left out"};

  PoseTrack track_{InputPort::kMaxDepth, kLongestGapNs};
  int64_t last_stamp_ns_ = INT64_MIN;
};

}  // namespace

void register_laser_cloud(NodeTypes& types) {
  types.add<LaserCloudNode>("laser_cloud", Layer::perception, "One cloud from the last sweeps of a laser scanner");
}

}  // namespace takt
