// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/registry.hpp>: graph, experimental.
#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/device_types.hpp"
#include "rt/node.hpp"

namespace takt {

/// Draws a message: a file, or nothing if it cannot be seen.
using Draw = std::optional<std::string> (*)(const MessageType& type, const void* message);
/// For `takt echo --png` and `--ply`. Null: this program does not draw (graph/pictures/pictures.hpp does).
struct Pictures {
  Draw png = nullptr, ply = nullptr;
};

/// Between which vector instructions nodes choose when they start. Results may depend on it, so records name it. Null:
/// no node of this program chooses.
struct VectorTargets {
  std::vector<std::string> (*names)() = nullptr;  ///< of what this machine has, the best first: that one is taken
  void (*leave_out)(size_t count) = nullptr;      ///< the best so many are no longer taken; before nodes are made
};

/// What a program knows: its node types and devices. Everything that reads or runs a graph takes one.
///
///     Registry registry = ace_registry();
///     registry.nodes.add<Blinker>("blinker", Layer::processing, "blinks");
///     const graph::Loaded loaded = graph::load("my.yaml", {}, registry);
///
/// A value, filled before its first use and not changed after; it outlives what was made with it. Reading it is safe
/// in any thread.
struct Registry {
  NodeTypes nodes;
  hal::DeviceTypes devices;
  Pictures pictures;
  VectorTargets vectors;
  std::vector<void (*)()> before_jobs;  ///< called in each process that runs jobs, before it makes threads
  /// Called before the setup of each node with "FILE:LINE:COLUMN: error: NODE", and with "" after it; empty: nobody
  /// asks.
  std::function<void(std::string_view node)> setting_up = {};
  /// Where nodes are known by their description only: what a process that runs jobs knows, into which this loads the
  /// plug-ins then. Throws std::runtime_error. See of_jobs().
  std::function<const Registry&()> load_for_jobs = {};
};

/// The registry with which jobs are run: `registry`, unless that has descriptions in the place of plug-ins. Once a
/// process, which makes no other process from then on.
inline const Registry& of_jobs(const Registry& registry) {
  return registry.load_for_jobs ? registry.load_for_jobs() : registry;
}

}  // namespace takt
