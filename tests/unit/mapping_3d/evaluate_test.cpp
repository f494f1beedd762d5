// SPDX-License-Identifier: Apache-2.0
// What `takt eval mapping` measures, on few scenes: the figures that must hold on any.
#include "nodes/mapping_3d/evaluate.hpp"

#include <doctest/doctest.h>

using namespace takt;
using namespace takt::mapping_3d;

namespace {

void check_fusion(const FusionEvaluation& e) {
  const DepthFigures &single = e.methods[0], &merged = e.methods[1], &fused = e.methods.back();
  CHECK(fused.rms_m < 0.9 * single.rms_m);
  CHECK(fused.rms_all_m < 0.9 * single.rms_all_m);
  CHECK(fused.outliers_pct < 0.5 * single.outliers_pct);
  CHECK(fused.outliers_pct < 0.5 * merged.outliers_pct);
  CHECK(fused.points < merged.points);
  CHECK(std::abs(fused.bias_m) < 0.3 * single.rms_m);
}

}  // namespace

TEST_CASE("median fusion on generated walks: less noise, fewer outliers than one view or all merged") {
  FusionRuns runs;
  runs.runs = 4;
  check_fusion(evaluate_generated(runs));
}

TEST_CASE("a map of a room holds few points and nearly all surfaces; who walked through is not in it") {
  const RedundancyFigures room = evaluate_redundancy({}, 30, 2);
  CHECK(room.factor > 5);
  CHECK(room.points_a_voxel < 1.05);
  CHECK(room.completeness_pct >= 95);
  CHECK(room.exact_pct < room.completeness_pct);
  CHECK(room.plain.points > room.points);  // what was seen wrongly is in it
  CHECK(room.plain.rms_m > room.rms_m);
  CHECK(room.rms_m < 0.08);
  const GhostFigures ghosts = evaluate_ghosts({}, 2);
  CHECK(ghosts.plain > 100);
  CHECK(ghosts.cleared < 0.1 * static_cast<double>(ghosts.plain));
}

TEST_CASE("obstacles against generated worlds; a curb closes the way, a ramp does not") {
  for (const ObstacleFigures& scene : evaluate_obstacles(5, 3)) {
    CAPTURE(scene.scene);
    CHECK(scene.near_pct() >= 95);
    CHECK(scene.recall_pct() >= 75);
    if (scene.scene == "too high" || scene.scene == "nothing") CHECK(scene.claimed == 0);
    else CHECK(scene.visible > 10);
  }
  const EdgeFigures edges = evaluate_edges(5, 3);
  CHECK(edges.curb_rows_blocked_pct >= 98);
  CHECK(edges.before_curb_blocked_pct < 1);
  CHECK(edges.ramp_blocked_pct < 1);
  CHECK(edges.flat_ramp_blocked_pct > 20);
}

TEST_CASE("the memory of a drive does not grow; a correction at its end mends the map of a round") {
  MapperParameters p;
  p.map.tiles = 6;
  p.map.tile_points = 8192;
  const DriveFigures drive = evaluate_drive(p, 2, 1);
  REQUIRE(drive.parts.size() == 10);
  CHECK(drive.parts.back().points <= p.map.tiles * p.map.tile_points);
  CHECK(drive.parts.back().dropped > 1000);
  CHECK(drive.parts.back().tiles == p.map.tiles);
  const CorrectionFigures round = evaluate_correction({}, 1);
  CHECK(round.drift_m > 0.1);
  CHECK(round.after_m < 0.7 * round.before_m);
}
