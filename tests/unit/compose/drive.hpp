// SPDX-License-Identifier: Apache-2.0
// Runs a graph of a test on the simulated world in virtual time, with nodes of the test's own in it.
#pragma once
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "graph/compose/composition.hpp"
#include "hal/drivers.hpp"
#include "hal/sim/simulation.hpp"
#include "rt/sched/executor.hpp"

namespace takt::test {

inline std::filesystem::path graph_folder() { return std::filesystem::path(TAKT_SOURCE_DIR) / "graph"; }

/// A folder of the test's own with the two files; `@` in the graph stands for graph_folder().
struct DriveFiles {
  std::filesystem::path folder;
  DriveFiles(std::string graph, const std::string& schedule) {
    for (size_t at; (at = graph.find('@')) != std::string::npos;) graph.replace(at, 1, graph_folder().string());
    std::string name = (std::filesystem::temp_directory_path() / "truth-XXXXXX").string();
    folder = mkdtemp(name.data());
    std::ofstream(folder / "graph.yaml") << graph;
    std::ofstream(folder / "schedule.yaml") << schedule;
  }
  ~DriveFiles() { std::filesystem::remove_all(folder); }
  DriveFiles(const DriveFiles&) = delete;
  DriveFiles& operator=(const DriveFiles&) = delete;
};

/// `devices` keeps the world for questions about its truth afterwards.
inline void drive(const std::string& graph_text, const std::string& schedule_text, const NodeTypes& types, int64_t ns,
                  hal::Devices& devices, VirtualClock& clock) {
  const DriveFiles files(graph_text, schedule_text);
  graph::Loaded loaded = graph::load(files.folder / "graph.yaml", {}, types);
  for (const auto& problem : loaded.problems) MESSAGE(graph::to_string(problem));
  REQUIRE(loaded.graph);
  const graph::DeviceFactory factory =
      [&](const graph::DeviceSpec& spec) -> tl::expected<std::unique_ptr<Node>, graph::ComposeError> {
    auto node =
        hal::make_device({spec.id, spec.kind, spec.driver, spec.settings, loaded.graph->directory, 1}, devices, clock);
    REQUIRE(node);
    return std::move(*node);
  };
  auto composition = graph::compose(*loaded.graph, types, factory, clock, {files.folder, 1});
  REQUIRE(composition);
  const auto transport = make_local_transport(composition->plan.ports);
  Executor executor(composition->plan, *transport, clock, {ns, 0, false});
  executor.run();
  for (auto& node : composition->nodes) node->finish();
}

}  // namespace takt::test
