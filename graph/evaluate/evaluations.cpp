// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/evaluations.hpp"

namespace takt::command {

void add_evaluations(CLI::App& app, Evaluations& o, int& exit_code) {
  CLI::App* eval = app.add_subcommand("eval", "measures quality against ground truth");
  eval->require_subcommand(1);
  add_eval_stereo(*eval, o.stereo, exit_code);
  add_eval_ego_motion(*eval, o.ego_motion, exit_code);
  add_eval_objects(*eval, o.objects, exit_code);
  add_eval_objects3d(*eval, o.objects3d, exit_code);
  add_eval_sift(*eval, o.sift, exit_code);
  add_eval_body_pose(*eval, o.body_pose, exit_code);
  add_eval_person_tracking(*eval, o.person_tracking, exit_code);
  add_eval_registration(*eval, o.registration, exit_code);
  add_eval_ground(*eval, o.ground, exit_code);
  add_eval_terrain(*eval, o.terrain, exit_code);
  add_eval_signs(*eval, o.signs, exit_code);
  add_eval_scan_matching(*eval, o.scan_matching, exit_code);
  add_eval_lms200(*eval, o.lms200, exit_code);
  add_eval_semantic(*eval, o.semantic, exit_code);
  add_eval_obstacle_stop(*eval, o.obstacle_stop, exit_code);
  add_eval_mapping(*eval, o.mapping, exit_code);
}

}  // namespace takt::command
