// SPDX-License-Identifier: Apache-2.0
// Photographed objects on a turntable as a database, for measurements.
#pragma once
#include <filesystem>
#include <vector>

#include "nodes/object_detection/database.hpp"

namespace takt::object_detection {

/// Objects of a folder with files objNUMBER__ANGLE.png (COIL-100), by number: every 60 degrees a view, those between
/// for the test.
std::vector<DatabaseObject> read_turntable(const std::filesystem::path& folder, int side_px);

}  // namespace takt::object_detection
