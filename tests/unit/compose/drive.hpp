// SPDX-License-Identifier: Apache-2.0
// Runs a graph of a test on the simulated world in virtual time, with a node of the test's own in it.
#pragma once
#include <doctest/doctest.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "graph/ace/ace_registry.hpp"
#include "graph/compose/composition.hpp"
#include "hal/camera/rig.hpp"
#include "hal/devices.hpp"
#include "hal/sim/simulation.hpp"
#include "hal/sim/worlds.hpp"
#include "rt/sched/executor.hpp"
#include "tests/graph_folder.hpp"
#include "tests/temporary_folder.hpp"

namespace takt::test {

/// The shipped rig of that name, as the camera `id` has it.
inline StereoRig rig_of(const std::string& id, const std::string& file) {
  const auto rig = load_rig(id, graph_folder() / "rigs" / file);
  REQUIRE(rig);
  return *rig;
}

/// What the graph of a test has of its own, as text of graph and schedule files; `@` stands for graph_folder().
struct DriveGraph {
  std::string_view devices;   ///< entries of `devices`; the driver is `sim` where they name no other
  std::string_view nodes;     ///< entries of a subsystem, one of the type `probe`; then what the graph has beside
  std::string_view schedule;  ///< entries of the schedule's `nodes`
  std::string_view world = "lab";
};

/// The nodes of a graph once it has run for `ns`, on one core under `cooperative`; what its jobs said goes to `faults`.
inline std::vector<std::unique_ptr<Node>> drive(const DriveGraph& own, const Registry& registry, int64_t ns,
                                                VirtualClock& clock, hal::Devices& devices,
                                                std::vector<Fault>& faults) {
  using namespace std::string_literals;
  std::string text = "takt: 1\nname: drive\nschedule: schedule.yaml\ndefault_profile: sim\ndevices:"s;
  text.append(own.devices).append("profiles:\n  sim: {default: {driver: sim, world: @/worlds/").append(own.world);
  text.append(".xml}}\nsubsystems:\n  robot:").append(own.nodes);
  for (size_t at; (at = text.find('@')) != std::string::npos;) text.replace(at, 1, graph_folder().string());
  const TemporaryFolder folder;
  folder.write("schedule.yaml", "takt: 1\nname: drive\npolicy: cooperative\ncores: [0]\nnodes:"s.append(own.schedule));
  graph::Loaded loaded = graph::load(folder.write("graph.yaml", text), {}, registry);
  for (const auto& problem : loaded.problems) MESSAGE(graph::to_string(problem));
  REQUIRE(loaded.graph);
  const graph::DeviceFactory factory =
      [&](const graph::DeviceSpec& spec) -> tl::expected<std::unique_ptr<Node>, graph::ComposeError> {
    auto node = hal::make_device(
        registry.devices, {spec.id, spec.kind, spec.driver, spec.settings, loaded.graph->directory, 1}, devices, clock);
    REQUIRE(node);
    return std::move(*node);
  };
  auto composition = graph::compose(*loaded.graph, registry, factory, clock, {folder.path, 1});
  REQUIRE(composition);
  const auto transport = make_local_transport(composition->plan.ports);
  Executor executor(composition->plan, *transport, clock, {ns, 0, false});
  executor.run();
  for (size_t i = 0; i < executor.board().faults().size(); ++i) faults.push_back(*executor.board().faults().at(i));
  for (auto& node : composition->nodes) node->finish();
  return std::move(composition->nodes);
}

/// A drive that is over: the world stays for questions about its truth, the probe for what it saw.
template <class Probe>
class Drive {
 public:
  /// Runs the graph for `ns`; its node type `probe` is Probe.
  Drive(const DriveGraph& graph, int64_t ns) {
    Registry registry = ace_registry();
    registry.nodes.add<Probe>("probe", Layer::storage, "test");
    nodes_ = drive(graph, registry, ns, clock_, devices_, faults_);
    for (const auto& node : nodes_)
      if (const auto* probe = dynamic_cast<const Probe*>(node.get())) probe_ = probe;
    REQUIRE(probe_ != nullptr);
  }
  const sim::Simulation& world() { return *sim::first_world(devices_); }
  const Probe& probe() const { return *probe_; }
  const std::vector<Fault>& faults() const { return faults_; }

 private:
  VirtualClock clock_{1'000'000'000};
  hal::Devices devices_;
  std::vector<std::unique_ptr<Node>> nodes_;
  const Probe* probe_ = nullptr;
  std::vector<Fault> faults_;
};

}  // namespace takt::test
