// SPDX-License-Identifier: Apache-2.0
// Puts the files of a machine file into a system, and takes them out again.
//
//   const auto applied = apply_files(system_files(machine), "/");
//   if (!applied) return refuse(applied.error(), kDeviceOrSystem);
#pragma once
#include <filesystem>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "graph/machine_file/settings.hpp"

namespace takt::graph {

/// What became of each file, by path.
struct Applied {
  std::vector<std::string> written;
  std::vector<std::string> removed;   ///< of an earlier machine file, or by undo
  std::vector<std::string> restored;  ///< what was there before
  std::vector<std::string> kept;      ///< somebody changed them since, so they were left
};

/// Where `root` keeps what is needed to undo: copies of what was there before, and the list of what was written.
std::filesystem::path state_folder(const std::filesystem::path& root);

/// Undoes what an earlier call did, then writes all files below `root`. What was there before is kept, and known before
/// the first file is written: a call that was cut off can be undone. Error: a file that cannot be written, with the
/// reason.
tl::expected<Applied, std::string> apply_files(const std::vector<SystemFile>& files, const std::filesystem::path& root);

/// Puts back what was there. Nothing was applied: nothing is done. Error: as above.
tl::expected<Applied, std::string> undo_files(const std::filesystem::path& root);

}  // namespace takt::graph
