// SPDX-License-Identifier: Apache-2.0
// Photographed objects on a turntable as a database, for measurements.
#pragma once
#include <filesystem>
#include <vector>

#include "nodes/object_detection/database.hpp"

namespace takt::object_detection {

/// The object of a photograph before a plain background, cut out at `side_px`: background is what hangs together with
/// the border and differs from the border's median colour by at most 30 in each channel. Throws std::runtime_error if
/// it cannot be read.
ReferenceView cut_out(const std::filesystem::path& file, int side_px);

/// Objects of a folder with files objNUMBER__ANGLE.png (COIL-100), by number: every 60 degrees a view, those between
/// for the test.
std::vector<DatabaseObject> read_turntable(const std::filesystem::path& folder, int side_px);

}  // namespace takt::object_detection
