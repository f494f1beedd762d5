// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>
#include <string>

#include "nodes/mapping_3d/pose.hpp"
#include "nodes/scan_matching/loop_closer.hpp"
#include "nodes/scan_matching/occupancy_map.hpp"
#include "nodes/scan_matching/scan_matcher.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/node.hpp"
#include "rt/transform/transform_buffer.hpp"

namespace takt {
namespace {

using namespace scan_matching;

class ScanMatchingNode final : public Node {
 public:
  void setup(Setup&) override {
    if (map_cell_ > map_window_ / 2)
      throw SetupError("map_cell is " + map_cell_.value_text() +
                       " m, must be at most half of map_window = " + map_window_.value_text() + " m");
    const Parameters p = parameters();
    matcher_.emplace(scan_.capacity().count, p);
    if (correction_.connected()) closer_.emplace(scan_.capacity().count, p.map, closure());
    occupancy_.emplace(OccupancyParameters{map_cell_, map_window_, range_max_});
    const auto side = static_cast<uint32_t>(occupancy_->side());
    map_.reserve({side, side, 1, 0});
  }

  void changed() override {
    matcher_->tune(parameters());
    const ClosureParameters loops = closure();
    if (closer_) closer_->tune(loops);
  }

  void start(int64_t) override {
    if (const Pose* pose = pose_.handed_over()) {
      UncertainPose known{pose->transform, {}};
      std::copy(std::begin(pose->covariance), std::end(pose->covariance), known.covariance.begin());
      matcher_->resume(known);
      placed_ = true;
    }
    if (const Grid* map = map_.handed_over())
      occupancy_->resume(map->view(), map->grid_in_map.x + map->origin_x_m, map->grid_in_map.y + map->origin_y_m);
  }

  void run(Job& job) override {
    for (size_t i = 0; i < odometry_.size(); ++i)
      wheels_.insert(odometry_.stamp_ns(i), {mapping_3d::robot_in_odometry(odometry_[i]), {}});
    const std::optional<size_t> chosen = choose();
    if (!chosen) return job.no_result();
    const LaserScan& scan = scan_[*chosen];
    const int64_t stamp_ns = scan_.stamp_ns(*chosen);
    const Sweep sweep{scan.first_angle_rad, scan.step_rad, scan.range_m.items(), planar(scan.sensor_in_robot)};
    const auto wheels = wheels_.at(stamp_ns);
    if (!placed_ && wheels) matcher_->resume(*wheels);  // both begin in one frame
    placed_ = true;
    const double dt_s = last_stamp_ns_ > INT64_MIN ? static_cast<double>(stamp_ns - last_stamp_ns_) * 1e-9 : 0;
    const Match match = matcher_->step(sweep, dt_s, moved_since_last(stamp_ns));
    last_stamp_ns_ = stamp_ns;
    if (match.map_anew)
      job.results_doubtful("scans did not fit the map any more: it begins anew where odometry says the robot is");
    if (!match.accepted()) return job.no_result();
    const bool all = give_pose(match, stamp_ns) && give_odometry(match, dt_s, stamp_ns) &&
                     give_map(match, sweep, stamp_ns) && give_correction(match, stamp_ns);
    if (!all) job.no_result();
  }

  void remember(StateArchive& archive) override {
    TAKT_STATE(archive, matcher_, closer_, known_, occupancy_, wheels_, last_stamp_ns_, placed_);
  }

 private:
  /// The newest scan, not matched before, at which the odometry is known. Where it is not known yet a scan waits for
  /// the next job, unless the odometry has fallen silent: then the scan goes without.
  std::optional<size_t> choose() const {
    std::optional<size_t> newest;
    for (size_t i = scan_.size(); i-- > 0 && scan_.stamp_ns(i) > last_stamp_ns_;) {
      if (wheels_.at(scan_.stamp_ns(i))) return i;
      if (!newest) newest = i;
    }
    const bool silent = odometry_.empty() || (newest && scan_.stamp_ns(*newest) - odometry_.stamp_ns() > kLongestGapNs);
    return silent ? newest : std::nullopt;
  }

