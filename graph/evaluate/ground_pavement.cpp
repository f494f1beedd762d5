// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/ground_score.hpp"
#include "graph/evaluate/percent.hpp"
#include "hal/camera/rig.hpp"
#include "nodes/ground_map/ground_grid.hpp"
#include "nodes/ground_map/pavement_scene.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "nodes/picture/draw.hpp"
#include "nodes/picture/image_file.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using namespace ground_map;
using Json = nlohmann::ordered_json;

/// Seen cells of a map by how much of them is drivable (all of it, half and more, less) and what they are called (free,
/// undecided, occupied).
struct CellScore {
  std::array<std::array<int64_t, 3>, 3> cells{};
  int64_t called(size_t what) const { return cells[0][what] + cells[1][what] + cells[2][what]; }
};

double drivable_share(const PavementScene& scene, const FloorPoint& corner, double cell_m) {
  constexpr int kSamples = 6;
  int drivable = 0;
  for (int i = 0; i < kSamples * kSamples; ++i) {
    const int column = i % kSamples, row = i / kSamples;
    drivable +=
        scene.drivable({corner.x_m + (column + 0.5) * cell_m / kSamples, corner.y_m + (row + 0.5) * cell_m / kSamples});
  }
  return static_cast<double>(drivable) / (kSamples * kSamples);
}

void add_cells(CellScore& score, const PavementScene& scene, const GroundGrid& grid) {
  const Window& window = grid.window();
  for (int r = 0; r < window.cells; ++r)
    for (int c = 0; c < window.cells; ++c) {
      const int16_t cell = grid.map().at(c, r);
      if (cell == kUnknown) continue;
      const FloorPoint origin = window.origin();
      const double share =
          drivable_share(scene, {origin.x_m + c * window.cell_m, origin.y_m + r * window.cell_m}, window.cell_m);
      ++score.cells[share == 1 ? 0 : share >= 0.5 ? 1 : 2][cell < 300 ? 0 : cell <= 700 ? 1 : 2];
    }
}

/// Image with the mask in green beside the grid, forward up.
void write_picture(const std::string& file, const cv::Mat& image, const cv::Mat& mask, const GroundGrid& grid) {
  const int scale = std::max(1, image.rows / grid.window().cells), side = scale * grid.window().cells;
  cv::Mat out(std::max(image.rows, side), image.cols + 8 + side, CV_8UC3, cv::Scalar(40, 40, 40));
  cv::Mat left(out, cv::Rect(0, 0, image.cols, image.rows)), right(out, cv::Rect(image.cols + 8, 0, side, side));
  image.copyTo(left);
  picture::draw_mask(view(mask), writable(left));
  picture::draw_grid(grid.map(), scale, writable(right));
  require_written(picture::write_image(file, out));
}

/// What the ground map makes of a drive with one set of parameters.
class Mapped {
 public:
  Mapped(std::string name, const PavementOptions& make, const GroundParameters& p)
      : name_(std::move(name)),
        p_(p),
        detector_(make.width, make.height, p.detector),
        grid_(make.width, p.grid),
        mask_(make.height, make.width, CV_8U) {}

  void add(const PavementScene& scene, int frame, const cv::Mat& image, const cv::Mat& truth,
           const FloorProjection& in_robot, const std::vector<double>& true_borders) {
    const int64_t start = thread_cpu_ns();
    map_image(view(image), in_robot, scene.robot_in_map(frame), detector_, grid_, writable(mask_));
    times_.push_back(static_cast<double>(thread_cpu_ns() - start) / 1e6);
    ground_map::add(score_, view(mask_), view(truth));
    ground_map::add(doubt_, view(mask_), view(truth), detector_.confidence(), p_.grid.beyond_px);
    const FloorPoint foot{scene.camera_in_robot().x, scene.camera_in_robot().y};
    add_border_errors(free_range(view(mask_), 255, in_robot, foot, p_.grid.range_max_m), true_borders,
                      p_.grid.range_max_m, errors_);
    add_cells(cells_, scene, grid_);
  }

