// SPDX-License-Identifier: Apache-2.0
// Errors of laser odometry from scan to scan against the truth, with wheel odometry beside it.
#pragma once
#include <array>
#include <vector>

#include "nodes/scan_matching/drive.hpp"
#include "nodes/scan_matching/loop_closer.hpp"
#include "nodes/scan_matching/scan_matcher.hpp"

namespace takt::scan_matching {

/// Of the motion between two scans that follow one another.
struct StepError {
  double error_m = 0, error_rad = 0;
};

struct ErrorFigures {
  double error_m = 0, error_deg = 0;  ///< medians
  double error_m_p95 = 0, error_deg_p95 = 0;
  double within_pct = 0;                      ///< steps within both limits
  double end_error_m = 0, end_error_deg = 0;  ///< of all steps chained
};

/// Of where the robot is, in the frame of the first scan.
struct PlaceError {
  double off_m = 0, off_deg = 0;  ///< medians
  double off_m_most = 0;
  double end_m = 0, end_deg = 0;  ///< at the last scan
};

struct Evaluation {
  ErrorFigures matched, odometry;
  size_t steps = 0;
  std::array<size_t, 6> outcomes{};  ///< steps by Outcome
  /// How far the surfaces of a scan lie from those of the one before (m, medians over the steps of their mean), laid
  /// over each other by matching and by the truth: what the truth is worth.
  double gap_m = 0, gap_by_truth_m = 0;
  /// Median difference between a step and the same one by matching with the scan before alone. These two share no map:
  /// an error much larger than this is not matching's but the truth's.
  double apart_m = 0, apart_deg = 0;
  double within_95_pct = 0;        ///< accepted steps whose error lies within the 95 % ellipsoid of their covariance
  PlaceError place, place_closed;  ///< as matched; with loops closed, as the robot knows it at each scan
  size_t loops = 0;                ///< corrections
  double path_m = 0;
  double time_ms_p50 = 0, time_ms_max = 0;  ///< CPU time of a step
  double loop_ms_max = 0;                   ///< of a look for a loop
  std::vector<PlanarPose> poses;            ///< of each scan, in the frame of the first
};

struct Limits {
  double error_m = 0.10, error_deg = 2;
};

StepError error_between(const PlanarPose& estimated, const PlanarPose& truth);

/// All steps count, refused ones with what was expected. `with_odometry` false: matching has no odometry to start from.
Evaluation evaluate(const Drive& drive, const Parameters& parameters, bool with_odometry, const Limits& limits);

}  // namespace takt::scan_matching
