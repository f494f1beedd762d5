// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "rt/param.hpp"

namespace takt::graph {

/// The folder of what Takt ships with: graph/signs, graph/worlds, schedules ... It is $TAKT_HOME, else share/takt in
/// the nearest folder above libtakt_core or above this program; a build folder has it too. Empty if there is none.
std::filesystem::path share_folder();

/// For a parameter of kind path that has its default: where that asset of the node type is. It is in the share folder;
/// a default that is not there, of a node type of your own, is looked for beside the graph as it stands.
std::string default_asset(const ParamBase& param);

/// The value of a parameter as records have it: an asset of the share folder by its name there ("signs"), wherever that
/// folder is; all else as it stands.
std::string recorded_text(const ParamBase& param);

}  // namespace takt::graph
