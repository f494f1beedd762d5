// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "tests/graph_folder.hpp"

namespace takt::test {

/// The shipped database.
inline const std::filesystem::path kObjects = graph_folder() / "objects";

}  // namespace takt::test
