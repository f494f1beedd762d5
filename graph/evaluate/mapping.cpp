// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"
#include "nodes/cloud/cloud_file.hpp"
#include "nodes/mapping_3d/evaluate.hpp"
#include "nodes/mapping_3d/grid_file.hpp"
#include "nodes/picture/clouds.hpp"
#include "nodes/picture/image_file.hpp"

namespace takt::command {
namespace {

using namespace mapping_3d;
using Json = nlohmann::ordered_json;

/// One section of the result: printed as a table, or kept for the JSON object.
class Results {
 public:
  explicit Results(bool json) : json_(json) {}

  void fusion(const char* name, const std::string& key, const FusionEvaluation& e) {
    const DepthFigures &single = e.methods[0], &fused = e.methods.back();
    all_[key + "rms_m"] = fused.rms_m;
    all_[key + "rms_with_outliers_m"] = fused.rms_all_m;
    all_[key + "outliers_pct"] = fused.outliers_pct;
    all_[key + "density_pct"] = fused.density_pct;
    all_[key + "fusion_ms"] = e.time_ms;
    for (size_t i = 0; i + 1 < e.methods.size(); ++i) {
      Json& other = baseline_[e.methods[i].method];
      other[key + "rms_m"] = e.methods[i].rms_m;
      other[key + "rms_with_outliers_m"] = e.methods[i].rms_all_m;
      other[key + "outliers_pct"] = e.methods[i].outliers_pct;
    }
    if (json_) return;
    std::printf("%s: %.1f ms a fusion, RMS %.2f of a single view's\n", name, e.time_ms, fused.rms_m / single.rms_m);
    std::printf("  %-16s %9s %8s %14s %8s %11s %9s\n", "method", "points", "rms mm", "with outliers", "bias mm",
                "outliers %", "density %");
    for (const DepthFigures& f : e.methods)
      std::printf("  %-16s %9zu %8.1f %14.1f %8.1f %11.2f %9.1f\n", f.method.c_str(), f.points, 1e3 * f.rms_m,
                  1e3 * f.rms_all_m, 1e3 * f.bias_m, f.outliers_pct, f.density_pct);
  }

  void redundancy(const RedundancyFigures& r) {
    const auto tell = [](Json& into, const MapFigures& map) {
      into["redundancy_factor"] = map.factor;
      into["points_a_voxel"] = map.points_a_voxel;
      into["completeness_pct"] = map.completeness_pct;
      into["exact_voxel_completeness_pct"] = map.exact_pct;
      into["map_rms_m"] = map.rms_m;
    };
    tell(all_, r);
    tell(baseline_["plain merge"], r.plain);
    baseline_["points as seen"]["map_rms_m"] = r.seen_rms_m;
    all_["cloud_ms"] = r.time_ms;
    if (json_) return;
    std::printf("map of a room, %zu clouds, %.1f ms each: %zu points seen, %.1f mm off\n", r.clouds, r.time_ms,
                r.seen_points, 1e3 * r.seen_rms_m);
    std::printf("  %-16s %9s %7s %8s %20s %15s %8s\n", "", "points", "1 of", "a voxel", "complete within 1 %",
                "in the voxel %", "rms mm");
    const std::pair<const char*, const MapFigures*> maps[] = {{"plain merge", &r.plain}, {"the map", &r}};
    for (const auto& [name, map] : maps)
      std::printf("  %-16s %9zu %7.1f %8.2f %20.1f %15.1f %8.1f\n", name, map->points, map->factor, map->points_a_voxel,
                  map->completeness_pct, map->exact_pct, 1e3 * map->rms_m);
  }

  void ghosts(const GhostFigures& g) {
    all_["ghost_points"] = g.cleared;
    baseline_["plain merge"]["ghost_points"] = g.plain;
    baseline_["median fusion without clearing"]["ghost_points"] = g.fused;
    if (!json_)
      std::printf(
          "a person walks through: %zu points of him stay in a plain merge, %zu in fused clouds, %zu in the map\n",
          g.plain, g.fused, g.cleared);
  }

  void correction(const CorrectionFigures& c) {
    all_["corrected_m"] = c.after_m;
    baseline_["without correction"]["corrected_m"] = c.before_m;
    if (!json_)
      std::printf("a round that ends %.2f m off: map %.1f mm off, %.1f once it is laid anew\n", c.drift_m,
                  1e3 * c.before_m, 1e3 * c.after_m);
  }

