// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "graph/cli/graph_file.hpp"
#include "graph/compose/composition.hpp"
#include "graph/language/registry.hpp"
#include "graph/run/run.hpp"
#include "hal/devices.hpp"

namespace takt::command {

/// A graph that is loaded, checked and composed, with everything it refers to. Order matters: nodes go before devices.
struct Prepared {
  explicit Prepared(const Registry& with) : registry(with) {}
  const Registry& registry;
  std::optional<graph::GraphSpec> graph;
  std::unique_ptr<Clock> clock;
  hal::Devices devices;
  std::optional<graph::Composition> composition;
  std::vector<graph::Problem> problems;  ///< why there is no composition
  bool plugged = true;                   ///< hardware is there and is opened
  /// Where what other machines give comes in; needed for the part of one machine.
  std::function<std::unique_ptr<RemoteSource>(const graph::DeviceSpec&, const std::vector<RemoteNode::Port>&)>
      remote_source = {};
};

/// Loads the graph; what is wrong is written to stderr and the exit code returned (kOk: all is well). The caller tells
/// how many problems there were.
int load(const RunOptions& options, Prepared& prepared);
/// Composes what is loaded, or the part of it that `compose` says; problems as above.
int compose(const RunOptions& options, const graph::ComposeOptions& compose, Prepared& prepared);
/// Both, for what is not run: hardware need not be there.
int prepare_check(const RunOptions& options, Prepared& prepared);

}  // namespace takt::command
