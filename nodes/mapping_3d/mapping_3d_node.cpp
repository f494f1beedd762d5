// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "nodes/cloud/outlier_filter.hpp"
#include "nodes/mapping_3d/grid_window.hpp"
#include "nodes/mapping_3d/obstacle_grid.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/node.hpp"
#include "rt/transform/transform_buffer.hpp"

namespace takt {
namespace {

using namespace mapping_3d;

class MappingNode final : public Node {
 public:
  void setup(Setup&) override {
    if (range_min_ >= range_max_)
      throw SetupError("range_min is " + range_min_.value_text() +
                       " m, must lie below range_max = " + range_max_.value_text() + " m");
    ObstacleParameters p;
    p.voxel_m = voxel_;
    p.robot_height_m = robot_height_;
    p.z_floor_m = z_floor_;
    p.share = share_;
    p.n_abs = n_abs_;
    p.range_min_m = range_min_;
    p.range_max_m = range_max_;
    p.evidence = evidence_;
    grid_ = ObstacleGrid(p);
    const auto side = static_cast<uint32_t>(grid_.shape().cells);
    obstacles_.reserve({side, side, 1, 0});
    if (outlier_radius_ > 0) {
      filter_.emplace(cloud_.capacity().count);
      kept_.resize(cloud_.capacity().count);
      keep_.resize(cloud_.capacity().count);
    }
    // Nothing says how views lie to each other without poses.
    if (window_ > 1 && has_poses()) views_.emplace(window_, grid_.shape());
    mount_ = camera_mount(camera_x_, camera_y_, camera_height_, 0, camera_tilt_);
  }

  void start(int64_t) override {
    const Grid* known = obstacles_.handed_over();
    if (known != nullptr && views_ && known->width == grid_.shape().cells)
      views_->resume(known->cells.items(), known->grid_in_map);
  }

  void run(Job& job) override {
    for (size_t i = 0; i < poses(); ++i) track_.insert(pose_stamp_ns(i), pose(i));
    for (size_t i = 0; i < motion_.size(); ++i)
      if (motion_.is_new(i) && motion_[i].keyframe && views_) views_->forget();  // poses begin anew, in another frame
    UncertainPose found;
    const std::optional<size_t> chosen = choose(found);
    Grid* grid = chosen ? obstacles_.loan() : nullptr;
    if (!grid) return job.no_result();
    const PointCloud* cloud = &cloud_[*chosen];
    last_stamp_ns_ = cloud_.stamp_ns(*chosen);

    const Viewpoint viewpoint = viewpoint_of(*cloud);
    const GridShape shape = grid_.shape();
    grid->width = grid->height = shape.cells;
    grid->cell_m = shape.cell_m;
    grid->origin_x_m = grid->origin_y_m = shape.origin_m;
    grid->grid_in_map = robot_in_map(found, viewpoint);
    if (!grid->cells.resize(static_cast<size_t>(shape.cells) * static_cast<size_t>(shape.cells)))
      return job.no_result();
    const std::span<const Point> points = without_outliers(cloud->points.items());
    grid_.fill(points, viewpoint, grid->view());
    if (views_) {
      views_->keep(grid_, points, viewpoint, grid->grid_in_map, std::as_const(*grid).view());
      views_->merge_older(grid->view());
    }
    obstacles_.send(last_stamp_ns_);
  }

 private:
  // Poses come from motion (of the camera) if it is connected, else from odometry (of the robot).
  bool has_poses() const { return motion_.connected() || odometry_.connected(); }
  size_t poses() const { return motion_.connected() ? motion_.size() : odometry_.size(); }
  int64_t pose_stamp_ns(size_t i) const { return motion_.connected() ? motion_.stamp_ns(i) : odometry_.stamp_ns(i); }
  UncertainPose pose(size_t i) const {
    return {motion_.connected() ? motion_[i].pose : robot_in_odometry(odometry_[i]), {}};
  }
  Transform robot_in_map(const UncertainPose& found, const Viewpoint& viewpoint) const {
    if (!motion_.connected() && odometry_.connected()) return found.transform;
    // Motion::pose is the camera's; conjugated with the mount it is the robot's (erratum E-25).
    const UncertainPose mount{viewpoint.camera_in_robot, {}};
    return compose(compose(mount, found), inverse(mount)).transform;
  }

  /// The newest cloud that was not mapped yet and whose pose is known, at its stamp or between two; if no latched cloud
  /// has one yet, the newest cloud with its pose predicted at constant motion: never simply the latest pose. Without
  /// poses every cloud is seen from the origin.
  std::optional<size_t> choose(UncertainPose& found) const {
    std::optional<size_t> newest;
    for (size_t i = cloud_.size(); i-- > 0 && cloud_.stamp_ns(i) > last_stamp_ns_;) {
      if (!(cloud_[i].camera.focal_px > 0)) continue;
      if (!has_poses()) return i;
      if (!newest) newest = i;
      const auto known = track_.at(cloud_.stamp_ns(i));
      if (!known) continue;
      found = *known;
      return i;
    }
    return newest && predict(cloud_.stamp_ns(*newest), found) ? newest : std::nullopt;
  }

