// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "hal/replay/carmen_log.hpp"
#include "hal/settings/json.hpp"
#include "nodes/picture/draw.hpp"
#include "nodes/picture/image_file.hpp"
#include "nodes/scan_matching/evaluate.hpp"
#include "nodes/scan_matching/occupancy_map.hpp"

namespace takt::command {
namespace {

using namespace scan_matching;
using Json = nlohmann::ordered_json;

/// theta of a log is the driving direction, which is the robot's y axis (C-9).
PlanarPose robot(const PlanarPose& logged) { return {logged.x_m, logged.y_m, logged.theta_rad - std::numbers::pi / 2}; }

/// Scans that have a corrected pose, which is that of the scanner: it is the body here, carried along by the robot's
/// odometry. What it cannot see is no return.
Drive read_drive(const EvalScanMatchingOptions& options) {
  const auto log = replay::load_carmen_log("takt eval scan_matching", options.log);
  if (!log) throw std::runtime_error(log.error().text());
  for (const std::string& left : log->left_out) std::fprintf(stderr, "takt: %s\n", left.c_str());
  Drive drive;
  drive.first_angle_rad = log->first_angle_rad;
  drive.step_rad = log->step_rad;
  drive.beams = log->beams;
  for (size_t i = 0; i < log->scans.size(); ++i) {
    const replay::CarmenScan& scan = log->scans[i];
    if (!scan.corrected) continue;
    drive.scans.push_back({static_cast<double>(scan.time_ns) * 1e-9,
                           compose(robot(scan.odometry), {0, log->laser_ahead_m, 0}), robot(scan.logged)});
    for (size_t beam = i * log->beams; beam < (i + 1) * log->beams; ++beam) {
      const float range = log->range_m[beam];
      drive.range_m.push_back(range > 0 && range < log->max_range_m ? range : 0);
    }
  }
  if (drive.scans.size() < 2)
    throw std::runtime_error(fmt::format(
        "{}: {} scans have a corrected pose, two are needed: choose a log that a mapping program has corrected",
        options.log.string(), drive.scans.size()));
  return drive;
}

Json to_json(const ErrorFigures& e) {
  return {{"error_m", e.error_m},
          {"error_deg", e.error_deg},
          {"error_m_p95", e.error_m_p95},
          {"error_deg_p95", e.error_deg_p95},
          {"within_pct", e.within_pct},
          {"end_error_m", e.end_error_m},
          {"end_error_deg", e.end_error_deg}};
}

Json to_json(const PlaceError& e) {
  return {{"off_m", e.off_m},
          {"off_deg", e.off_deg},
          {"off_m_most", e.off_m_most},
          {"end_m", e.end_m},
          {"end_deg", e.end_deg}};
}

Json to_json(const Evaluation& e) {
  Json out = to_json(e.matched);
  out["steps"] = e.steps;
  out["path_m"] = e.path_m;
  out["place"] = to_json(e.place);
  out["place_closed"] = to_json(e.place_closed);
  out["loops"] = e.loops;
  out["loop_ms_max"] = e.loop_ms_max;
  for (size_t i = 0; i < e.outcomes.size(); ++i)
    if (e.outcomes[i] > 0) out["outcomes"][std::string(to_string(static_cast<Outcome>(i)))] = e.outcomes[i];
  out["gap_m"] = e.gap_m;
  out["gap_by_truth_m"] = e.gap_by_truth_m;
  out["apart_m"] = e.apart_m;
  out["apart_deg"] = e.apart_deg;
  out["within_95_pct"] = e.within_95_pct;
  out["time_ms"] = e.time_ms_p50;
  out["time_ms_max"] = e.time_ms_max;
  out["baseline"] = to_json(e.odometry);
  out["baseline"]["name"] = "wheel odometry";
  return out;
}

void print_row(const char* name, const ErrorFigures& e) {
  std::printf("%-18s %8.4f %8.4f %8.3f %8.3f %10.1f %9.2f %9.2f\n", name, e.error_m, e.error_m_p95, e.error_deg,
              e.error_deg_p95, e.within_pct, e.end_error_m, e.end_error_deg);
}

void print_place(const char* name, const PlaceError& e) {
  std::printf("%-18s %8.3f %8.3f %8.3f %9.2f %9.2f\n", name, e.off_m, e.off_m_most, e.off_deg, e.end_m, e.end_deg);
}

void print(const Evaluation& e) {
  const Limits limits;
  std::printf("%zu steps from scan to scan, %.0f m\n", e.steps, e.path_m);
  std::printf("%-18s %8s %8s %8s %8s %10s %9s %9s\n", "method", "m p50", "m p95", "deg p50", "deg p95", "within %",
              "end m", "end deg");
  print_row("takt scan_matching", e.matched);
  print_row("wheel odometry", e.odometry);
  std::printf("within: steps off by at most %.2f m and %.1f deg; end: all steps chained\n", limits.error_m,
              limits.error_deg);
  std::printf("%-18s %8s %8s %8s %9s %9s\n", "where it is", "m p50", "m most", "deg p50", "end m", "end deg");
  print_place("as matched", e.place);
  print_place("loops closed", e.place_closed);
  std::printf("%zu corrections; a look for a loop takes at most %.2f ms of CPU\n", e.loops, e.loop_ms_max);
  std::printf("surfaces of a scan and the one before, laid over each other: %.4f m apart, by the truth %.4f\n", e.gap_m,
              e.gap_by_truth_m);
  std::printf("steps by the map and by the scan before alone: %.4f m and %.3f deg apart (p50)\n", e.apart_m,
              e.apart_deg);
  for (size_t i = 0; i < e.outcomes.size(); ++i)
    if (e.outcomes[i] > 0)
      std::printf("%s: %zu\n", std::string(to_string(static_cast<Outcome>(i))).c_str(), e.outcomes[i]);
  std::printf("in the 95 %% ellipsoid of their covariance: %.1f %%; CPU ms a scan: p50 %.2f, max %.2f\n",
              e.within_95_pct, e.time_ms_p50, e.time_ms_max);
}

/// All scans where matching places them, in one map.
void write_map(const std::string& file, const Drive& drive, const std::vector<PlanarPose>& poses) {
  OccupancyParameters p;
  const auto [left, right] = std::minmax_element(
      poses.begin(), poses.end(), [](const PlanarPose& a, const PlanarPose& b) { return a.x_m < b.x_m; });
  const auto [low, high] = std::minmax_element(poses.begin(), poses.end(),
                                               [](const PlanarPose& a, const PlanarPose& b) { return a.y_m < b.y_m; });
  p.window_m = std::max(right->x_m - left->x_m, high->y_m - low->y_m) + 2 * p.range_max_m;
  OccupancyMap map(p);
  map.centre((left->x_m + right->x_m) / 2, (low->y_m + high->y_m) / 2);
  for (size_t i = 0; i < poses.size(); ++i) map.add(poses[i], drive.sweep(i));
  cv::Mat image(map.side(), map.side(), CV_8UC3);
  picture::draw_grid(map.cells(), 1, {image.data, image.cols, image.rows, 3, static_cast<ptrdiff_t>(image.step)});
  require_written(picture::write_image(file, image));
}

}  // namespace

int evaluate(const EvalScanMatchingOptions& options) {
  const Drive drive = options.log.empty() ? make_drive(furnished_room(options.seed), rounds(400), {}, options.seed)
                                          : read_drive(options);
  const Evaluation out = scan_matching::evaluate(drive, {}, !options.without_odometry, {});
  if (!options.picture.empty()) write_map(options.picture, drive, out.poses);
  if (options.json) std::printf("%s\n", to_json(out).dump(2).c_str());
  else print(out);
  return kOk;
}

}  // namespace takt::command
