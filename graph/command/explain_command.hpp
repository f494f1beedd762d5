// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace takt::command {

struct ExplainOptions {
  std::filesystem::path file;  ///< what `takt run --trace` or `--report` wrote
  std::string node;            ///< only this one; empty: all
  std::filesystem::path svg;   ///< picture of the largest miss; empty: none
};

/// `takt explain`: one sentence per missed job on stdout. Exit 0 also if no job missed, 2 for a file or node that is no
/// use.
int explain_misses(const ExplainOptions& options);

}  // namespace takt::command
