// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/ground_map/ground_detector.hpp"
#include "nodes/ground_map/ground_grid.hpp"
#include "nodes/ground_map/laser_check.hpp"
#include "nodes/ground_map/robot_track.hpp"
#include "nodes/ground_map/specks.hpp"
#include "nodes/ground_map/terrain_file.hpp"
#include "nodes/mapping_3d/head_at.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "nodes/stereo/calibration_file.hpp"
#include "nodes/stereo/rectify.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/ace/terrain.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace ground_map;

/// Which image a job maps, and where the robot was.
struct Chosen {
  size_t image = 0;
  std::optional<Transform> robot_in_map;  ///< none: not known
};

class GroundMapNode final : public Node {
 public:
  void setup(Setup& setup) override {
    const Capacity& image = pair_.capacity();
    detector_.emplace(static_cast<int>(image.width), static_cast<int>(image.height), detector_parameters());
    if (!calibration_().empty()) read_calibration(setup.directory / calibration_(), image);
    ground_.resize(image.pixels());
    grid_cells_.emplace(static_cast<int>(image.width), grid_parameters());
    mask_.reserve({image.width, image.height, 1, 0});
    confidence_.reserve(mask_.capacity());
    textures_.reserve({sizeof(Descriptor), static_cast<uint32_t>(n_b_()), 1, 0});
    const auto side = static_cast<uint32_t>(grid_cells_->window().cells);
    grid_.reserve({side, side, 1, 0});
    specks_.emplace(grid_cells_->window().cells, speck_);
    if (!terrain_maps_().empty()) read_terrain_maps(setup.directory / terrain_maps_());
    around_cells_.resize(shape_.cells());
    around_.reserve({static_cast<uint32_t>(shape_.columns), static_cast<uint32_t>(shape_.rows), 1, 0});
    changed();
  }

  void changed() override {
    if (speck_ > 0 && !scan_.connected())
      throw SetupError("speck wants `scan`: it frees only what a scanner sees past");
    detector_->tune(detector_parameters());
    if (detector_->area().pixels() == 0)
      throw SetupError("the reference area is empty: trapezoid_height = " + trapezoid_height_.value_text() +
                       ", trapezoid_bottom = " + trapezoid_bottom_.value_text() +
                       ", trapezoid_top = " + trapezoid_top_.value_text());
    grid_cells_->tune(grid_parameters());
    specks_->tune(speck_);
    const TerrainParameters terrain = terrain_parameters();
    if (classifier_) classifier_->tune(terrain);
    mount_ = mapping_3d::camera_mount(camera_x_, camera_y_, camera_height_, 0, camera_tilt_);
    motion_mount_ =
        mapping_3d::camera_mount(motion_camera_x_, motion_camera_y_, motion_camera_height_, 0, motion_camera_tilt_);
  }

  void start(int64_t) override {
    if (const Image* known = textures_.handed_over())
      for (int i = 0; i < known->height; ++i) {
        const uint8_t* row = known->view().row(i);
        detector_->recall({row[0], row[1], row[2], row[3]});
      }
    const Grid* map = grid_.handed_over();
    if (map != nullptr && has_pose_input())
      grid_cells_->resume(map->cells.items(),
                          {map->grid_in_map.x + map->origin_x_m, map->grid_in_map.y + map->origin_y_m});
  }

  void run(Job& job) override {
    const std::optional<Chosen> chosen = choose();
    if (!chosen) return job.no_result();
    const StereoPair& pair = pair_[chosen->image];
    last_stamp_ns_ = pair_.stamp_ns(chosen->image);
    const std::optional<FloorProjection> projection = projection_of(pair);
    detector_->analyse(left_of(pair));
    if (may_learn(pair, projection)) detector_->learn();
    detector_->classify(ground(), projection);
    if (detector_->too_dark()) job.results_doubtful("too dark to tell ground: light_min");
    const bool mask_given = give_mask(pair) && give_confidence(pair);
    const bool grid_given =
        !projection || !chosen->robot_in_map || give_grid(*projection, planar(*chosen->robot_in_map));
    give_textures();
    if (!mask_given || !grid_given) job.no_result();
  }

