// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/motion.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field_list.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// Motion of the camera between two stamps: camera_in_previous maps current camera coordinates into the previous frame.
struct Motion {
  static constexpr std::string_view type_name = "motion";
  int64_t from_stamp_ns = 0;  ///< stamp of the previous frame; the message's own stamp is the current one
  Transform camera_in_previous;
  Transform pose;  ///< accumulated since start: current camera in the first camera frame
  double confidence = 0;
  double rms_px = 0;
  int32_t corners = 0, matched = 0, inliers = 0;
  uint8_t valid = 0;     ///< 0: confidence too low, the motion was predicted instead of measured
  uint8_t keyframe = 0;  ///< 1: first frame, nothing to compare with
  void show(Viewer& to) const { to.pose(pose, "first_camera"); }
  TAKT_FIELDS(Motion, (from_stamp_ns, "ns"), (camera_in_previous), (pose), (confidence, "1"), (rms_px, "px"),
              (corners, "1"), (matched, "1"), (inliers, "1"), (valid, ""), (keyframe, ""))
};

}  // namespace takt
