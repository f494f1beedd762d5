// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "nodes/cloud/cloud_file.hpp"
#include "nodes/cloud/outlier_filter.hpp"
#include "nodes/mapping_3d/cloud_mapper.hpp"
#include "nodes/mapping_3d/grid_file.hpp"
#include "nodes/mapping_3d/grid_window.hpp"
#include "nodes/mapping_3d/map_grid.hpp"
#include "nodes/mapping_3d/obstacle_grid.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/pose.hpp"
#include "rt/node.hpp"
#include "rt/transform/transform_buffer.hpp"

namespace takt {
namespace {

using namespace mapping_3d;

class MappingNode final : public Node {
 public:
  MappingNode() {
    for (OutputPort* out : outputs()) out->stamped_by({&cloud_});
  }
  void setup(Setup& setup) override {
    obstacle_parameters_ = obstacle_parameters();
    grid_ = ObstacleGrid(obstacle_parameters_);
    const auto side = static_cast<uint32_t>(grid_.shape().cells);
    obstacles_.reserve({side, side, 1, 0});
    fused_.reserve({side, side, 1, 0});
    if (outlier_radius_ > 0) {
      filter_.emplace(cloud_.capacity().count);
      kept_.resize(cloud_.capacity().count);
      keep_.resize(cloud_.capacity().count);
    }
    // Nothing says how views lie to each other without poses.
    if (window_ > 1 && has_poses()) views_.emplace(window_, grid_.shape());
    set_up_map(setup);
    changed();
  }

  void changed() override {
    if (outlier_radius_ > 0 && !filter_)
      throw SetupError("outlier_radius was 0 at the start, and no memory was taken for the removal; start with it");
    obstacle_parameters_ = obstacle_parameters();
    grid_.tune(obstacle_parameters_);
    const MapperParameters mapper = mapper_parameters();
    if (mapper_) mapper_->tune(mapper);
    mount_ = camera_mount(camera_x_, camera_y_, camera_height_, 0, camera_tilt_);
  }

  void start(int64_t) override {
    const Grid* known = obstacles_.handed_over();
    if (known != nullptr && views_ && known->width == grid_.shape().cells)
      views_->resume(known->cells.items(), known->grid_in_map);
    if (const Pose* frame = poses_in_map_.handed_over()) map_from_poses_ = {frame->transform, {}};
  }

  void run(Job& job) override {
    for (size_t i = 0; i < poses(); ++i) track_.insert(pose_stamp_ns(i), pose(i));
    for (size_t i = 0; i < motion_.size(); ++i)
      if (motion_.is_new(i) && motion_[i].keyframe) begin_anew();
    take_correction();
    UncertainPose found;
    const std::optional<size_t> chosen = choose(found);
    Grid* grid = chosen ? obstacles_.loan() : nullptr;
    if (!grid) return job.no_result();
    const PointCloud& cloud = cloud_[*chosen];
    last_stamp_ns_ = cloud_.stamp_ns(*chosen);

    const Viewpoint viewpoint = viewpoint_of(cloud);
    const GridShape shape = grid_.shape();
    grid->width = grid->height = shape.cells;
    grid->cell_m = shape.cell_m;
    grid->origin_x_m = grid->origin_y_m = shape.origin_m;
    grid->grid_in_map = robot_in_map(found, viewpoint);
    if (!grid->cells.resize(static_cast<size_t>(shape.cells) * static_cast<size_t>(shape.cells)))
      return job.no_result();
    const std::span<const Point> points = without_outliers(cloud.points.items());
    grid_.fill(points, viewpoint, grid->view());
    if (views_) {
      views_->keep(grid_, points, viewpoint, grid->grid_in_map, std::as_const(*grid).view());
      views_->merge_older(grid->view());
    }
    obstacles_.send(last_stamp_ns_);
    if (mapper_) add_to_map(cloud, viewpoint, grid->grid_in_map);
    const bool all = give_fused(*grid) && give_cloud(cloud) && give_map(grid->grid_in_map);
    give_poses_in_map();
    if (!all) job.no_result();
    // Last, since it may be left out: nothing that others wait for comes after it.
    const auto reserve_ns = static_cast<int64_t>(reserve_() * 1e9);
    if (mapper_) mapper_->tidy([&] { return job.time_left_ns() > reserve_ns; });
  }

