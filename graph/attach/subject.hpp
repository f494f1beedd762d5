// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "graph/language/registry.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/shm/transport.hpp"

namespace takt::attach {

/// What a running graph lets others see and change. All of it outlives who serves it.
struct Subject {
  const Registry& registry;
  const graph::GraphSpec& graph;
  const Plan& plan;  ///< composed with at least one tap
  RunBoard& board;
  Transport& transport;
  pid_t run = getpid();  ///< the process that stands for the run
  /// What froze the ring of the run, a sentence each. Any thread.
  std::function<std::vector<std::string>()> frozen = {};
  std::vector<std::string> processes = {};  ///< names, in the order of the board; empty: `run` does it all
  std::vector<size_t> process_of = {};      ///< by task: index into `processes`
  /// Where that was written; empty: nowhere.
  std::filesystem::path frozen_folder = {};
  /// Of a replay its record: it is shown, and cannot be changed. Empty: a run.
  std::string replay_of = {};
};

}  // namespace takt::attach
