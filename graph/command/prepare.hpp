// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <optional>

#include "graph/command/run_command.hpp"
#include "graph/compose/composition.hpp"
#include "hal/drivers.hpp"

namespace takt::command {

/// A graph that is loaded, checked and composed, with everything it refers to. Order matters: nodes go before devices.
struct Prepared {
  std::optional<graph::GraphSpec> graph;
  std::unique_ptr<Clock> clock;
  hal::Devices devices;
  std::optional<graph::Composition> composition;
  std::vector<graph::Problem> problems;  ///< why there is no composition
};

/// Loads only, no device is opened; nothing if the input is wrong, which is then written to stderr. An empty `file` is
/// the default graph.
std::optional<graph::GraphSpec> load_graph(const std::filesystem::path& file, const graph::LoadOptions& options);

/// Loads and composes; what is wrong is written to stderr and the exit code returned (kOk: all is well).
int prepare(const RunOptions& options, Prepared& prepared);

/// Writes one error to stderr and returns the code.
int refuse(const std::string& text, Exit code);

}  // namespace takt::command