  void finish() override {
    if (!mapper_ || save_().empty()) return;
    std::error_code ignored;
    std::filesystem::create_directories(save_to_, ignored);  // the files say whether it worked
    cloud::Cloud all;
    mapper_->map().for_each([&](const Position& at, const MapPoint& p) {
      all.points.push_back({static_cast<float>(at.x_m), static_cast<float>(at.y_m), static_cast<float>(at.z_m)});
      all.colours.push_back(p.colour);
    });
    if (const auto written = cloud::write_cloud(save_to_ / "map.ply", all.view()); !written)
      std::cerr << "mapping_3d: " << written.error() << '\n';
    if (all.points.empty()) return;
    if (const auto written = write_grid(save_to_ / "map.yaml", grid_of(mapper_->map(), obstacle_parameters_)); !written)
      std::cerr << "mapping_3d: " << written.error() << '\n';
  }

  void remember(StateArchive& archive) override {
    TAKT_STATE(archive, views_, mapper_, map_from_poses_, pending_, right_until_ns_, track_, last_stamp_ns_);
  }

 private:
  ObstacleParameters obstacle_parameters() const {
    if (range_min_ >= range_max_)
      throw SetupError("range_min is " + range_min_.value_text() +
                       " m, must lie below range_max = " + range_max_.value_text() + " m");
    ObstacleParameters p;
    p.voxel_m = voxel_;
    p.robot_height_m = robot_height_;
    p.z_floor_m = z_floor_;
    p.slope = std::tan(slope_());
    p.share = share_;
    p.n_abs = n_abs_;
    p.range_min_m = range_min_;
    p.range_max_m = range_max_;
    p.evidence = evidence_;
    return p;
  }

  MapperParameters mapper_parameters() const {
    MapperParameters p;
    p.views = static_cast<size_t>(views_fused_());
    p.range_max_m = range_max_;
    p.clear = clear_;
    p.fusion.steps = tolerance_;
    p.fusion.support = support_;
    p.map.voxel_m = map_voxel_;
    p.map.tile_m = tile_;
    p.map.tiles = static_cast<size_t>(tiles_());
    return p;
  }

  /// The map is made if somebody wants it.
  void set_up_map(Setup& setup) {
    const auto read = [&](const std::string& file) { return setup.directory / file; };
    if (!load_grid_().empty()) {
      auto known = read_grid(read(load_grid_));
      if (!known) throw SetupError("load_grid: " + known.error());
      known_ = std::move(*known);
    }
    save_to_ = setup.output / save_();
    if (!fused_cloud_.connected() && !map_.connected() && save_().empty()) return;
    if (cloud_.capacity().count == 0) return;
    mapper_.emplace(mapper_parameters(), cloud_.capacity().count);
    if (!load_().empty()) {
      auto cloud = cloud::read_cloud(read(load_));
      if (!cloud) throw SetupError("load: " + cloud.error());
      if (const std::string rounded = cloud::add_origin(*cloud); !rounded.empty())
        throw SetupError("load: " + rounded + "; take an offset off, the map is in the robot's frame");
      mapper_->load(cloud->view());
    }
    fused_cloud_.reserve(cloud_.capacity());
    map_.reserve({0, 0, 1, static_cast<uint32_t>(map_count_())});
  }

  /// The poses have begun anew, in another frame.
  void begin_anew() {
    if (views_) views_->forget();
    if (mapper_) mapper_->forget();
    map_from_poses_ = {};
    right_until_ns_ = INT64_MIN;
  }

  /// Where the robot really was at an instant: all poses after it, and the part of the map since the last correction,
  /// are moved. Waits until the pose of that instant is known.
  void take_correction() {
    if (!correction_.empty() && correction_.stamp_ns() > right_until_ns_)
      pending_ = Correction{correction_.stamp_ns(), correction_.newest()->transform};
    if (!pending_) return;
    const auto known = track_.at(pending_->stamp_ns);
    if (!known) {
      if (known.error().problem != TransformProblem::too_new) pending_.reset();
      return;
    }
    const UncertainPose believed{robot_in_map(*known, {mount_, 0, 0, Sensor::camera}), {}},
        actual{pending_->robot_in_map, {}};
    if (mapper_ && right_until_ns_ != INT64_MIN)
      mapper_->correct(right_until_ns_, pending_->stamp_ns, believed.transform, actual.transform);
    if (views_) views_->forget();
    map_from_poses_ = compose(compose(actual, inverse(believed)), map_from_poses_);
    right_until_ns_ = pending_->stamp_ns;
    pending_.reset();
  }

