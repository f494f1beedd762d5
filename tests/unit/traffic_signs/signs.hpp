// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "tests/graph_folder.hpp"

namespace takt::test {

/// The shipped signs.
inline const std::filesystem::path kSigns = graph_folder() / "signs";

}  // namespace takt::test