  void remember(StateArchive& archive) override {
    TAKT_STATE(archive, detector_, grid_cells_, classifier_, track_, last_stamp_ns_);
  }

 private:
  bool has_pose_input() const { return motion_.connected() || odometry_.connected(); }

  bool usable(const StereoPair& pair) const {
    return (pair.camera.focal_px > 0 || !straight_.empty()) && pair.width == detector_->width() &&
           pair.height == detector_->height() && (pair.channels == 1 || pair.channels == 3) &&
           pair.left.size == ground_.size() * static_cast<size_t>(pair.channels);
  }

  static bool is_raw(const StereoPair& pair) { return !(pair.camera.focal_px > 0); }
  CameraModel camera_of(const StereoPair& pair) const { return is_raw(pair) ? camera_ : pair.camera; }

  /// The left image as an ideal camera in the same place would see it.
  ImageView<const uint8_t> left_of(const StereoPair& pair) {
    if (!is_raw(pair)) return pair.left_view();
    const ImageView<uint8_t> straight(straight_.data(), pair.width, pair.height, pair.channels);
    undistort_.run(pair.left_view(), stereo::BayerPattern::none, remap_window_, straight);
    return straight;
  }

  void read_calibration(const std::filesystem::path& file, const Capacity& image) {
    try {
      const stereo::StereoCalibration calibration = stereo::read_calibration(file);
      if (calibration.width != static_cast<int>(image.width) || calibration.height != static_cast<int>(image.height))
        throw SetupError(file.string() + " is for " + std::to_string(calibration.width) + " x " +
                         std::to_string(calibration.height) + " px but `pair` has " + std::to_string(image.width) +
                         " x " + std::to_string(image.height) + "; give the calibration of this camera mode");
      const stereo::RectificationTables tables = stereo::undistortion_table(calibration);
      camera_ = tables.camera;
      undistort_ = stereo::Remap(calibration.width, calibration.height, tables.left);
    } catch (const std::invalid_argument& error) {
      throw SetupError(error.what());
    }
    straight_.resize(image.pixels() * image.channels);
    remap_window_.resize(undistort_.window_bytes());
  }

  /// The newest image that was not mapped before, with its pose known or predicted; else an older one with its pose
  /// known; else the newest without one: its mask is still worth having. Never simply the latest pose. (Were a known
  /// pose preferred to a predicted one, one job left out would make every later one map the image before the newest.)
  std::optional<Chosen> choose() {
    std::optional<size_t> newest;
    for (size_t i = pair_.size(); i-- > 0 && pair_.stamp_ns(i) > last_stamp_ns_;) {
      if (!usable(pair_[i])) continue;
      if (!has_pose_input()) return Chosen{i, Transform{}};
      if (!newest) {
        newest = i;
        follow(mount_of(pair_[i]));
      }
      if (const auto pose = track_.at(pair_.stamp_ns(i))) return Chosen{i, pose};
      if (const auto pose = track_.predicted(pair_.stamp_ns(i)); pose && i == *newest) return Chosen{i, pose};
    }
    if (!newest) return std::nullopt;
    return Chosen{*newest, std::nullopt};
  }

  void follow(const Transform& mount) {
    if (motion_.connected()) {
      const Transform& camera = motion_camera_() == 0 ? mount : motion_mount_;
      for (size_t i = 0; i < motion_.size(); ++i)
        track_.insert(motion_.stamp_ns(i), robot_pose(motion_[i].pose, camera));
    } else {
      for (size_t i = 0; i < odometry_.size(); ++i)
        track_.insert(odometry_.stamp_ns(i), mapping_3d::robot_in_odometry(odometry_[i]));
    }
  }

  /// A frame that the camera itself calls bad, or in whose reference area something stands or could stand unseen,
  /// teaches nothing; it is classified all the same.
  bool may_learn(const StereoPair& pair, const std::optional<FloorProjection>& projection) const {
    constexpr uint32_t kBad = image_health::saturated | image_health::dark | image_health::blurred;
    if ((pair.health & kBad) != 0) return false;
    if (!scan_.connected()) return true;
    const auto scan = scan_at_image();
    return scan && projection && area_is_free(scan_[*scan], *projection, detector_->area());
  }

