// SPDX-License-Identifier: Apache-2.0
// A run as `takt top` has heard of it over graph/attach: what it is, how it stands, its last jobs and events.
//
//   Watched run = watched(*connection.read_line());  // the answer to {"do": "describe"}
//   while (const auto line = connection.read_line()) take(*line, run);
//
// Plain data, so that pages can be made of any run. One thread.
#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "graph/attach/machine_use.hpp"
#include "hal/settings/json.hpp"

namespace takt::top {

using Json = nlohmann::ordered_json;

constexpr double kHistory_s = 10;     ///< jobs are kept that long
constexpr size_t kMostEvents = 5000;  ///< of these the newest are kept

/// Instants of the run.
struct JobSeen {
  double release_s = 0, start_s = 0, finish_s = 0;
};

struct NodeSeen {
  std::string name, process, criticality;
  bool device = false;
  std::optional<double> rate_hz, budget_ms, proven_ms;
  double deadline_ms = 0;
  size_t levels = 1;
  uint64_t completed = 0, deadline_misses = 0, skipped = 0, paused = 0, overruns = 0;
  int64_t level = 0;
  double exec_ms = 0, response_ms = 0, response_max_ms = 0;
  std::deque<JobSeen> jobs;
  bool jobs_unseen = false;  ///< it had more jobs between two looks than the board keeps
};

struct ChainSeen {
  std::string name, from, to;
  double bound_ms = 0;
  std::optional<double> proven_ms, age_ms, age_max_ms;
};

struct DeviceSeen {
  std::string name, state, trouble;
  uint64_t losses = 0, received = 0, damaged = 0, resyncs = 0, missing = 0, unsent = 0;
};

struct ProcessSeen {
  std::string name, state;
  int pid = 0;
  uint64_t restarts = 0;
  std::optional<double> cpu;  ///< cores
  double own_mb = 0;
};

struct EventSeen {
  double at_s = 0;
  std::string kind, node, text;
  std::string level = {};  ///< of kind `log`
};

struct Watched {
  std::string graph, profile, policy, mode;
  int pid = 0;
  bool heard = false;  ///< it has said how it stands
  double running_s = 0;
  std::vector<NodeSeen> nodes;
  std::vector<ChainSeen> chains;
  std::vector<DeviceSeen> devices;
  std::vector<ProcessSeen> processes;
  std::vector<std::string> parameters;  ///< a sentence for each that differs from the graph's file
  std::deque<EventSeen> events;         ///< newest last
  size_t events_left_out = 0;           ///< older ones
  attach::MachineUse::Use use;
};

/// Throws Json::exception for what is no description.
Watched watched(const Json& description);

/// A line of one who follows. Throws Json::exception for a line that is of another kind.
void take(const Json& line, Watched& run);

/// `use` of the run's processes, in their order.
void take_use(const attach::MachineUse::Use& use, Watched& run);

}  // namespace takt::top