  void obstacles(const std::vector<ObstacleFigures>& scenes) {
    if (!json_)
      std::printf("obstacles  %10s %12s %9s %9s %8s\n", "occupied", "precision %", "within 1", "visible", "recall %");
    ObstacleFigures sum;
    for (const ObstacleFigures& f : scenes) {
      sum.claimed += f.claimed, sum.right += f.right, sum.near += f.near, sum.visible += f.visible,
          sum.found += f.found;
      if (!json_)
        std::printf("%-10s %10zu %12.1f %9.1f %9zu %8.1f\n", f.scene.c_str(), f.claimed, f.precision_pct(),
                    f.near_pct(), f.visible, f.recall_pct());
    }
    all_["precision_pct"] = sum.precision_pct();
    all_["precision_within_a_cell_pct"] = sum.near_pct();
    all_["recall_pct"] = sum.recall_pct();
  }

  void edges(const EdgeFigures& e) {
    all_["curb_closed_pct"] = e.curb_rows_blocked_pct;
    all_["ramp_blocked_pct"] = e.ramp_blocked_pct;
    baseline_["floor at z = 0"]["ramp_blocked_pct"] = e.flat_ramp_blocked_pct;
    if (!json_)
      std::printf(
          "10 cm curb: %.1f %% of the columns closed, %.2f %% of the cells before it; 5 degree ramp: %.2f %% of the "
          "cells "
          "blocked, %.1f free (%.1f blocked with the floor at z = 0)\n",
          e.curb_rows_blocked_pct, e.before_curb_blocked_pct, e.ramp_blocked_pct, e.ramp_free_pct,
          e.flat_ramp_blocked_pct);
  }

  void drive(const DriveFigures& d) {
    const DriveFigures::Part &first = d.parts.front(), &last = d.parts.back();
    all_["drive_minutes"] = last.minutes;
    all_["drive_resident_mb"] = last.resident_mb;
    all_["drive_growth_mb"] = last.resident_mb - first.resident_mb;
    all_["drive_map_mb"] = d.map_mb;
    all_["drive_cloud_ms_p99"] = last.time_ms_p99;
    if (json_) return;
    std::printf("drive: the map takes %.1f MB once\n%8s %8s %6s %9s %10s %12s %7s %7s\n", d.map_mb, "minutes", "m",
                "tiles", "points", "dropped", "resident MB", "ms p50", "p99");
    for (const DriveFigures::Part& p : d.parts)
      std::printf("%8.1f %8.0f %6zu %9zu %10llu %12.1f %7.2f %7.2f\n", p.minutes, p.way_m, p.tiles, p.points,
                  static_cast<unsigned long long>(p.dropped), p.resident_mb, p.time_ms, p.time_ms_p99);
  }

  void finish() {
    all_["baseline"] = baseline_;
    if (json_) std::printf("%s\n", all_.dump(2).c_str());
  }

 private:
  bool json_;
  Json all_, baseline_;
};

void write(const EvalMappingOptions& o, const RedundancyFigures& room) {
  if (!o.out.empty())
    if (const auto written = cloud::write_cloud(o.out, room.map.view()); !written)
      throw std::runtime_error("--out " + written.error());
  if (!o.grid.empty())
    if (const auto written = write_grid(o.grid, room.grid); !written)
      throw std::runtime_error("--grid " + written.error());
  if (o.picture.empty()) return;
  const cloud::CloudView view = room.map.view();
  require_written(picture::write_image(o.picture, picture::draw_clouds({&view, 1})));
}

}  // namespace

int evaluate(const EvalMappingOptions& o) {
  Results results(o.json);
  FusionRuns runs;
  runs.views = o.views;
  runs.runs = o.runs;
  runs.seed = o.seed;
  results.fusion("generated walks", "", evaluate_generated(runs));
  if (!o.data.empty()) {
    std::vector<std::string> left_out;
    const FusionEvaluation recorded = evaluate_recorded(o.data, o.seed, left_out);
    for (const std::string& left : left_out) std::fprintf(stderr, "takt: %s\n", left.c_str());
    results.fusion("recorded views, each left out in turn", "recorded_", recorded);
  }
  MapperParameters p;
  p.views = o.views;
  const RedundancyFigures room = evaluate_redundancy(p, o.clouds, o.seed);
  write(o, room);
  results.redundancy(room);
  results.ghosts(evaluate_ghosts(p, o.seed));
  results.correction(evaluate_correction(p, o.seed));
  results.obstacles(evaluate_obstacles(o.runs, o.seed));
  results.edges(evaluate_edges(o.runs, o.seed));
  if (o.minutes > 0) results.drive(evaluate_drive(p, o.minutes, o.seed));
  results.finish();
  return kOk;
}

}  // namespace takt::command