  /// The newest scan that is at most `scan_age` from the image.
  std::optional<size_t> scan_at_image() const {
    const auto longest_ns = static_cast<int64_t>(scan_age_ * 1e9);
    for (size_t i = scan_.size(); i-- > 0;)
      if (std::abs(scan_.stamp_ns(i) - last_stamp_ns_) <= longest_ns) return i;
    return std::nullopt;
  }

  /// None where the head's angles are not known.
  std::optional<FloorProjection> projection_of(const StereoPair& pair) const {
    if (!head_.connected()) return floor_projection(camera_of(pair), mount_of(pair));
    const auto head = mapping_3d::head_at(head_, last_stamp_ns_, RobotTrack::kLongestGapNs);
    if (!head) return std::nullopt;
    return floor_projection(camera_of(pair), mapping_3d::turned_by_head(mount_of(pair), head->pan_rad, head->tilt_rad));
  }

  ImageView<uint8_t> ground() { return {ground_.data(), detector_->width(), detector_->height()}; }

  /// An image of the pair's size and stamp, sent once it is filled; null if no memory was to be had.
  Image* send_like(Output<Image>& port, const StereoPair& pair) {
    Image* out = port.loan();
    if (!out || !out->pixels.resize(ground_.size())) return nullptr;
    out->width = pair.width;
    out->height = pair.height;
    out->channels = 1;
    out->health = pair.health;
    out->camera = camera_of(pair);
    port.send(last_stamp_ns_);
    return out;
  }

  /// False if no memory was to be had; so are those below.
  bool give_mask(const StereoPair& pair) {
    if (!mask_.connected()) return true;
    Image* out = send_like(mask_, pair);
    if (out) std::copy(ground_.begin(), ground_.end(), out->pixels.data());
    return out != nullptr;
  }

  bool give_confidence(const StereoPair& pair) {
    if (!confidence_.connected()) return true;
    Image* out = send_like(confidence_, pair);
    if (!out) return false;
    const Confidence confidence = detector_->confidence();
    for (int y = 0; y < out->height; ++y)
      for (int x = 0; x < out->width; ++x) out->view().at(x, y) = confidence.at(x, y);
    return true;
  }

  /// What was learnt, for a process that takes this one's place; not with this job if no memory is to be had.
  void give_textures() {
    Image* out = textures_.loan();
    const TextureMemory& memory = detector_->memory();
    if (!out || !out->pixels.resize(sizeof(Descriptor) * static_cast<size_t>(memory.size()))) return;
    out->width = sizeof(Descriptor);
    out->height = memory.size();
    out->channels = 1;
    for (int i = 0; i < memory.size(); ++i) {
      const Descriptor& d = memory.by_age(i);
      const uint8_t row[] = {d.s_min, d.s_max, d.v_min, d.v_max};
      std::copy(std::begin(row), std::end(row), out->view().row(i));
    }
    textures_.send(last_stamp_ns_);
  }

  bool give_grid(const FloorProjection& projection, const PlanarPose& robot) {
    if (!grid_.connected() && !terrain_.connected()) return true;
    GroundGrid& grid = *grid_cells_;
    grid.centre({robot.x_m, robot.y_m});
    // Before it has learnt, and in the dark, "not ground" means nothing.
    const bool knows_ground = detector_->memory().size() > 0 && !detector_->too_dark();
    if (!knows_ground) grid.see_nothing();
    else {
      grid.observe(ground(), projection.moved(robot), {robot.x_m, robot.y_m}, detector_->confidence());
      grid.accumulate();
      clear_specks();
    }
    // Without poses images cannot be laid over one another: what one image shows is all there is.
    const auto cells = has_pose_input() ? grid.map() : grid.observation();
    return give_terrain(cells, robot) && (!grid_.connected() || give_cells(cells));
  }

  bool give_cells(ImageView<const int16_t> cells) {
    Grid* out = grid_.loan();
    if (!out) return false;
    const Window& window = grid_cells_->window();
    const int half_cells = window.cells / 2;
    const double half_m = half_cells * window.cell_m;
    out->width = out->height = window.cells;
    out->cell_m = window.cell_m;
    out->origin_x_m = out->origin_y_m = -half_m;
    out->grid_in_map = {};
    out->grid_in_map.x = window.origin().x_m + half_m;
    out->grid_in_map.y = window.origin().y_m + half_m;
    const size_t count = static_cast<size_t>(window.cells) * static_cast<size_t>(window.cells);
    if (!out->cells.resize(count)) return false;
    std::copy_n(cells.data, count, out->cells.data());
    grid_.send(last_stamp_ns_);
    return true;
  }

