// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "rt/record/replayer.hpp"

namespace takt::command {

/// A part of a replay that one process runs.
struct ReplayPart {
  std::string name;
  record::Replayer::Options how;
};

/// Runs each part in a process of its own, all at once, and adds up what they found; `run_part` is called there. To be
/// called before this process has threads. Throws std::runtime_error if a process fails.
record::ReplayResult replay_isolated(const std::vector<ReplayPart>& parts,
                                     const std::function<record::ReplayResult(const ReplayPart&)>& run_part);

}  // namespace takt::command
