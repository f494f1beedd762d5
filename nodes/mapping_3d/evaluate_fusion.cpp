// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "nodes/mapping_3d/evaluate.hpp"
#include "nodes/mapping_3d/recorded_views.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::mapping_3d {
namespace {

constexpr double kOutlier_m = 0.10;

/// Errors of depths, added up.
class Errors {
 public:
  explicit Errors(std::string method) : method_(std::move(method)) {}

  void add(const DepthCamera& camera, std::span<const float> depth_m, std::span<const float> truth_m) {
    for (size_t i = 0; i < camera.pixels(); ++i) {
      pixels_ += truth_m[i] > 0;
      if (!(depth_m[i] > 0)) continue;
      ++points_;
      const double error = nearest_error(camera, i, depth_m[i], truth_m);
      if (std::isfinite(error)) {
        ++judged_;
        all_squares_ += error * error;
      }
      const double limit = std::max(kOutlier_m, camera.step_per_m * depth_m[i] * depth_m[i]);
      if (!(std::abs(error) <= limit)) {
        ++outliers_;
        continue;
      }
      sum_ += error;
      squares_ += error * error;
    }
  }

  DepthFigures figures() const {
    const double good = std::max<double>(1, static_cast<double>(points_ - outliers_));
    return {method_,
            points_,
            std::sqrt(squares_ / good),
            std::sqrt(all_squares_ / std::max<double>(1, static_cast<double>(judged_))),
            100.0 * static_cast<double>(outliers_) / std::max<double>(1, static_cast<double>(points_)),
            sum_ / good,
            100.0 * static_cast<double>(points_) / std::max<double>(1, static_cast<double>(pixels_))};
  }

 private:
  static double nearest_error(const DepthCamera& camera, size_t pixel, float depth_m, std::span<const float> truth_m) {
    const int u = static_cast<int>(pixel) % camera.width, v = static_cast<int>(pixel) / camera.width;
    double nearest = std::numeric_limits<double>::infinity();
    for (int y = std::max(0, v - 1); y <= std::min(camera.height - 1, v + 1); ++y)
      for (int x = std::max(0, u - 1); x <= std::min(camera.width - 1, u + 1); ++x) {
        const float truth =
            truth_m[static_cast<size_t>(y) * static_cast<size_t>(camera.width) + static_cast<size_t>(x)];
        if (truth > 0 && std::abs(depth_m - truth) < std::abs(nearest)) nearest = depth_m - truth;
      }
    return nearest;
  }

  std::string method_;
  size_t points_ = 0, judged_ = 0, outliers_ = 0, pixels_ = 0;
  double sum_ = 0, squares_ = 0, all_squares_ = 0;
};

/// What is compared, over any number of windows.
class Comparison {
 public:
  /// Views and the exact depths of each.
  void add(std::span<const DepthView> views, size_t reference, std::span<const std::vector<float>> truth) {
    const DepthCamera& camera = views[reference].camera;
    single_.add(camera, views[reference].depth_m, truth[reference]);
    for (size_t k = 0; k < views.size(); ++k) merged_.add(camera, views[k].depth_m, truth[k]);
    fuse(views, reference, truth[reference]);
  }

  /// The same without what the reference itself measured.
  void add_held_out(std::span<const DepthView> views, size_t reference, std::span<const float> truth) {
    std::vector<float> nothing(views[reference].camera.pixels());
    std::vector<DepthView> others(views.begin(), views.end());
    others[reference].depth_m = nothing;
    std::vector<float> most, alone(nothing.size());
    size_t seen_by_most = 0;
    for (size_t k = 0; k < views.size(); ++k) {
      if (k == reference) continue;
      const DepthView two[] = {others[reference], others[k]};
      MedianFusion(2, nothing.size()).fuse(two, 0, {.support = 1}, alone);
      merged_.add(views[k].camera, alone, truth);
      const auto seen = static_cast<size_t>(std::count_if(alone.begin(), alone.end(), [](float z) { return z > 0; }));
      if (seen > seen_by_most) most = alone, seen_by_most = seen;
    }
    if (seen_by_most > 0) single_.add(views[reference].camera, most, truth);
    fuse(others, reference, truth);
  }

  FusionEvaluation result() const {
    return {{single_.figures(), merged_.figures(), printed_.figures(), fused_.figures()}, median(times_ms_)};
  }

 private:
  void fuse(std::span<const DepthView> views, size_t reference, std::span<const float> truth) {
    const DepthCamera& camera = views[reference].camera;
    MedianFusion fusion(views.size(), camera.pixels());
    std::vector<float> depth(camera.pixels());
    fusion.fuse(views, reference, {.refine = false, .support = 1}, depth);
    printed_.add(camera, depth, truth);
    const int64_t begin = thread_cpu_ns();
    fusion.fuse(views, reference, {}, depth);
    times_ms_.push_back(static_cast<double>(thread_cpu_ns() - begin) * 1e-6);
    fused_.add(camera, depth, truth);
  }

  Errors single_{"single view"}, merged_{"plain merge"}, printed_{"Alg. 4.1 alone"}, fused_{"median fusion"};
  std::vector<double> times_ms_;
};

}  // namespace

FusionEvaluation evaluate_generated(const FusionRuns& runs) {
  Comparison comparison;
  const WorldCamera& c = runs.camera;
  const DepthCamera camera =
      depth_camera_of(c.model(), c.step_px, static_cast<size_t>(c.width) * static_cast<size_t>(c.height));
  for (size_t run = 0; run < runs.runs; ++run) {
    Lot lot(runs.seed, run);
    const World world = furnished_room(runs.seed + run);
    const double angle = lot.in(0, 2 * std::numbers::pi), radius = 1.9;
    std::vector<Look> looks;
    std::vector<std::vector<float>> depths(runs.views), truths;
    std::vector<std::vector<Colour>> colours(runs.views);
    std::vector<DepthView> views;
    for (size_t k = 0; k < runs.views; ++k) {
      const double at = angle + static_cast<double>(k) * runs.step_m / radius;  // on a circle, looking along it
      const Transform robot = robot_at(radius * std::cos(at), radius * std::sin(at), at);
      looks.push_back(look(world, c, robot, lot));
      truths.push_back(looks[k].depth_m);
      depths[k].resize(camera.pixels());
      colours[k].resize(camera.pixels());
      DepthView view{camera, disturbed(looks[k].camera_in_world, runs.pose_sigma_m, runs.pose_sigma_rad, lot),
                     depths[k], colours[k]};
      draw(looks[k].points, looks[k].colours, view);
      views.push_back(view);
    }
    comparison.add(views, runs.views / 2, truths);
  }
  return comparison.result();
}

FusionEvaluation evaluate_recorded(const std::filesystem::path& folder, uint64_t seed,
                                   std::vector<std::string>& left_out) {
  const std::vector<RecordedView> recorded = read_recorded_views(folder, left_out);
  Lot lot(seed, 0);
  std::vector<std::vector<float>> noisy;
  for (const RecordedView& view : recorded) noisy.push_back(with_stereo_noise(view, lot));
  std::vector<DepthView> views;
  for (size_t k = 0; k < recorded.size(); ++k)
    views.push_back({recorded[k].camera, recorded[k].camera_in_world, noisy[k], {}});
  Comparison comparison;
  for (size_t k = 0; k < views.size(); ++k) comparison.add_held_out(views, k, recorded[k].depth_m);
  return comparison.result();
}

}  // namespace takt::mapping_3d