  void add_to_map(const PointCloud& cloud, const Viewpoint& viewpoint, const Transform& robot) {
    if (right_until_ns_ == INT64_MIN) right_until_ns_ = last_stamp_ns_;
    const Transform sensor_in_map = compose({robot, {}}, {viewpoint.camera_in_robot, {}}).transform;
    const cloud::CloudView points{cloud.points.items(), cloud.colours.items()};
    if (viewpoint.sensor == Sensor::laser) return mapper_->add_sweep(points, sensor_in_map, last_stamp_ns_);
    mapper_->add_view(points, depth_camera_of(cloud.camera, cloud.step_px, cloud_.capacity().count), sensor_in_map,
                      last_stamp_ns_);
  }

  // False if no memory was to be had.

  bool give_fused(const Grid& obstacles) {
    if (!fused_.connected()) return true;
    Grid* out = fused_.loan();
    if (!out || !out->cells.resize(obstacles.cells.size)) return false;
    out->width = obstacles.width, out->height = obstacles.height;
    out->cell_m = obstacles.cell_m;
    out->origin_x_m = obstacles.origin_x_m, out->origin_y_m = obstacles.origin_y_m;
    out->grid_in_map = obstacles.grid_in_map;
    std::copy_n(obstacles.cells.data(), obstacles.cells.size, out->cells.data());
    if (const Grid* other = other_.newest()) {
      GridView there = view_of(*other);  // in the frame of the poses
      there.grid_in_map = compose(map_from_poses_, {there.grid_in_map, {}}).transform;
      fuse(there, *out);
    }
    if (known_) fuse(view_of(*known_), *out);
    fused_.send(last_stamp_ns_);
    return true;
  }

  bool give_cloud(const PointCloud& like) {
    if (!fused_cloud_.connected() || !mapper_) return true;
    const FusedCloud& fused = mapper_->fused();
    if (fused.cloud.points.empty()) return true;
    PointCloud* out = fused_cloud_.loan();
    if (!out) return false;
    out->sensor_in_robot = like.sensor_in_robot;
    out->camera = like.camera;
    out->step_px = like.step_px;
    for (const Point& p : fused.cloud.points) out->points.push_back(p);
    for (const Colour& c : fused.cloud.colours) out->colours.push_back(c);
    fused_cloud_.send(fused.stamp_ns);
    return true;
  }

  /// Not with this job if no memory is to be had.
  void give_poses_in_map() {
    Pose* out = poses_in_map_.loan();
    if (!out) return;
    *out = {};
    out->transform = map_from_poses_.transform;
    poses_in_map_.send(last_stamp_ns_);
  }

  bool give_map(const Transform& robot) {
    if (!map_.connected() || !mapper_) return true;
    PointCloud* out = map_.loan();
    if (!out) return false;
    mapper_->map().for_each_near(robot, map_range_, [&](const Position& at, const MapPoint& p) {
      if (std::hypot(at.x_m - robot.x, at.y_m - robot.y) > map_range_) return;
      out->points.push_back({static_cast<float>(at.x_m), static_cast<float>(at.y_m), static_cast<float>(at.z_m)});
      out->colours.push_back(p.colour);
    });
    map_.send(last_stamp_ns_);
    return true;
  }

  // Poses come from motion (of the camera) if it is connected, else from pose, else from odometry (of the robot).
  bool has_poses() const { return motion_.connected() || pose_.connected() || odometry_.connected(); }
  size_t poses() const {
    return motion_.connected() ? motion_.size() : pose_.connected() ? pose_.size() : odometry_.size();
  }
  int64_t pose_stamp_ns(size_t i) const {
    return motion_.connected() ? motion_.stamp_ns(i) : pose_.connected() ? pose_.stamp_ns(i) : odometry_.stamp_ns(i);
  }
  UncertainPose pose(size_t i) const {
    if (motion_.connected()) return {motion_[i].pose, {}};
    return {pose_.connected() ? pose_[i].transform : robot_in_odometry(odometry_[i]), {}};
  }
  Transform robot_in_map(const UncertainPose& found, const Viewpoint& viewpoint) const {
    if (!motion_.connected()) return compose(map_from_poses_, found).transform;
    // Motion::pose is the camera's; conjugated with the mount it is the robot's (erratum E-25).
    const UncertainPose mount{viewpoint.sensor == Sensor::camera ? viewpoint.camera_in_robot : mount_, {}};
    return compose(map_from_poses_, compose(compose(mount, found), inverse(mount))).transform;
  }

