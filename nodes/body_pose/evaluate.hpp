// SPDX-License-Identifier: Apache-2.0
// How well bodies are found on generated scenes (thesis Sec. 3.5.3: of 150 pointing trials 80.2 % within 45 degrees,
// median error 6.8 degrees).
#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "nodes/body_pose/body_detector.hpp"
#include "nodes/body_pose/generated_scene.hpp"

namespace takt::body_pose {

/// A trial is right if the arm that points was fitted and its direction is off by at most this.
constexpr double kRight_deg = 45;

/// Why trials were wrong; each has one cause.
struct Misses {
  int no_candidate = 0;  ///< no cluster begins at the head
  int refused = 0;       ///< the fit of its cluster was no body
  int arm_missing = 0;   ///< the body was found without the arm that points
  int other_arm = 0;     ///< its other arm points there: left and right were taken for each other
  int elsewhere = 0;     ///< neither does
  int hidden = 0;        ///< of all these: hardly a point of the arm was to be seen
};

struct Figures {
  int trials = 0, found = 0, right = 0;
  Misses misses;
  int extra = 0;                  ///< bodies where there is none
  int valid = 0;                  ///< of those found: pass Eq. 3.11
  std::vector<double> angle_deg;  ///< of every pointing arm that was fitted
  std::vector<double> joint_m;    ///< error of every joint of bodies found
  int links = 0, missing = 0;     ///< of bodies found: all, and those reported missing
  std::vector<double> time_ms;    ///< CPU time of each scene
  double searched = 0;            ///< share of the rotations of all candidates, sum over the scenes

  double right_pct() const { return trials == 0 ? 0 : 100.0 * right / trials; }
};

/// The body of a scene among those found; null if none has its head within 0.35 m of the true one.
const DetectedBody* match(const TrueBody& truth, std::span<const DetectedBody> found);

/// What was made of one scene.
struct Outcome {
  std::span<const DetectedBody> found;
  bool candidate = true;    ///< a cluster begins at the true head
  bool arm_hidden = false;  ///< fewer than kArmPoints points lie on the arm that points
  double time_ms = 0, searched = 1;
};
constexpr int kArmPoints = 25;  ///< of an arm whose direction is to be seen; one in the open has some 150 to 400

/// Adds one scene.
void add(Figures& figures, const Skeleton& skeleton, const TrueBody& truth, const Outcome& outcome);

/// Person number 0 .. trials - 1 of a seed. The search of each scene ends after so much CPU time, as the node's does at
/// its budget less its reserve.
Figures measure_people(BodyDetector& detector, const SceneCamera& camera, uint64_t seed, int trials,
                       double search_ms = std::numeric_limits<double>::infinity());

/// Any skeleton on make_any() scenes: fitted to all points of the scene above the floor, its start known. `right` is
/// every trial in which the first pointer of the skeleton is within 45 degrees.
Figures measure_any(const Skeleton& skeleton, const FitParameters& fit, const SceneCamera& camera, uint64_t seed,
                    int trials);

}  // namespace takt::body_pose
