// SPDX-License-Identifier: Apache-2.0
// All machines of a graph run at once, from one place, over ssh.
//
//   up::Options options{.graph = "graph/two_machines.yaml", .out = "out", .length_s = 30};
//   for (const up::Part& part : up::run(graph.machines, options)) ...   // part.machine, part.code, part.report
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"

namespace takt::up {

inline constexpr int kLost = 255;  ///< exit code of a part whose connection ended before it did, as ssh has it

struct Options {
  std::string graph;             ///< as the machines name it, from `folder` on
  std::filesystem::path out;     ///< here: MACHINE.json and MACHINE.mcap; there, from `folder` on, OUT/MACHINE
  double length_s = 0;           ///< of the run; 0: until somebody stops it
  bool record = false;           ///< each part records, and its record is fetched
  std::string folder;            ///< there; empty: where ssh begins
  std::string program = "takt";  ///< there, as a shell reads it
  std::string ssh = "ssh";       ///< as RemoteShell::over() takes it
  std::string more;              ///< options of `takt run` on all machines, as a shell reads them
  std::map<std::string, std::string> hosts;  ///< by machine; of those that it lacks, the address in the graph
  std::function<bool()> stopped;             ///< whether all of them are to end
  std::function<void(std::string_view machine, std::string_view line)> told;  ///< what a part prints; any thread
};

/// What became of the run on a machine.
struct Part {
  std::string machine, host;
  int code = kLost;               ///< of `takt run` there, or kLost
  bool told_to_end = false;       ///< before it ended by itself
  std::string trouble;            ///< why it has no code or no report of its own
  nlohmann::ordered_json report;  ///< null: there is none
};

/// In the order of `machines`. Returns once all parts have ended: after `length_s`, when `stopped` says so, or when one
/// of them was refused, failed, or was not reached. A part whose connection breaks later ends, too; the others go on, in
/// the mode that the graph has for a lost machine. Blocks; one call at a time.
std::vector<Part> run(const std::vector<graph::MachineSpec>& machines, const Options& options);

}  // namespace takt::up
