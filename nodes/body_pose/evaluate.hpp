// SPDX-License-Identifier: Apache-2.0
// How well bodies are found on generated scenes (thesis Sec. 3.5.3: of 150 pointing trials 80.2 % within 45 degrees,
// median error 6.8 degrees).
#pragma once
#include <cstdint>
#include <vector>

#include "nodes/body_pose/body_detector.hpp"
#include "nodes/body_pose/generated_scene.hpp"

namespace takt::body_pose {

/// A trial is right if the arm that points was fitted and its direction is off by at most this.
constexpr double kRight_deg = 45;

struct Figures {
  int trials = 0, found = 0, right = 0;
  int extra = 0;                  ///< bodies where there is none
  int valid = 0;                  ///< of those found: pass Eq. 3.11
  std::vector<double> angle_deg;  ///< of every pointing arm that was fitted
  std::vector<double> joint_m;    ///< error of every joint of bodies found
  int links = 0, missing = 0;     ///< of bodies found: all, and those reported missing
  std::vector<double> time_ms;    ///< CPU time of each scene

  double right_pct() const { return trials == 0 ? 0 : 100.0 * right / trials; }
};

/// The body of a scene among those found; null if none has its head within 0.35 m of the true one.
const DetectedBody* match(const TrueBody& truth, std::span<const DetectedBody> found);

/// Adds one scene.
void add(Figures& figures, const Skeleton& skeleton, const TrueBody& truth, std::span<const DetectedBody> found,
         double time_ms);

/// Person number 0 .. trials - 1 of a seed.
Figures measure_people(BodyDetector& detector, const SceneCamera& camera, uint64_t seed, int trials);

/// Any skeleton on make_any() scenes: fitted to all points of the scene above the floor, its start known. `right` is
/// every trial in which the first pointer of the skeleton is within 45 degrees.
Figures measure_any(const Skeleton& skeleton, const FitParameters& fit, const SceneCamera& camera, uint64_t seed,
                    int trials);

}  // namespace takt::body_pose
