// SPDX-License-Identifier: Apache-2.0
#include "graph/view/diagram.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "graph/language/quantity.hpp"

namespace takt::view {
namespace {

using graph::GraphSpec;
using graph::ScheduleEntry;

std::string release_text(const ScheduleEntry& entry) {
  std::string text = entry.rate ? graph::rate_text(*entry.rate) : "";
  if (entry.on) text = "on " + entry.on->text();
  if (entry.every > 1) text += fmt::format(", every {}", entry.every);
  if (entry.min_interval_ns > 0) text += ", not within " + time_text(entry.min_interval_ns);
  return text;
}

std::string times_text(const ScheduleEntry& entry, std::optional<int64_t> deadline) {
  std::string text = entry.budget_ns > 0 ? "budget " + time_text(entry.budget_ns) : "no budget";
  if (deadline) text += ", deadline " + time_text(*deadline);
  return text;
}

const ScheduleEntry& entry_of(const GraphSpec& graph, const std::string& id) {
  static const ScheduleEntry none;
  const auto entry = graph.schedule.entries.find(id);
  return entry == graph.schedule.entries.end() ? none : entry->second;
}

DiagramBox box_of(const GraphSpec& graph, const std::string& id, std::string type, size_t room) {
  const ScheduleEntry& entry = entry_of(graph, id);
  DiagramBox box;
  box.id = id;
  box.type = std::move(type);
  box.release = release_text(entry);
  box.times = times_text(entry, deadline_ns(graph, id));
  box.device = room == Diagram::kDeviceRoom;
  box.high = entry.criticality == Criticality::high;
  box.room = room;
  return box;
}

std::string subtitle_of(const GraphSpec& graph) {
  const std::string cores =
      graph.schedule.cores.empty() ? "all" : fmt::format("{}", fmt::join(graph.schedule.cores, " "));
  return fmt::format("schedule {}, profile {}, mode {}, policy {}, cores {}", graph.schedule.name, graph.profile,
                     graph.mode, to_string(graph.schedule.policy), cores);
}

class Maker {
 public:
  Maker(const GraphSpec& graph, const Registry& registry)
      : graph_(graph), types_(registry.nodes), devices_(graph::catalogue(registry.devices)) {}

  Diagram make() {
    result_.name = graph_.name;
    result_.subtitle = subtitle_of(graph_);
    result_.rooms = {"devices"};
    for (const auto& subsystem : graph_.subsystems) result_.rooms.push_back(subsystem.name);
    for (const auto& device : graph_.devices) add_device(device);
    for (const auto& node : graph_.nodes) add_node(node);
    for (const auto& device : graph_.devices) connect(device.id, device.edges, {});
    for (const auto& node : graph_.nodes) connect(node.id, node.edges, node.joins);
    for (const auto& chain : graph_.chains)
      result_.chains.push_back({chain.name, chain.from.text(), chain.to.text(), chain.max_age_ns});
    return std::move(result_);
  }

 private:
  void add(DiagramBox box) {
    index_[box.id] = result_.boxes.size();
    result_.boxes.push_back(std::move(box));
  }

  void add_device(const graph::DeviceSpec& device) {
    DiagramBox box =
        box_of(graph_, device.id, fmt::format("{} ({})", device.kind, device.driver), Diagram::kDeviceRoom);
    if (const auto kind = devices_.kinds.find(device.kind); kind != devices_.kinds.end())
      for (const auto& port : kind->second.ports)
        if (!port.input) box.outputs.push_back({port.name, std::string(port.type->name), false});
    add(std::move(box));
  }

  void add_node(const graph::NodeSpec& node) {
    const auto room = std::find(result_.rooms.begin() + 1, result_.rooms.end(), node.subsystem);
    DiagramBox box = box_of(graph_, node.id, node.type, static_cast<size_t>(room - result_.rooms.begin()));
    if (room == result_.rooms.end()) result_.rooms.push_back(node.subsystem);
    if (const NodeType* type = types_.find(node.type)) {
      const auto instance = type->make();
      for (const OutputPort* output : instance->outputs())
        box.outputs.push_back({std::string(output->name()), std::string(output->type().name), false});
    }
    add(std::move(box));
  }