  bool predict(int64_t stamp_ns, UncertainPose& found) const {
    const size_t n = poses();
    if (n < 2) return false;
    const int64_t last = pose_stamp_ns(n - 1), step = last - pose_stamp_ns(n - 2);
    if (stamp_ns < last || stamp_ns - last > kLongestGapNs || step <= 0 || step > kLongestGapNs) return false;
    const double fraction = 1 + static_cast<double>(stamp_ns - last) / static_cast<double>(step);
    found = interpolate(pose(n - 2), pose(n - 1), fraction);
    return true;
  }

  std::span<const Point> without_outliers(std::span<const Point> points) {
    if (!filter_) return points;
    const cloud::OutlierParameters p{outlier_radius_, cloud::scaled_n_min(outlier_n_min_, points.size())};
    const std::span<uint8_t> keep = std::span(keep_).first(points.size());
    filter_->filter(points, p, keep);
    size_t kept = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      kept_[kept] = points[i];
      kept += keep[i];
    }
    return std::span(kept_).first(kept);
  }

  Viewpoint viewpoint_of(const PointCloud& cloud) const {
    const Transform& t = cloud.sensor_in_robot;
    const bool said = t.x != 0 || t.y != 0 || t.z != 0 || t.qx != 0 || t.qy != 0 || t.qz != 0;
    const double half = view_ > 0 ? view_ / 2 : std::atan2(cloud.camera.cu_px, cloud.camera.focal_px);
    const double step = std::max(1, cloud.step_px);
    return {said ? t : mount_, cloud.camera.focal_px / step, half};
  }

  static constexpr int64_t kLongestGapNs = 500'000'000;  ///< between two poses, and from the last to what is predicted

  Input<PointCloud> cloud_{this, "cloud", "points in the camera frame; depth 4, so that one has its pose already"};
  Input<Motion> motion_{this, "motion", "camera poses around the cloud's stamp; depth 16", Need::optional};
  Input<Odometry> odometry_{this, "odometry",
                            "robot poses around the cloud's stamp, where motion is not connected; depth 16",
                            Need::optional};
  Output<Grid> obstacles_{this, "obstacles", "0.20 m grid around the robot, robot frame at the cloud's stamp"};
  Param<double> outlier_radius_{this, "outlier_radius", 0.20, {0.0, 1.0}, "m", "outlier removal; 0: none"};
  Param<int> outlier_n_min_{this, "outlier_n_min",
                            100,  {1, 100000},
                            "",   "others within the radius that a point needs, for a cloud of 1.2 million points"};
  Param<double> voxel_{this, "voxel", 0.20, {0.05, 1.0}, "m", "edge of a voxel and of a cell"};
  Param<double> robot_height_{this, "robot_height", 1.78, {0.1, 5.0}, "m", "higher points are no obstacles"};
  Param<double> z_floor_{this, "z_floor", 0.07, {-1.0, 1.0}, "m", "lower points are floor"};
  Param<double> share_{this,       "share", 0.15,
                       {0.0, 1.0}, "1",     "points of a blocked voxel, share of a fully covered face"};
  Param<int> n_abs_{this, "n_abs", 5, {0, 100000}, "", "a blocked voxel has more points than this"};
  Param<double> range_min_{this, "range_min", 0.8, {0.0, 100.0}, "m", "nearer cells are not seen"};
  Param<double> range_max_{this, "range_max", 6.0, {0.5, 50.0}, "m", "farther cells are not seen"};
  Param<bool> evidence_{this, "evidence", false, "", "a cell is free only if its column holds a point"};
  Param<double> view_{this, "view", 0.0, {0.0, 3.14}, "rad", "horizontal angle of view; 0: twice atan(cu / f)"};
  Param<double> camera_x_{this, "camera_x",
                          0.0,  {-5.0, 5.0},
                          "m",  "camera to the right of the robot's centre, where the cloud does not say"};
  Param<double> camera_y_{this,        "camera_y", 0.0,
                          {-5.0, 5.0}, "m",        "camera before the robot's centre, where the cloud does not say"};
  Param<double> camera_height_{
      this, "camera_height", 1.6, {0.0, 5.0}, "m", "camera above the floor, where the cloud does not say"};
  Param<double> camera_tilt_{this,        "camera_tilt", 0.0,
                             {-1.6, 1.6}, "rad",         "camera tilt, up positive, where the cloud does not say"};

  Param<int> window_{this, "window", 5, {1, 16}, "", "clouds that the grid is merged from; without poses always 1"};

  std::optional<cloud::OutlierFilter> filter_;
  std::vector<Point> kept_;
  std::vector<uint8_t> keep_;
  ObstacleGrid grid_;
  std::optional<GridWindow> views_;
  Transform mount_;
  PoseTrack track_{InputPort::kMaxDepth, kLongestGapNs};
  int64_t last_stamp_ns_ = INT64_MIN;
};

}  // namespace

void register_mapping_3d(NodeTypes& types) {
  types.add<MappingNode>("mapping_3d", Layer::perception, "Obstacle grid around the robot from a point cloud");
}

}  // namespace takt
