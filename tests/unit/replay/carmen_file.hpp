// SPDX-License-Identifier: Apache-2.0
// CARMEN logs made up for a test.
#pragma once
#include <cstdio>
#include <filesystem>
#include <string>

#include "hal/replay/carmen_log.hpp"
#include "tests/temporary_folder.hpp"

namespace takt::test {

/// A file that lives as long as the object.
struct CarmenFile {
  TemporaryFolder folder;
  std::filesystem::path path;
  explicit CarmenFile(const std::string& text) : path(folder.write("carmen.log", text)) {}
};

inline std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.12g", value);
  return text;
}
inline std::string trailer(double time_s) { return " " + number(time_s) + " host " + number(time_s) + "\n"; }
inline std::string pose_text(const PlanarPose& p) {
  return " " + number(p.x_m) + " " + number(p.y_m) + " " + number(p.theta_rad);
}
inline std::string odom_line(double time_s, const PlanarPose& p) {
  return "ODOM" + pose_text(p) + " 0 0 0" + trailer(time_s);
}
/// `beams` ranges first, first + 0.01, first + 0.02 ... metres.
inline std::string ranges_text(int beams, double first) {
  std::string text = " " + std::to_string(beams);
  for (int i = 0; i < beams; ++i) text += " " + number(first + 0.01 * i);
  return text;
}
inline std::string flaser_line(double time_s, int beams, double first, const PlanarPose& p = {}) {
  return "FLASER" + ranges_text(beams, first) + pose_text(p) + pose_text(p) + trailer(time_s);
}
inline std::string rawlaser_line(double time_s, int beams, double first) {
  return "RAWLASER1 0 -1.5 3 0.02 25.5 0.01 0" + ranges_text(beams, first) + " 2 7 8" + trailer(time_s);
}

}  // namespace takt::test