  void connect(const std::string& id, const std::vector<graph::EdgeSpec>& edges,
               const std::vector<std::vector<std::string>>& joins) {
    std::vector<std::pair<DiagramEdge, const graph::EdgeSpec*>> found;
    for (const auto& edge : edges)
      if (const auto from = source_of(edge)) found.emplace_back(*from, &edge);
    // Inputs in the order of their producers: fewer edges cross.
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
      return std::pair(a.first.from_box, a.first.output) < std::pair(b.first.from_box, b.first.output);
    });
    const size_t to = index_.at(id);
    for (auto& [edge, spec] : found) {
      edge.to_box = to;
      edge.control = spec->input == "control";  // every node has this input, and no other one of that name
      edge.input = result_.boxes[to].inputs.size();
      result_.boxes[edge.from_box].outputs[edge.output].read = true;
      result_.boxes[to].inputs.push_back(input_of(id, *spec, joins));
      result_.edges.push_back(edge);
    }
  }

  /// Box and output that an edge comes from; nothing if the mode leaves the box out.
  std::optional<DiagramEdge> source_of(const graph::EdgeSpec& edge) const {
    const auto from = index_.find(edge.from.node);
    if (from == index_.end()) return std::nullopt;
    const auto& outputs = result_.boxes[from->second].outputs;
    for (size_t output = 0; output < outputs.size(); ++output)
      if (outputs[output].name == edge.from.port) return DiagramEdge{from->second, output, 0, 0};
    return std::nullopt;
  }

  DiagramInput input_of(const std::string& id, const graph::EdgeSpec& edge,
                        const std::vector<std::vector<std::string>>& joins) const {
    DiagramInput input{edge.input, edge.depth, edge.max_age_ns, -1, entry_of(graph_, id).on == edge.from};
    for (size_t j = 0; j < joins.size(); ++j)
      if (std::find(joins[j].begin(), joins[j].end(), edge.input) != joins[j].end()) input.join = static_cast<int>(j);
    return input;
  }

  const GraphSpec& graph_;
  const NodeTypes& types_;
  const graph::DeviceCatalogue devices_;
  Diagram result_;
  std::map<std::string, size_t> index_;
};

/// Longest distance of two releases if every message the node follows comes as planned.
std::optional<int64_t> period_ns(const GraphSpec& graph, const std::string& id, int steps_left) {
  const auto found = graph.schedule.entries.find(id);
  if (found == graph.schedule.entries.end() || steps_left == 0) return std::nullopt;
  const ScheduleEntry& entry = found->second;
  if (entry.rate) return entry.rate->period_ns();
  if (!entry.on) return std::nullopt;
  const auto producer = period_ns(graph, entry.on->node, steps_left - 1);
  if (!producer) return std::nullopt;
  return *producer * entry.every;
}

}  // namespace

std::string DiagramInput::latch_text() const {
  std::string text = depth > 1 ? fmt::format("depth {}", depth) : "";
  if (max_age_ns) text += (text.empty() ? "" : ", ") + ("max_age " + time_text(*max_age_ns));
  return text;
}

std::string Diagram::from_text(const DiagramEdge& edge) const {
  return boxes[edge.from_box].id + "." + boxes[edge.from_box].outputs[edge.output].name;
}

std::string Diagram::to_text(const DiagramEdge& edge) const {
  return boxes[edge.to_box].id + "." + input_of(edge).name;
}

Diagram make_diagram(const GraphSpec& graph, const Registry& registry) { return Maker(graph, registry).make(); }

std::string time_text(int64_t ns) {
  const auto value = static_cast<double>(ns);
  if (ns >= 1'000'000'000) return fmt::format("{:.4g} s", value * 1e-9);
  if (ns >= 1'000'000) return fmt::format("{:.4g} ms", value * 1e-6);
  return fmt::format("{:.4g} us", value * 1e-3);
}

std::optional<int64_t> deadline_ns(const GraphSpec& graph, const std::string& id) {
  const auto entry = graph.schedule.entries.find(id);
  if (entry == graph.schedule.entries.end()) return std::nullopt;
  if (entry->second.deadline_ns > 0) return entry->second.deadline_ns;
  return period_ns(graph, id, static_cast<int>(graph.schedule.entries.size()));
}

}  // namespace takt::view
