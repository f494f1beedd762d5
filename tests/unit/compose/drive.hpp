// SPDX-License-Identifier: Apache-2.0
// Runs a graph of a test on the simulated world in virtual time, with a node of the test's own in it.
#pragma once
#include <doctest/doctest.h>

#include <filesystem>
#include <string>

#include "graph/compose/composition.hpp"
#include "hal/camera/rig.hpp"
#include "hal/drivers.hpp"
#include "hal/sim/simulation.hpp"
#include "rt/sched/executor.hpp"
#include "tests/temporary_folder.hpp"

namespace takt::test {

inline std::filesystem::path graph_folder() { return std::filesystem::path(TAKT_SOURCE_DIR) / "graph"; }

/// The shipped rig of that name, as the camera `id` has it.
inline StereoRig rig_of(const std::string& id, const std::string& file) {
  const auto rig = load_rig(id, graph_folder() / "rigs" / file);
  REQUIRE(rig);
  return *rig;
}

/// A drive that is over; the world stays for questions about its truth.
class Drive {
 public:
  /// Runs the graph for `ns`; `@` in it stands for graph_folder(), and its node type `probe` is Probe.
  template <class Probe>
  static Drive with(const char* graph_text, const char* schedule_text, int64_t ns) {
    NodeTypes types = graph::node_types();
    types.add<Probe>("probe", Layer::storage, "test");
    return Drive(graph_text, schedule_text, types, ns);
  }
  const sim::Simulation& world() { return *devices_.first_world(); }

 private:
  Drive(std::string graph_text, const std::string& schedule_text, const NodeTypes& types, int64_t ns);

  VirtualClock clock_{1'000'000'000};
  hal::Devices devices_;
};

inline Drive::Drive(std::string graph_text, const std::string& schedule_text, const NodeTypes& types, int64_t ns) {
  for (size_t at; (at = graph_text.find('@')) != std::string::npos;) graph_text.replace(at, 1, graph_folder().string());
  const TemporaryFolder folder;
  folder.write("schedule.yaml", schedule_text);
  graph::Loaded loaded = graph::load(folder.write("graph.yaml", graph_text), {}, types);
  for (const auto& problem : loaded.problems) MESSAGE(graph::to_string(problem));
  REQUIRE(loaded.graph);
  const graph::DeviceFactory factory =
      [&](const graph::DeviceSpec& spec) -> tl::expected<std::unique_ptr<Node>, graph::ComposeError> {
    auto node = hal::make_device({spec.id, spec.kind, spec.driver, spec.settings, loaded.graph->directory, 1}, devices_,
                                 clock_);
    REQUIRE(node);
    return std::move(*node);
  };
  auto composition = graph::compose(*loaded.graph, types, factory, clock_, {folder.path, 1});
  REQUIRE(composition);
  const auto transport = make_local_transport(composition->plan.ports);
  Executor executor(composition->plan, *transport, clock_, {ns, 0, false});
  executor.run();
  for (auto& node : composition->nodes) node->finish();
}

}  // namespace takt::test
