// SPDX-License-Identifier: Apache-2.0
// Revisions of an object database: copies that never change, named by their content. A running node takes up the one
// that its parameter `revision` names, and a replay finds the same bytes under the same name.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "nodes/object_detection/database.hpp"

namespace takt::object_detection {

/// Copies the list and the views it names to FOLDER.revisions/NAME, unless they are there, and returns the name, 16
/// hexadecimal digits. The copy appears as a whole. Throws DatabaseError if the database cannot be used or copied.
std::string publish_revision(const std::filesystem::path& folder, int side_px);

/// Where that revision lies.
std::filesystem::path revision_folder(const std::filesystem::path& folder, const std::string& name);
/// Reads that revision. Throws DatabaseError if it is not there or its content is not what its name says.
std::vector<DatabaseObject> read_revision(const std::filesystem::path& folder, const std::string& name, int side_px);

}  // namespace takt::object_detection
