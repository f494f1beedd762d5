// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/command/ego_motion_drive.hpp"

namespace takt::command {

/// The middle frame of a drive: corners (blue), displacements of matches that agree with the motion (green) and of
/// those that do not (red). Throws BadData if the file cannot be written.
void write_flow_picture(const std::string& file, const Drive& drive, const ego_motion::Parameters& parameters);

/// A curve over the values of a parameter.
struct Curve {
  std::string label;
  std::vector<double> values;
};

/// Curves one above the other, each with its own scale from 0, over the same values of `parameter`.
void write_curves(const std::string& file, const std::string& parameter, const std::vector<double>& values,
                  const std::vector<Curve>& curves);

}  // namespace takt::command
