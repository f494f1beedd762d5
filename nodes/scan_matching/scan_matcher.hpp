// SPDX-License-Identifier: Apache-2.0
// Laser odometry: where the robot is, scan by scan, from the scans themselves and what is expected between them.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "nodes/scan_matching/point_to_line.hpp"
#include "rt/state_archive.hpp"

namespace takt::scan_matching {

struct Parameters {
  MapParameters map;
  SearchParameters search;
  RefineParameters refine;
  double keyframe_m = 0.3, keyframe_rad = 0.2;  ///< a scan that far from the last keyframe becomes one
  double score_min = 0.4;                       ///< least share of a perfect score, 0..1
  double paired_min = 0.3;                      ///< least share of points with a mapped one beside them, 0..1
  int points_min = 20;                          ///< fewest points with a normal
  int refused_most = 5;                         ///< after so many refusals in a row the map begins anew
  // Standard deviations of what the odometry says: shares of distance and turn, turn in rad a metre, and what it may be
  // off standing still.
  double odometry_error = 0.1, odometry_turn_error = 0.1, odometry_drift_rad_m = 0.05;
  double odometry_floor_m = 0.02, odometry_floor_rad = 0.01;
  // Without odometry the last motion goes on; standard deviations.
  double acceleration_m_s2 = 1.0, turn_acceleration_rad_s2 = 2.0;
};

enum class Outcome : uint8_t {
  matched,
  first,           ///< nothing to compare with: the map begins here
  too_few_points,  ///< on lines
  poor_score,      ///< nothing within reach looks like this scan
  poor_pairs,      ///< too little of it overlaps with the map
  not_converged,   ///< it was led away from where it fitted
};
std::string_view to_string(Outcome outcome);

struct Match {
  Outcome outcome = Outcome::first;
  /// In the frame of the first scan. Where the scan was refused: as expected.
  PlanarPose robot_in_map;
  PlanarPose robot_in_previous;
  Covariance covariance = Covariance::Zero();  ///< of robot_in_previous
  UncertainPose accumulated;                   ///< robot_in_map with the covariances of all steps, taken as independent
  double score = 0;                            ///< share of a perfect one
  Refined refined;                             ///< as far as it came
  int points = 0;                              ///< with a normal
  bool keyframe = false;                       ///< the scan became part of the map
  bool map_anew = false;                       ///< after too many refusals, with this scan alone
  bool accepted() const { return outcome == Outcome::matched || outcome == Outcome::first; }
};

/// Allocates in the constructor only. One thread at a time.
class ScanMatcher {
 public:
  /// For scans of at most `beams` beams.
  ScanMatcher(size_t beams, const Parameters& parameters);
  /// From the next step() on; map and search stay as they were.
  void tune(Parameters parameters) {
    parameters.map = p_.map;
    parameters.search = p_.search;
    p_ = parameters;
  }

  /// The next scan, dt_s after the one before. `moved`: the robot in its frame of the scan before, by odometry.
  Match step(const Sweep& sweep, double dt_s, const std::optional<PlanarPose>& moved);

  /// Before the first scan: the pose at which it was taken; its map is lost.
  void resume(const UncertainPose& robot_in_map);

  /// Of the last scan, robot frame.
  std::span<const SurfacePoint> points() const { return points_; }
  const LocalMap& map() const { return map_; }
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, map_, pose_, keyframe_, last_step_, accumulated_, last_dt_s_, refused_, unsure_m_, unsure_rad_);
  }

 private:
  Expected expect(double dt_s, const std::optional<PlanarPose>& moved) const;
  Outcome match(const Expected& expected, Match& out);
  void keep(const PlanarPose& robot_in_map);

  Parameters p_;
  LocalMap map_;
  CorrelativeSearch search_;
  std::vector<SurfacePoint> points_;
  PlanarPose pose_, keyframe_, last_step_;
  UncertainPose accumulated_;
  double last_dt_s_ = 0;
  int refused_ = 0;
  double unsure_m_ = 0, unsure_rad_ = 0;  ///< standard deviations of what was expected since the last scan that fitted
};

}  // namespace takt::scan_matching
