// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/evaluate/ego_motion_drive.hpp"

namespace takt::command {

/// The middle frame of a drive: corners (blue), displacements of matches that agree with the motion (green) and of
/// those that do not (red). Throws BadData if the file cannot be written.
void write_flow_picture(const std::string& file, const Drive& drive, const ego_motion::Parameters& parameters);

}  // namespace takt::command
