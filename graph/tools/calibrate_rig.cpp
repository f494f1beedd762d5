// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <stdexcept>

#include "graph/cli/boundary.hpp"
#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/tools/calibrate_command.hpp"
#include "hal/camera/rig.hpp"
#include "hal/sim/simulation.hpp"
#include "nodes/stereo/calibration_file.hpp"
#include "nodes/stereo/rectify.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::command {
namespace {

/// Both cameras as the simulated world places them.
stereo::StereoCalibration calibration_of(const StereoRig& rig) {
  stereo::StereoCalibration c;
  c.width = rig.width;
  c.height = rig.height;
  c.left_matrix = c.right_matrix = {rig.focal_px, 0, rig.cu_px, 0, rig.focal_px, rig.cv_px, 0, 0, 1};
  c.left_distortion = c.right_distortion = rig.distortion;
  const sim::CameraPose left = sim::Simulation::camera_pose(rig, 0, {}, 0, 0),
                        right = sim::Simulation::camera_pose(rig, 1, {}, 0, 0);
  const sim::Mat3 left_in_right = right.rotation.transpose() * left.rotation;
  const sim::Vec3 shift_m = right.rotation.transpose() * (left.position - right.position);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      c.rotation[static_cast<size_t>(3 * row + column)] = left_in_right(row, column);
    c.translation_m[static_cast<size_t>(row)] = shift_m(row);
  }
  return c;
}

int calibrate_rig(const CalibrateRigOptions& o) {
  const auto rig = load_rig("calibrate", o.rig);
  if (!rig) return refuse(rig.error().what + "; " + rig.error().fix, kBadInput);
  if (rig->rectified)
    return refuse(o.rig.string() + ": the pairs are rectified already; only a rig with `rectified: false` needs one",
                  kBadInput);
  try {
    const stereo::StereoCalibration calibration = calibration_of(*rig);
    const CameraModel camera = stereo::rectification_tables(calibration).camera;
    stereo::write_calibration(o.out, calibration, "takt calibrate rig " + o.rig.filename().string());
    std::printf("rectified pairs of %d x %d px: focal length %.3f px, baseline %.4f m\nwritten to %s\n", rig->width,
                rig->height, camera.focal_px, camera.baseline_m, o.out.c_str());
    return kOk;
  } catch (const std::invalid_argument& error) {
    return refuse(error.what(), kBadInput);
  }
}

}  // namespace

void add_calibrate_rig(CLI::App& calibrate, CalibrateRigOptions& o, int& exit_code) {
  CLI::App* app = calibrate.add_subcommand(
      "rig", "the calibration of a simulated camera, exactly, from the rig file that describes it");
  reads_file(app->add_option("rig", o.rig, "rig file of raw pairs"))->required();
  writes_file(app->add_option("--out", o.out, "writes the calibration to this file (.yaml)"))->required();
  app->callback([&] { exit_code = calibrate_rig(o); });
}

}  // namespace takt::command