  Json row() const {
    Json out = ground_row(score_, &errors_, quantile(times_, 0.5));
    out["grid"] = {{"free_wrong_pct", percent(cells_.cells[2][0], cells_.called(0))},
                   {"blocked_wrong_pct", percent(cells_.cells[0][2], cells_.called(2))},
                   {"blocked_cells", cells_.called(2)},
                   {"confusion", cells_.cells}};
    out["false_borders_doubted_pct"] = doubt_.false_doubted_pct();
    out["true_borders_doubted_pct"] = doubt_.true_doubted_pct();
    return out;
  }
  const std::string& name() const { return name_; }
  void draw(const std::string& file, const cv::Mat& image) const { write_picture(file, image, mask_, grid_); }

 private:
  std::string name_;
  GroundParameters p_;
  GroundDetector detector_;
  GroundGrid grid_;
  cv::Mat mask_;
  MaskScore score_;
  DoubtScore doubt_;
  CellScore cells_;
  std::vector<double> errors_, times_;
};

/// One drive, with the trivial method beside.
struct Driven {
  Json rows = Json::object(), trivial;
};

Driven drive(const PavementOptions& make, std::vector<Mapped>& methods, const std::string& picture) {
  const PavementScene scene(make);
  const FloorProjection in_robot = floor_projection(scene.camera(), scene.camera_in_robot());
  const FloorPoint foot{scene.camera_in_robot().x, scene.camera_in_robot().y};
  const double range_m = GridParameters{}.range_max_m;
  cv::Mat image(make.height, make.width, CV_8UC3), truth(image.size(), CV_8U), mask(image.size(), CV_8U);
  bottom_is_ground(writable(mask));
  const auto trivial_borders = free_range(view(mask), 255, in_robot, foot, range_m);
  MaskScore trivial;
  std::vector<double> trivial_errors;
  for (int frame = 0; frame < make.frames; ++frame) {
    scene.render(frame, writable(image), writable(truth));
    const auto borders = free_range(view(truth), static_cast<uint8_t>(Truth::ground), in_robot, foot, range_m);
    for (Mapped& method : methods) method.add(scene, frame, image, truth, in_robot, borders);
    add(trivial, view(mask), view(truth));
    add_border_errors(trivial_borders, borders, range_m, trivial_errors);
  }
  if (!picture.empty()) methods.front().draw(picture, image);
  Driven out;
  for (const Mapped& method : methods) out.rows[method.name()] = method.row();
  out.trivial = ground_row(trivial, &trivial_errors, std::nullopt);
  return out;
}

/// A new stone every three metres, the four in turn.
std::vector<PavementPart> changing_stones(double end_m) {
  std::vector<PavementPart> parts{{}};
  for (int i = 1; 3 * i < end_m; ++i) {
    parts.push_back({3.0 * i});
    parts.back().surface = static_cast<Surface>(i % 4);
  }
  return parts;
}

Json variants(const PavementOptions& plain, const GroundParameters& p) {
  Json out = Json::object();
  const auto add = [&](const PavementOptions& make, std::vector<Mapped> methods) {
    out.update(drive(make, methods, "").rows);
  };
  GroundParameters forgets = p, sure = p;
  forgets.detector.memory_entries = 1;
  sure.detector.doubt.doubtful = kSure;
  for (const double brightness : {0.5, 0.75, 1.25, 1.5}) {
    PavementOptions make = plain;
    make.brightness = brightness;
    add(make, {{fmt::format("brightness x {}", brightness), make, p}});
  }
  PavementOptions make = plain;
  make.flicker = 0.5;
  add(make, {{"brightness x 0.5 .. 1.5 by image", make, p}, {"  no memory", make, forgets}});
  make = plain;
  make.parts = changing_stones(plain.frames * plain.frame_step_m + 25);
  add(make, {{"stones that change", make, p}, {"  they, no memory", make, forgets}});
  make = plain;
  make.hard_shadows = true;
  add(make, {{"hard shadows", make, p}, {"  they, nothing doubted", make, sure}});
  make = plain;
  make.glare = true;
  add(make, {{"glare", make, p}, {"  it, nothing doubted", make, sure}});
  return out;
}