  std::optional<PlanarPose> moved_since_last(int64_t stamp_ns) const {
    const auto before = wheels_.at(last_stamp_ns_), now = wheels_.at(stamp_ns);
    if (!before || !now) return std::nullopt;
    return between(planar(before->transform), planar(now->transform));
  }

  // False if no memory was to be had.

  bool give_pose(const Match& match, int64_t stamp_ns) {
    Pose* out = pose_.loan();
    if (!out) return false;
    out->transform = match.accumulated.transform;
    std::copy(match.accumulated.covariance.begin(), match.accumulated.covariance.end(), out->covariance);
    pose_.send(stamp_ns);
    return true;
  }

  bool give_odometry(const Match& match, double dt_s, int64_t stamp_ns) {
    Odometry* out = moved_.loan();
    if (!out) return false;
    *out = to_odometry(match.robot_in_map);
    if (dt_s > 0) {
      out->speed_m_s = match.robot_in_previous.y_m / dt_s;
      out->turn_rad_s = match.robot_in_previous.theta_rad / dt_s;
    }
    moved_.send(stamp_ns);
    return true;
  }

  bool give_map(const Match& match, const Sweep& sweep, int64_t stamp_ns) {
    if (!map_.connected()) return true;
    occupancy_->centre(match.robot_in_map.x_m, match.robot_in_map.y_m);
    occupancy_->add(match.robot_in_map, sweep);
    const ImageView<const int16_t> cells = std::as_const(*occupancy_).cells();
    const size_t count = static_cast<size_t>(cells.width) * static_cast<size_t>(cells.height);
    Grid* out = map_.loan();
    if (!out || !out->cells.resize(count)) return false;
    out->width = out->height = occupancy_->side();
    out->cell_m = map_cell_;
    const double half_m = out->width / 2.0 * out->cell_m;
    out->origin_x_m = out->origin_y_m = -half_m;
    out->grid_in_map = {};
    out->grid_in_map.x = occupancy_->origin_x_m() + half_m;
    out->grid_in_map.y = occupancy_->origin_y_m() + half_m;
    std::copy_n(cells.data, count, out->cells.data());
    map_.send(stamp_ns);
    return true;
  }

  /// State and not an event, so that nothing hangs on one message.
  bool give_correction(const Match& match, int64_t stamp_ns) {
    if (!closer_) return true;
    const std::optional<Closure> closure = closer_->step(match.robot_in_map, matcher_->points());
    if (closure || !known_) known_ = Known{stamp_ns, closure ? closure->actual : match.robot_in_map};
    Pose* out = correction_.loan();
    if (!out) return false;
    *out = {};
    out->transform = to_transform(known_->robot_in_map);
    correction_.send(known_->stamp_ns);
    return true;
  }

  ClosureParameters closure() const {
    ClosureParameters p;
    p.way_m = loop_way_;
    p.drift_m = loop_drift_;
    return p;
  }

  Parameters parameters() const {
    Parameters p;
    p.map.keyframes = keyframes_;
    p.map.range_max_m = range_max_;
    p.search.reach_m = search_reach_;
    p.search.reach_rad = search_turn_;
    p.keyframe_m = keyframe_distance_;
    p.keyframe_rad = keyframe_turn_;
    p.score_min = score_min_;
    p.paired_min = paired_min_;
    p.refused_most = refused_most_;
    p.odometry_error = odometry_error_;
    p.odometry_turn_error = odometry_turn_error_;
    p.odometry_drift_rad_m = odometry_drift_;
    p.acceleration_m_s2 = acceleration_;
    p.turn_acceleration_rad_s2 = turn_acceleration_;
    return p;
  }

  static constexpr int64_t kLongestGapNs = 500'000'000;  ///< between two poses of the odometry

