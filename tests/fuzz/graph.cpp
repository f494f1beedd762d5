// SPDX-License-Identifier: Apache-2.0
// Any text to the reader of graphs and schedules: a graph, or problems that say where they stand. A form feed parts the
// graph from its schedule.
#include <algorithm>
#include <string>

#include "graph/language/catalogue.hpp"
#include "rt/msg/motion.hpp"
#include "tests/fuzz/memory_file.hpp"

using namespace takt;
using takt::fuzz::require;

namespace {

struct Relay final : Node {
  Input<Motion> in{this, "in", ""};
  Output<Motion> out{this, "out", ""};
  Levels levels{this, {{"full", 1.0}, {"half", 0.3}}};
  Param<int> count{this, "count", 64, {1, 512}, "px", ""};
  Param<double> range{this, "range", 10.0, {0.5, 50.0}, "m", ""};
  Param<std::string> table{this, "table", "none", "", ""};
  void setup(Setup&) override {}
  void run(Job&) override {}
};

graph::DeviceCatalogue devices() {
  graph::DeviceKindEntry sensor;
  sensor.ports = {{"motion", &MessageType::of<Motion>(), false, ""}, {"wanted", &MessageType::of<Motion>(), true, ""}};
  sensor.settings.resize(2);
  sensor.settings[0].name = "mount.x";
  sensor.settings[0].kind = graph::DeviceSetting::Kind::number;
  sensor.settings[0].unit = "m";
  sensor.settings[1].name = "file";
  sensor.settings[1].kind = graph::DeviceSetting::Kind::path;
  sensor.drivers = {{"sim", "", {}}, {"real", "", {}}};
  graph::DeviceCatalogue catalogue;
  catalogue.kinds["sensor"] = sensor;
  return catalogue;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const NodeTypes types = [] {
    NodeTypes all;
    all.add<Relay>("relay", Layer::perception, "");
    return all;
  }();
  static const graph::DeviceCatalogue catalogue = devices();
  const auto part = static_cast<size_t>(std::find(data, data + size, '\f') - data);
  const size_t behind = std::min(part + 1, size);
  const fuzz::MemoryFile graph(data, part), schedule(data + behind, size - behind);
  graph::LoadOptions options;
  options.schedule = schedule.path();
  const graph::Loaded loaded = graph::load(graph.path(), options, types, catalogue);
  require(loaded.graph.has_value() == loaded.problems.empty());
  for (const graph::Problem& problem : loaded.problems)
    require(!problem.position.file.empty() && !problem.text.empty());
  return 0;
}
