// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "graph/evaluate/evaluations.hpp"

namespace CLI {
class App;
}

namespace takt::command {

/// The options of every `takt eval TASK`.
struct Evaluations {
  EvalStereoOptions stereo;
  EvalEgoMotionOptions ego_motion;
  EvalObjectsOptions objects;
  EvalObjects3dOptions objects3d;
  EvalSiftOptions sift;
  EvalBodyPoseOptions body_pose;
  EvalPersonTrackingOptions person_tracking;
  EvalRegistrationOptions registration;
  EvalGroundOptions ground;
  EvalTerrainOptions terrain;
  EvalSignsOptions signs;
  EvalScanMatchingOptions scan_matching;
  EvalLms200Options lms200;
  EvalSemanticOptions semantic;
  EvalObstacleStopOptions obstacle_stop;
  EvalMappingOptions mapping;
};
/// Adds every TASK to the command line, whose options must live until it has been parsed.
void add_evaluations(CLI::App& eval, Evaluations& options, int& exit_code);

}  // namespace takt::command