  Input<LaserScan> scan_{this, "scan", "sweeps of a level scanner; depth 2, so that one has its odometry already"};
  Input<Odometry> odometry_{this, "odometry", "where a scan is expected; without it the last motion goes on; depth 16",
                            Need::optional};
  Output<Pose> pose_{this, "pose",
                     "robot in the frame where odometry, or else the first scan, began; covariance of all steps"};
  Output<Odometry> moved_{this, "odometry", "the same as an odometry, for nodes that take one"};
  Output<Grid> map_{this, "map", "occupancy of the map frame's cells around the robot"};
  Output<Pose> correction_{this, "correction",
                           "with each pose: when the robot's place was known last, and where: at the first scan, or "
                           "where a loop was closed; covariance not known: 0"};

  Param<double> range_max_{this, "range_max", 15.0, {1.0, 80.0}, "m", "farther returns are not used", kSizesMemory};
  Param<int> keyframes_{this, "keyframes", 20, {1, 200}, "", "scans that the next one is matched with", kSizesMemory};
  Param<double> keyframe_distance_{
      this, "keyframe_distance", 0.3, {0.0, 10.0}, "m", "a scan that far from the last one of them joins them"};
  Param<double> keyframe_turn_{this, "keyframe_turn", 0.2, {0.0, 3.2}, "rad", "or turned by that much"};
  Param<double> search_reach_{
      this, "search_reach", 0.4, {0.05, 2.0}, "m", "search to each side of where the scan is expected", kSizesMemory};
  Param<double> search_turn_{this, "search_turn", 0.35, {0.02, 3.2}, "rad", "search to each side", kSizesMemory};
  Param<double> score_min_{this, "score_min", 0.4, {0.0, 1.0}, "1", "a scan that fits worse is refused; 1: perfect"};
  Param<double> paired_min_{this, "paired_min", 0.3, {0.0, 1.0}, "1", "least share of its points that the map knows"};
  Param<int> refused_most_{this, "refused_most", 5, {1, 1000}, "", "refusals in a row after which the map begins anew"};
  Param<double> odometry_error_{
      this, "odometry_error", 0.1, {0.001, 1.0}, "1", "standard deviation, share of the distance"};
  Param<double> odometry_turn_error_{
      this, "odometry_turn_error", 0.1, {0.001, 1.0}, "1", "standard deviation, share of the turn"};
  Param<double> odometry_drift_{this,       "odometry_drift", 0.05,
                                {0.0, 1.0}, "rad/m",          "standard deviation of the turn for a distance"};
  Param<double> acceleration_{this,          "acceleration", 1.0,
                              {0.01, 100.0}, "m/s^2",        "standard deviation, without odometry"};
  Param<double> turn_acceleration_{this,          "turn_acceleration", 2.0,
                                   {0.01, 100.0}, "rad/s^2",           "standard deviation, without odometry"};
  Param<double> map_cell_{this, "map_cell", 0.10, {0.02, 1.0}, "m", "edge of a cell of the map", kSizesMemory};
  Param<double> map_window_{this, "map_window", 30.0, {1.0, 200.0}, "m", "side of the map", kSizesMemory};

  Param<double> loop_way_{this, "loop_way", 10.0, {1.0, 1000.0}, "m", "driven before a place counts as known again"};
  Param<double> loop_drift_{
      this, "loop_drift", 1.5, {0.2, 10.0}, "m", "error that is looked for there, to each side", kSizesMemory};

  std::optional<ScanMatcher> matcher_;
  std::optional<LoopCloser> closer_;  ///< if somebody wants to know
  struct Known {
    int64_t stamp_ns;
    PlanarPose robot_in_map;
  };
  std::optional<Known> known_;  ///< the first place, or where the last loop was closed
  std::optional<OccupancyMap> occupancy_;
  PoseTrack wheels_{InputPort::kMaxDepth, kLongestGapNs};  ///< robot in the odometry frame
  int64_t last_stamp_ns_ = INT64_MIN;
  bool placed_ = false;  ///< the map frame is fixed
};

}  // namespace

void register_scan_matching(NodeTypes& types) {
  types.add<ScanMatchingNode>("scan_matching", Layer::perception, "Robot pose and occupancy map from laser scans");
}

}  // namespace takt