  void clear_specks() {
    const auto scan = scan_at_image();
    if (!scan) return;
    auto pose = track_.at(scan_.stamp_ns(*scan));
    if (!pose) pose = track_.predicted(scan_.stamp_ns(*scan));
    if (!pose) return;
    const PlanarPose robot = planar(*pose);
    const Window& window = grid_cells_->window();
    const FloorPoint origin = window.origin();
    specks_->clear(grid_cells_->map(), [&](int column, int row) {
      const PlanarPose middle =
          between(robot, {origin.x_m + (column + 0.5) * window.cell_m, origin.y_m + (row + 0.5) * window.cell_m, 0});
      return sees_past(scan_[*scan], {middle.x_m, middle.y_m}, window.cell_m);
    });
  }

  bool give_terrain(ImageView<const int16_t> cells, const PlanarPose& robot) {
    cells_around(cells, grid_cells_->window(), robot, shape_, around_cells_);
    give_around(robot);
    if (!classifier_) return true;
    const Terrain& answer = classifier_->step(around_cells_);
    if (!terrain_.connected()) return true;
    Terrain* out = terrain_.loan();
    if (!out) return false;
    *out = answer;
    terrain_.send(last_stamp_ns_);
    return true;
  }

  /// What terrain is judged by, for whoever learns from a record; not with this job if no memory is to be had.
  void give_around(const PlanarPose& robot) {
    Grid* out = around_.loan();
    if (!out || !out->cells.resize(around_cells_.size())) return;
    out->width = shape_.columns;
    out->height = shape_.rows;
    out->cell_m = shape_.cell_m;
    out->origin_x_m = -shape_.left * shape_.cell_m;
    out->origin_y_m = -shape_.behind * shape_.cell_m;
    out->grid_in_map = {robot.x_m, robot.y_m, 0, std::cos(robot.theta_rad / 2), 0, 0, std::sin(robot.theta_rad / 2)};
    std::copy(around_cells_.begin(), around_cells_.end(), out->cells.data());
    around_.send(last_stamp_ns_);
  }

  void read_terrain_maps(const std::filesystem::path& file) {
    try {
      classifier_.emplace(read_terrain(file).learnt(), terrain_parameters());
    } catch (const TerrainError& error) {
      throw SetupError(error.what());
    }
    shape_ = classifier_->shape();
  }

  const Transform& mount_of(const StereoPair& pair) const {
    const Transform& t = pair.sensor_in_robot;
    const bool said = t.x != 0 || t.y != 0 || t.z != 0 || t.qx != 0 || t.qy != 0 || t.qz != 0;
    return said ? t : mount_;
  }

  TerrainParameters terrain_parameters() const {
    TerrainParameters p;
    p.centre = terrain_centre_() == 0 ? Centre::undecided : Centre::mean;
    p.correlation_min = terrain_correlation_;
    p.crossing_min = terrain_crossing_;
    p.up = static_cast<int>(std::lround(terrain_up_ * 1000));
    p.down = static_cast<int>(std::lround(terrain_down_ * 1000));
    return p;
  }

  DetectorParameters detector_parameters() const {
    if (mean_size_ % 2 == 0) throw SetupError("mean_size is " + mean_size_.value_text() + " px, must be odd");
    const double all = (n_b_ + 1) / 2.0;
    if (t_w_ >= all)
      throw SetupError("t_w is " + t_w_.value_text() + ", but the weights of n_b = " + n_b_.value_text() +
                       " entries add up to " + std::to_string(all) + " only: nothing would ever be ground");
    DetectorParameters p;
    p.trapezoid = {trapezoid_bottom_, trapezoid_top_, trapezoid_height_, trapezoid_skip_};
    p.t_m = t_m_;
    p.memory_entries = n_b_;
    p.t_w = t_w_;
    p.mean_size = mean_size_;
    p.light_min = light_min_;
    p.doubt = {bloom_, shade_deepest_, shade_faintest_, shade_saturation_,
               static_cast<uint8_t>(std::lround(doubt_ * kSure))};
    return p;
  }