/// Distances on the floor from pixels, against the exact camera: the largest error over turns of the head, and for the
/// fixed camera the errors of half a pixel and of the thesis's chain (Eq. 4.5 - 4.8, counted from the horizon).
Json projection_errors() {
  const auto rig_of = [](const char* name) {
    const auto rig = load_rig("takt eval ground", shipped(std::filesystem::path("graph/rigs") / name));
    if (!rig) throw std::runtime_error(rig.error().text());
    return *rig;
  };
  const auto pixel_of = [](const StereoRig& rig, const Transform& camera, double x_m, double y_m) {
    const Eigen::Vector3d p = Eigen::Quaterniond(camera.qw, camera.qx, camera.qy, camera.qz).conjugate() *
                              (Eigen::Vector3d(x_m, y_m, 0) - Eigen::Vector3d(camera.x, camera.y, camera.z));
    return ImagePoint{rig.cu_px + rig.focal_px * p.x() / p.z(), rig.cv_px + rig.focal_px * p.y() / p.z()};
  };
  Json out;
  std::mt19937 engine(1);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(engine); };
  double worst = 0;
  const StereoRig on_head = rig_of("xb3.yaml");
  for (int i = 0; i < 1000; ++i) {
    const double pan = uniform(-1, 1), tilt = uniform(-0.5, 0.1), range = uniform(1, 8),
                 bearing = pan + uniform(-0.4, 0.4);
    const double x = on_head.x_m - range * std::sin(bearing), y = on_head.y_m + range * std::cos(bearing);
    const ImagePoint pixel = pixel_of(on_head, camera_in_robot(on_head, pan, tilt), x, y);
    const auto found =
        floor_projection(on_head.camera(), mapping_3d::turned_by_head(camera_in_robot(on_head, 0, 0), pan, tilt))
            .floor_at(pixel.x_px, pixel.y_px);
    worst = std::max(worst, found ? std::hypot(found->x_m - x, found->y_m - y) : INFINITY);
  }
  out["turned_head_max_m"] = worst;
  const StereoRig fixed = rig_of("x2_wide.yaml");
  const Transform camera = camera_in_robot(fixed, 0, 0);
  const FloorProjection projection = floor_projection(fixed.camera(), camera);
  for (const double range : {1.0, 2.0, 4.0, 8.0}) {
    const double x = camera.x + 0.5, y = camera.y + range, f = fixed.focal_px, fall = -fixed.tilt_rad;
    const ImagePoint pixel = pixel_of(fixed, camera, x, y);
    const FloorPoint exact = *projection.floor_at(pixel.x_px, pixel.y_px),
                     below = *projection.floor_at(pixel.x_px + 0.5, pixel.y_px + 0.5);
    const double from_horizon = pixel.y_px - fixed.cv_px + f * std::tan(fall);
    const double thesis_y = f * camera.z * std::cos(fall) / from_horizon,
                 thesis_x = thesis_y * (pixel.x_px - fixed.cu_px) / f;
    out["at"].push_back({{"range_m", range},
                         {"exact_error_m", std::hypot(exact.x_m - x, exact.y_m - y)},
                         {"half_pixel_m", std::hypot(below.x_m - x, below.y_m - y)},
                         {"thesis_error_m", std::hypot(camera.x + thesis_x - x, camera.y + thesis_y - y)}});
  }
  return out;
}

}  // namespace

Json measure_pavement(const EvalGroundOptions& options) {
  PavementOptions make;
  make.seed = options.seed;
  make.frames = options.frames;
  const GroundParameters p = ground_parameters(options.set);
  std::vector<Mapped> method;
  method.emplace_back("takt ground_map", make, p);
  const Driven driven = drive(make, method, options.picture);
  Json out = driven.rows.front();
  out["frames"] = make.frames;
  if (options.variants) out["variants"] = variants(make, p);
  out["projection"] = projection_errors();
  out["baseline"] = driven.trivial;
  return out;
}

}  // namespace takt::command
