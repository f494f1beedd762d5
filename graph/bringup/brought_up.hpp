// SPDX-License-Identifier: Apache-2.0
// Which devices of a graph somebody has tried on this robot, and whether its stop chain has stopped it.
//
//   auto known = BroughtUp::read(brought_up_file(state_folder(), "ace"));
//   for (const std::string& lack : lacks(graph, registry, *known)) ...   // "front_laser: was tried with other
//   settings"
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "graph/language/graph.hpp"

namespace takt {
struct Registry;
}

namespace takt::bringup {

/// What a trial was of, when (UTC), and how it ended.
struct Trial {
  std::string of;    ///< fingerprint of what was tried: with other settings it counts no more
  std::string at;    ///< "2026-11-30T19:04:11Z"
  std::string said;  ///< what was seen, in words
  bool passed = false;
  bool operator==(const Trial&) const = default;
};

struct BroughtUp {
  std::map<std::string, Trial> devices;
  Trial stop_chain;

  /// Nothing of a file that is not there. Error: it is no such file, with its name.
  static tl::expected<BroughtUp, std::string> read(const std::filesystem::path& file);
  /// Written beside and renamed. Error: why not.
  tl::expected<void, std::string> write(const std::filesystem::path& file, const std::string& graph) const;
};

/// bringup/GRAPH.json in the folder. Empty if the folder is.
std::filesystem::path brought_up_file(const std::filesystem::path& state_folder, const std::string& graph);

/// Changes with driver and settings of the device.
std::string fingerprint(const graph::DeviceSpec& device);
/// Changes with the base and with all that its `stop` depends on. Empty: nothing stops that base.
std::string stop_fingerprint(const graph::GraphSpec& graph, const std::string& base);

/// Devices of the graph that are real, in the order in which they are to be tried: those that move the robot last.
/// `doubles`: doubles count as real.
std::vector<const graph::DeviceSpec*> real_devices(const graph::GraphSpec& graph, const Registry& registry,
                                                   bool doubles = false);
/// Of these the one that drives; null: the graph does not.
const graph::DeviceSpec* base_of(const std::vector<const graph::DeviceSpec*>& devices);

/// Why the graph may not drive yet, a line each. Empty: it may, or has no real base.
std::vector<std::string> lacks(const graph::GraphSpec& graph, const Registry& registry, const BroughtUp& known);

}  // namespace takt::bringup
