// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string_view>
#include <vector>

#include "graph/run/run.hpp"
#include "rt/file/output_file.hpp"

namespace takt::command {

/// The files of a run, claimed before anything starts and until its end: a second run into one of them is refused, with
/// the number of the first one's process. Empty: not asked for.
struct RunOutputs {
  std::optional<OutputFile> report, html, junit, trace;
  std::vector<WriterLock> locks;  ///< of the record and of the folder
  int code = 0;                   ///< the exit code of the run, if one of them could not be written; else 0

  /// Writes one of them, if it was asked for. What it did not take is on stderr then, and noted in `code`.
  void write(std::optional<OutputFile>& file, std::string_view content, const char* option);
};

/// Makes the folder of a run, or of a replay, and claims it; what is in the way is on stderr then. The exit code.
int claim_folder(const std::filesystem::path& folder, std::vector<WriterLock>& locks);

/// Fills `options.outputs`; what is in the way is on stderr then. The exit code.
int claim_outputs(RunOptions& options);

}  // namespace takt::command