  /// The newest cloud that was not mapped yet and whose pose is known, at its stamp or between two; if no latched cloud
  /// has one yet, the newest cloud with its pose predicted at constant motion: never simply the latest pose. Without
  /// poses every cloud is seen from the origin.
  std::optional<size_t> choose(UncertainPose& found) const {
    std::optional<size_t> newest;
    for (size_t i = cloud_.size(); i-- > 0 && cloud_.stamp_ns(i) > last_stamp_ns_;) {
      if (!(cloud_[i].camera.focal_px > 0) && cloud_[i].points.size == 0) continue;  // not rectified yet
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
    if (!filter_ || outlier_radius_ <= 0) return points;
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

  /// A cloud without a camera is a laser's.
  Viewpoint viewpoint_of(const PointCloud& cloud) const {
    const Transform& t = cloud.sensor_in_robot;
    if (!(cloud.camera.focal_px > 0))
      return {t, 1 / laser_step_, (view_ > 0 ? view_() : std::numbers::pi) / 2, Sensor::laser};
    const bool said = t.x != 0 || t.y != 0 || t.z != 0 || t.qx != 0 || t.qy != 0 || t.qz != 0;
    const double half = view_ > 0 ? view_ / 2 : std::atan2(cloud.camera.cu_px, cloud.camera.focal_px);
    const double step = std::max(1, cloud.step_px);
    return {said ? t : mount_, cloud.camera.focal_px / step, half, Sensor::camera};
  }

  static constexpr int64_t kLongestGapNs = 500'000'000;  ///< between two poses, and from the last to what is predicted

  Input<PointCloud> cloud_{this, "cloud",
                           "points in the frame of a camera, or of a laser; depth 4, so that one has its pose already"};
  Input<Motion> motion_{this, "motion", "camera poses around the cloud's stamp; depth 16", Need::optional};
  Input<Odometry> odometry_{this, "odometry",
                            "robot poses around the cloud's stamp, where motion is not connected; depth 16",
                            Need::optional};
  Input<Pose> pose_{this, "pose",
                    "robot poses around the cloud's stamp from anywhere else, instead of odometry; depth 16",
                    Need::optional};
  Input<Pose> correction_{this, "correction",
                          "where the robot turns out to have been at its stamp, once for each stamp; lays the map anew",
                          Need::optional};
  Input<Grid> other_{this, "grid", "what else is known, in the frame of the poses, for `fused`", Need::optional};
  Output<Grid> obstacles_{this, "obstacles", "0.20 m grid around the robot, robot frame at the cloud's stamp"};
  Output<Grid> fused_{this, "fused",
                      "the same with `grid` and load_grid: unknown yields to known, else the larger counts"};
  Output<PointCloud> fused_cloud_{this, "cloud",
                                  "one cloud by median fusion of the last `views`, in the camera's frame"};
  Output<PointCloud> map_{this, "map", "points of the map within map_range of the robot, in the map frame"};
  Output<Pose> poses_in_map_{this, "poses_in_map",
                             "where the frame of the poses lies in the map: the identity until a correction came"};
  Param<double> outlier_radius_{this, "outlier_radius", 0.20, {0.0, 1.0}, "m", "outlier removal; 0: none"};
  Param<int> outlier_n_min_{this, "outlier_n_min",
                            100,  {1, 100000},
                            "",   "others within the radius that a point needs, for a cloud of 1.2 million points"};
  Param<double> voxel_{this, "voxel", 0.20, {0.05, 1.0}, "m", "edge of a voxel and of a cell", kSizesMemory};
  Param<double> robot_height_{this,        "robot_height", 1.78, {0.1, 5.0}, "m", "higher points are no obstacles",
                              kSizesMemory};
  Param<double> z_floor_{this, "z_floor", 0.07, {-1.0, 1.0}, "m", "lower points are floor"};
  Param<double> slope_{this,       "slope", 0.1745,
                       {0.0, 1.0}, "rad",   "the floor may be so steep; 0: it is z = 0 everywhere"};
  Param<double> share_{this,       "share", 0.15,
                       {0.0, 1.0}, "1",     "points of a blocked voxel, share of a fully covered face"};
  Param<int> n_abs_{this, "n_abs", 5, {0, 100000}, "", "a blocked voxel has more points than this"};
  Param<double> range_min_{this, "range_min", 0.8, {0.0, 100.0}, "m", "nearer cells are not seen"};
  Param<double> range_max_{this, "range_max", 6.0, {0.5, 50.0}, "m", "farther cells are not seen", kSizesMemory};
  Param<double> laser_step_{this,          "laser_step", 0.0087,
                            {0.0005, 0.1}, "rad",        "between two beams, for clouds without a camera"};
  Param<bool> evidence_{this, "evidence", false, "", "a cell is free only if its column holds a point"};
  Param<double> view_{this,        "view", 0.0,
                      {0.0, 6.29}, "rad",  "horizontal angle of view; 0: twice atan(cu / f), of a laser 180 degrees"};
  Param<double> camera_x_{this, "camera_x",
                          0.0,  {-5.0, 5.0},
                          "m",  "camera to the right of the robot's centre, where the cloud does not say"};
  Param<double> camera_y_{this,        "camera_y", 0.0,
                          {-5.0, 5.0}, "m",        "camera before the robot's centre, where the cloud does not say"};
  Param<double> camera_height_{
      this, "camera_height", 1.6, {0.0, 5.0}, "m", "camera above the floor, where the cloud does not say"};
  Param<double> camera_tilt_{this,        "camera_tilt", 0.0,
                             {-1.6, 1.6}, "rad",         "camera tilt, up positive, where the cloud does not say"};

  Param<int> window_{
      this, "window", 5, {1, 16}, "", "clouds that the grid is merged from; without poses always 1", kSizesMemory};
  Param<int> views_fused_{this, "views", 5, {1, 16}, "", "clouds of a camera that are fused into one", kSizesMemory};
  Param<int> support_{this, "support", 2, {1, 16}, "", "of these, so many must agree on a point"};
  Param<double> tolerance_{this,       "tolerance", 1.0,
                           {0.0, 4.0}, "",          "points agree within so many steps of the disparity"};
  Param<double> map_voxel_{
      this, "map_voxel", 0.05, {0.01, 1.0}, "m", "edge of the voxels of which the map keeps one point", kReadAtStart};
  Param<double> tile_{this,        "tile", 3.0, {0.5, 50.0}, "m", "the map gets a tile where none was begun so near",
                      kReadAtStart};
  Param<int> tiles_{this,        "tiles", 24, {2, 256}, "", "of the map, 0.9 MB each; then the farthest makes room",
                    kSizesMemory};
  Param<bool> clear_{this, "clear", true, "", "points that later views look through go"};
  Param<double> map_range_{this, "map_range", 10.0, {0.1, 1000.0}, "m", "of the output `map`"};
  Param<int> map_count_{this,        "map_count", 100000, {1, 10000000}, "", "points of the output `map`, at most",
                        kSizesMemory};
  Param<double> reserve_{this,       "reserve", 0.005,
                         {0.0, 1.0}, "s",       "with less time left the map is not looked through any further"};
  Param<std::string> save_{
      this, "save", "", "", "folder for map.ply, map.yaml and map.png at the end of a run; empty: none", kReadAtStart};
  Param<std::string> load_{this, "load", "", kPath, "PLY or PCD file that the map begins with; empty: none"};
  Param<std::string> load_grid_{this, "load_grid", "", kPath, "YAML file of a grid, for `fused`; empty: none"};

  std::optional<cloud::OutlierFilter> filter_;
  std::vector<Point> kept_;
  std::vector<uint8_t> keep_;
  ObstacleParameters obstacle_parameters_;
  ObstacleGrid grid_;
  std::optional<GridWindow> views_;
  std::optional<CloudMapper> mapper_;
  std::optional<GridMap> known_;
  std::filesystem::path save_to_;
  UncertainPose map_from_poses_;  ///< what the corrections came to
  struct Correction {
    int64_t stamp_ns;
    Transform robot_in_map;
  };
  std::optional<Correction> pending_;
  int64_t right_until_ns_ = INT64_MIN;
  Transform mount_;
  PoseTrack track_{InputPort::kMaxDepth, kLongestGapNs};
  int64_t last_stamp_ns_ = INT64_MIN;
};

}  // namespace

void register_mapping_3d(NodeTypes& types) {
  types.add<MappingNode>("mapping_3d", Layer::perception, "Obstacle grid around the robot from a point cloud");
}

}  // namespace takt