  GridParameters grid_parameters() const {
    GridParameters p;
    p.cell_m = cell_;
    p.window_m = window_;
    p.range_max_m = range_max_;
    p.votes = votes_() == 0 ? Votes::columns : Votes::pixels;
    p.votes_min = votes_min_;
    p.up = static_cast<int>(std::lround(up_ * kOccupied));
    p.down = static_cast<int>(std::lround(down_ * kOccupied));
    p.beyond_px = mean_size_ / 2;
    return p;
  }

  Input<StereoPair> pair_{this, "pair", "rectified images, of which the left is used"};
  Input<LaserScan> scan_{this, "scan", "low horizontal scan: guards what is learnt", Need::optional};
  Input<Motion> motion_{this, "motion", "camera poses around the image's stamp; depth 16", Need::optional};
  Input<Odometry> odometry_{this, "odometry", "used if motion is not connected; depth 16", Need::optional};
  Input<HeadState> head_{this, "head", "where the camera sits on the head; depth 16", Need::optional};
  Output<Image> mask_{this, "mask", "255 ground, 0 not"};
  Output<Grid> grid_{this, "grid", "cells of the map frame around the robot"};
  Output<Image> textures_{this, "textures",
                          "texture memory, a row each, oldest first: least and most saturation, least and most value"};

  Output<Image> confidence_{this, "confidence", "of each pixel's verdict, 255 sure; less: blooming or a hard shadow"};
  Output<Terrain> terrain_{this, "terrain", "what the floor around the robot is like; needs terrain_maps"};
  Output<Grid> around_{this, "around", "cells around the robot, heading up: what terrain is judged by"};

