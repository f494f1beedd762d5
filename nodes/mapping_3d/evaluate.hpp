// SPDX-License-Identifier: Apache-2.0
// How good maps are, on generated worlds and on recorded depth images, beside what is simpler.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "nodes/mapping_3d/cloud_mapper.hpp"
#include "nodes/mapping_3d/generated_world.hpp"
#include "nodes/mapping_3d/map_grid.hpp"

namespace takt::mapping_3d {

/// Depths against the truth; that of a pixel is the nearest of the nine around it, so that half a pixel at the edge of
/// a thing is no error.
struct DepthFigures {
  std::string method;
  size_t points = 0;
  double rms_m = 0;         ///< of those that are no outliers
  double rms_all_m = 0;     ///< of all; only where the truth has nothing around there is no error to count
  double outliers_pct = 0;  ///< farther off than 0.10 m and than a step of the disparity
  double bias_m = 0;        ///< mean error of those that are none; negative: too near
  double density_pct = 0;   ///< points a pixel of the truth
};

/// Single views, all views merged as they are, the median of the views as Alg. 4.1 leaves it and as it is by default.
struct FusionEvaluation {
  std::vector<DepthFigures> methods;
  double time_ms = 0;  ///< CPU time of one fusion, median
};
struct FusionRuns {
  size_t views = 5, runs = 10;
  double step_m = 0.15;                                 ///< between two views
  double pose_sigma_m = 0.005, pose_sigma_rad = 0.002;  ///< errors of their poses
  uint64_t seed = 1;
  WorldCamera camera;
};
FusionEvaluation evaluate_generated(const FusionRuns& runs);

/// Recorded depth images with poses (depth/1.png .., pose.txt): each in turn is left out, and what the others say of
/// its view is held against it. The single view is the one that sees most of it. All get the noise of a stereo camera
/// first. Throws std::runtime_error naming the file.
FusionEvaluation evaluate_recorded(const std::filesystem::path& folder, uint64_t seed,
                                   std::vector<std::string>& left_out);

/// What a map keeps of what was seen, and how true it is.
struct MapFigures {
  size_t points = 0;
  double factor = 0;            ///< seen points for each that the map keeps
  double points_a_voxel = 0;    ///< in voxels of the world's lattice that hold any
  double completeness_pct = 0;  ///< voxels of the true surfaces, seen twice, with a point of the map within a voxel
  double exact_pct = 0;         ///< the same voxels with a point of the map in them
  double rms_m = 0;             ///< of all points, from the true surfaces
};

/// A walk around a room: the map, and beside it the same clouds merged as they are, one point a voxel.
struct RedundancyFigures : MapFigures {
  size_t clouds = 0, seen_points = 0;
  MapFigures plain;
  double seen_rms_m = 0;  ///< of all points seen, as they are
  double time_ms = 0;     ///< CPU time of a cloud, median
  cloud::Cloud map;
  GridMap grid;
};
RedundancyFigures evaluate_redundancy(const MapperParameters& parameters, size_t clouds, uint64_t seed);

/// A person walks through the room before a robot that stands: points of the map where only he has been.
struct GhostFigures {
  size_t plain = 0;    ///< all clouds merged, one point a voxel
  size_t fused = 0;    ///< window alone
  size_t cleared = 0;  ///< and what later views look through goes
};
GhostFigures evaluate_ghosts(const MapperParameters& parameters, uint64_t seed);

/// A long drive: how much memory, and how long a cloud takes, each after a tenth of it.
struct DriveFigures {
  struct Part {
    double minutes = 0, way_m = 0;
    size_t tiles = 0, points = 0;
    uint64_t dropped = 0;
    double resident_mb = 0, time_ms = 0, time_ms_p99 = 0;
  };
  std::vector<Part> parts;
  double map_mb = 0;  ///< taken at the start
};
DriveFigures evaluate_drive(const MapperParameters& parameters, double minutes, uint64_t seed);

/// A round whose odometry drifts, and that learns at its end where it is.
struct CorrectionFigures {
  double drift_m = 0;
  double before_m = 0, after_m = 0;  ///< rms distance of the map's points from the true surfaces
};
CorrectionFigures evaluate_correction(const MapperParameters& parameters, uint64_t seed);

/// Cells of the obstacle grid against the world.
struct ObstacleFigures {
  std::string scene;
  size_t claimed = 0, right = 0, near = 0;  ///< occupied cells; that hold an obstacle; or lie beside one that does
  size_t visible = 0, found = 0;            ///< cells with an obstacle that a quarter of a face's rays, and ten, meet
  double precision_pct() const { return percent(right, claimed); }
  double near_pct() const { return percent(near, claimed); }
  double recall_pct() const { return percent(found, visible); }
  static double percent(size_t part, size_t all) {
    return all > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(all) : 100;
  }
};
/// Tables, overhangs, people, boxes: `runs` scenes each.
std::vector<ObstacleFigures> evaluate_obstacles(size_t runs, uint64_t seed);

/// A curb and a ramp before the robot: which share of the cells on the way is occupied, per row across it.
struct EdgeFigures {
  double curb_rows_blocked_pct = 0;  ///< columns across the way that a 10 cm curb closes
  double before_curb_blocked_pct = 0;
  double ramp_blocked_pct = 0;  ///< of the cells of a 5 degree ramp
  double ramp_free_pct = 0;
  double flat_ramp_blocked_pct = 0;  ///< the same with the floor taken to be z = 0
};
EdgeFigures evaluate_edges(size_t runs, uint64_t seed);

}  // namespace takt::mapping_3d
