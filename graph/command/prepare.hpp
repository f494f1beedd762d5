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
  bool plugged = true;                   ///< hardware is there and is opened
};

/// Loads only, no device is opened; nothing if the input is wrong, which is then written to stderr. An empty `file` is
/// the default graph.
std::optional<graph::GraphSpec> load_graph(const std::filesystem::path& file, const graph::LoadOptions& options);

/// Loads the graph; what is wrong is written to stderr and the exit code returned (kOk: all is well). The caller tells
/// how many problems there were.
int load(const RunOptions& options, Prepared& prepared);
/// Composes what is loaded, or the part of it that `compose` says; problems as above.
int compose(const RunOptions& options, const graph::ComposeOptions& compose, Prepared& prepared);
/// Both, for what is not run: hardware need not be there.
int prepare_check(const RunOptions& options, Prepared& prepared);
/// "takt: n problems, nothing was started".
void tell_problems(size_t count);

/// A file or folder that the command ships with: beside the launcher, or in share/takt beside an installed bin/.
std::filesystem::path shipped(const std::filesystem::path& relative);

/// Writes one error to stderr and returns the code.
int refuse(const std::string& text, Exit code);

}  // namespace takt::command