  Param<double> trapezoid_bottom_{this, "trapezoid_bottom", 0.5, {0.0, 1.0}, "1", "reference area, of the width"};
  Param<double> trapezoid_top_{this, "trapezoid_top", 0.3, {0.0, 1.0}, "1", "reference area, of the width"};
  Param<double> trapezoid_height_{this, "trapezoid_height", 0.2, {0.0, 1.0}, "1", "reference area, of the height"};
  Param<double> trapezoid_skip_{this, "trapezoid_skip", 0.02, {0.0, 0.9}, "1", "lowest rows left out, of the height"};
  Param<double> t_m_{this, "t_m", 80.0, {0.0, 1e6}, "px", "pixels of a bin that counts, for an area of 24576 px"};
  Param<int> n_b_{this, "n_b", 500, {1, 10000}, "", "frames remembered; 100 s times the rate", kSizesMemory};
  Param<double> t_w_{this, "t_w", 0.9, {0.0, 5000.0}, "1", "sum of weights above which a pixel is ground"};
  Param<int> mean_size_{this, "mean_size", 9, {1, 31}, "px", "edge of the box average, odd"};
  Param<double> light_min_{
      this, "light_min", 50.0, {0.0, 255.0}, "1", "mean value of the reference area below which an image says nothing"};
  Param<int> bloom_{this, "bloom", 250, {1, 256}, "1", "value from which on a pixel may have bloomed"};
  Param<double> shade_deepest_{this, "shade_deepest", 0.3, {0.01, 1.0}, "1", "least light that a shadow leaves"};
  Param<double> shade_faintest_{this, "shade_faintest", 0.85, {0.01, 1.0}, "1", "most light that a shadow leaves"};
  Param<int> shade_saturation_{
      this, "shade_saturation", 10, {0, 255}, "1", "by how much saturation differs in a shadow"};
  Param<double> doubt_{this, "doubt", 0.25, {0.0, 1.0}, "1", "confidence where it may be blooming or a shadow"};
  Param<double> cell_{this, "cell", 0.30, {0.05, 1.0}, "m", "edge of a cell", kSizesMemory};
  Param<double> window_{this, "window", 18.0, {1.0, 100.0}, "m", "side of the grid around the robot", kSizesMemory};
  Param<double> range_max_{this, "range_max", 8.0, {0.5, 50.0}, "m", "farther floor is not looked at"};
  Choice votes_{this, "votes", "columns", {"columns", "pixels"}, "what votes for a cell: image columns or pixels"};
  Param<int> votes_min_{this, "votes_min", 5, {1, 100000}, "", "a cell with fewer votes in an image is not seen"};
  Param<double> up_{this, "up", 0.2, {0.0, 1.0}, "1", "added to a cell that an image surely shows blocked"};
  Param<double> down_{this, "down", 0.1, {0.0, 1.0}, "1", "taken off a cell that an image shows free"};
  Param<int> speck_{this, "speck",
                    0,    {0, 1000},
                    "",   "cells of an island of blocked ones that is free if the scanner sees past it; 0: none"};
  Param<double> scan_age_{this, "scan_age", 0.2, {0.0, 10.0}, "s", "between image and scan; none: nothing is learnt"};
  Param<std::string> terrain_maps_{this, "terrain_maps", "", kPath,
                                   "file with maps of each kind (takt terrain learn); empty: no terrain"};
  Param<std::string> calibration_{this, "calibration", "", kPath, "calibration file of raw pairs, as stereo has it"};
  Choice terrain_centre_{
      this, "terrain_centre", "undecided", {"undecided", "mean"}, "from where cells are counted in a correlation"};
  Param<double> terrain_correlation_{
      this, "terrain_correlation", 0.7, {-1.0, 1.0}, "1", "above it the best kind is believed; with `mean` 0.5"};
  Param<double> terrain_crossing_{
      this, "terrain_crossing", 0.9, {-1.0, 1.0}, "1", "the same for a crossing: 0.9 allows 1 blocked cell in 20"};
  Param<double> terrain_up_{this, "terrain_up", 0.2, {0.0, 1.0}, "1", "added to the hypothesis believed"};
  Param<double> terrain_down_{this, "terrain_down", 0.1, {0.0, 1.0}, "1", "taken off the others"};
  Param<double> camera_x_{this, "camera_x", 0.0, {-5.0, 5.0}, "m", "camera to the right, where the pair does not say"};
  Param<double> camera_y_{this, "camera_y", 0.0, {-5.0, 5.0}, "m", "camera ahead, where the pair does not say"};
  Param<double> camera_height_{
      this, "camera_height", 1.6, {0.0, 5.0}, "m", "above the floor, where the pair does not say"};
  Param<double> camera_tilt_{this, "camera_tilt", 0.0, {-1.6, 1.6}, "rad", "up positive, where the pair does not say"};
  Choice motion_camera_{
      this, "motion_camera", "same", {"same", "other"}, "whose motion comes: of this camera or another"};
  Param<double> motion_camera_x_{this, "motion_camera_x", 0.0, {-5.0, 5.0}, "m", "the other camera, to the right"};
  Param<double> motion_camera_y_{this, "motion_camera_y", 0.0, {-5.0, 5.0}, "m", "the other camera, ahead"};
  Param<double> motion_camera_height_{this, "motion_camera_height", 1.6, {0.0, 5.0}, "m", "the other camera"};
  Param<double> motion_camera_tilt_{this,  "motion_camera_tilt",           0.0, {-1.6, 1.6},
                                    "rad", "the other camera, up positive"};

  std::optional<GroundDetector> detector_;
  stereo::Remap undistort_;
  CameraModel camera_;             ///< of raw pairs, undistorted
  std::vector<uint8_t> straight_;  ///< the left image of a raw pair, undistorted; empty: raw pairs are not used
  std::vector<int8_t> remap_window_;
  std::vector<uint8_t> ground_;  ///< mask of the present image
  std::optional<GroundGrid> grid_cells_;
  std::optional<Specks> specks_;
  std::optional<TerrainClassifier> classifier_;
  TerrainShape shape_;
  std::vector<int16_t> around_cells_;
  Transform mount_, motion_mount_;
  RobotTrack track_{InputPort::kMaxDepth};
  int64_t last_stamp_ns_ = INT64_MIN;
};

}  // namespace

void register_ground_map(NodeTypes& types) {
  types.add<GroundMapNode>("ground_map", Layer::perception,
                           "Ground mask, 2-D occupancy grid and terrain from one camera");
}

}  // namespace takt
