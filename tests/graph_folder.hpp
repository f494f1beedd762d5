// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace takt::test {

/// The shipped graphs, with their worlds and rigs.
inline std::filesystem::path graph_folder() { return std::filesystem::path(TAKT_SOURCE_DIR) / "graph"; }

}  // namespace takt::test
