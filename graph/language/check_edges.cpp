// SPDX-License-Identifier: Apache-2.0
// Ports, message types, layers, hierarchy and joins.
#include <fmt/format.h>

#include <algorithm>

#include "graph/language/loader.hpp"

namespace takt::graph {
namespace {

template <class Ports>
std::vector<std::string> names(const Ports& ports) {
  std::vector<std::string> result;
  for (const auto& port : ports) result.push_back(port.name);
  return result;
}

const PortInfo* find(const std::vector<PortInfo>& ports, std::string_view name) {
  const auto it = std::find_if(ports.begin(), ports.end(), [&](const PortInfo& p) { return p.name == name; });
  return it == ports.end() ? nullptr : &*it;
}

/// Thesis Sec. 2.2: the same, the next or the storage layer, or from storage to any.
bool layers_fit(Layer from, Layer to) {
  if (from == Layer::storage || to == Layer::storage || from == to) return true;
  return static_cast<int>(to) == static_cast<int>(from) + 1;
}

/// Whether a message of one type may be read as one of the other: plug-ins bring declarations of their own.
bool same_layout(const MessageType& a, const MessageType& b) {
  return &a == &b || (a.header_bytes == b.header_bytes &&
                      std::equal(a.fields.begin(), a.fields.end(), b.fields.begin(), b.fields.end(),
                                 [](const Field& x, const Field& y) {
                                   return x.name == y.name && x.scalar == y.scalar && x.offset == y.offset &&
                                          x.count == y.count && x.element_bytes == y.element_bytes;
                                 }));
}

}  // namespace

const PortInfo* Part::input(std::string_view name) const { return find(inputs, name); }
const PortInfo* Part::output(std::string_view name) const { return find(outputs, name); }
std::vector<std::string> Part::input_names() const { return names(inputs); }
std::vector<std::string> Part::output_names() const { return names(outputs); }

std::vector<std::string> Loader::ids() const {
  std::vector<std::string> result;
  for (const auto& [id, position] : claimed_) result.push_back(id);
  return result;
}

Position Loader::item_at(const std::string& pointer, std::string_view text) const {
  Position at = graph_.value_at(pointer);
  for (size_t i = 0; graph_.marks.contains(child(pointer, i)); ++i) {
    const std::string item = child(pointer, i);
    if (graph_.raw(item) == text) at = graph_.value_at(item);
    for (size_t k = 0; graph_.marks.contains(child(item, k)); ++k)
      if (graph_.raw(child(item, k)) == text) at = graph_.value_at(child(item, k));
  }
  return at;
}

void Loader::make_parts() {
  for (const auto& device : spec_.devices) {
    Part part;
    part.device = true;
    part.edges = &device.edges;
    part.position = device.position;
    if (const auto kind = catalogue_.kinds.find(device.kind); kind != catalogue_.kinds.end()) {
      part.known = true;
      for (const auto& port : kind->second.ports)
        (port.input ? part.inputs : part.outputs).push_back({port.name, port.type, Need::optional});
    }
    parts_[device.id] = std::move(part);
  }
  for (const auto& node : spec_.nodes) {
    Part part;
    part.subsystem = node.subsystem;
    part.edges = &node.edges;
    part.position = node.position;
    const auto instance = instances_.find(node.id);
    if (instance != instances_.end()) {
      part.known = true;
      part.layer = types_.find(node.type)->layer;
      for (const auto* port : instance->second->inputs())
        part.inputs.push_back({std::string(port->name()), &port->type(), port->need()});
      for (const auto* port : instance->second->outputs())
        part.outputs.push_back({std::string(port->name()), &port->type(), Need::optional});
    }
    parts_[node.id] = std::move(part);
  }
}

void Loader::check_edges() {
  check_exports();
  for (auto& [id, part] : parts_) {
    const size_t before = problems_.size();
    for (const auto& edge : *part.edges) check_edge(id, part, edge);
    if (part.known) check_unconnected(id, part);
    part.sound = part.known && problems_.size() == before;
  }
  check_joins();
}

void Loader::check_edge(const std::string& id, const Part& to, const EdgeSpec& edge) {
  const std::string what = fmt::format("{} of {} {}", ticked(edge.input), to.device ? "device" : "node", ticked(id));
  const PortInfo* input = to.input(edge.input);
  if (to.known && input == nullptr) {
    const std::string base = to.device ? "/devices" : child("/subsystems", to.subsystem);
    problem(graph_.key_at(child(child(child(base, id), "in"), edge.input)),
            fmt::format("{} {} has no input {}{}", to.device ? "device" : "node", ticked(id), ticked(edge.input),
                        alternatives(edge.input, to.input_names(), "inputs of " + ticked(id))));
  }
  const auto producer = parts_.find(edge.from.node);
  if (producer == parts_.end())
    return problem(edge.position,
                   fmt::format("input {} reads {}, but there is no node or device {}{}", what, ticked(edge.from.text()),
                               ticked(edge.from.node), alternatives(edge.from.node, ids())));
  const Part& from = producer->second;
  if (!from.known) return;
  const PortInfo* output = from.output(edge.from.port);
  if (output == nullptr)
    return problem(edge.position, fmt::format("input {} reads {}, but {} has no output {}{}", what,
                                              ticked(edge.from.text()), ticked(edge.from.node), ticked(edge.from.port),
                                              alternatives(edge.from.port, from.output_names(),
                                                           "outputs of " + ticked(edge.from.node))));
  if (input != nullptr && input->type->name != output->type->name)
    problem(edge.position, fmt::format("type mismatch: {} gives {}, but input {} takes {}", ticked(edge.from.text()),
                                       ticked(output->type->name), what, ticked(input->type->name)));
  else if (input != nullptr && !same_layout(*input->type, *output->type))
    problem(
        edge.position,
        fmt::format("type mismatch: {} and input {} both call their type {}, but with other fields; build program and "
                    "plug-ins with one declaration of it, or give one of the two types another name",
                    ticked(edge.from.text()), what, ticked(input->type->name)));
  if (layers_) check_layer(id, from, to, edge);
  check_hierarchy(from, to, edge);
}

void Loader::check_layer(const std::string& id, const Part& from, const Part& to, const EdgeSpec& edge) {
  // Commands to devices and requests have no layer.
  if (!to.known || to.device || edge.input == "control" || layers_fit(from.layer, to.layer)) return;
  problem(edge.position,
          fmt::format("edge from {} (layer {}) to {} (layer {}): an edge goes to the same, the next or the storage "
                      "layer (sensor, perception, processing, storage), as `layers: thesis` asks for",
                      ticked(edge.from.text()), to_string(from.layer), ticked(id), to_string(to.layer)));
}

void Loader::check_hierarchy(const Part& from, const Part& to, const EdgeSpec& edge) {
  if (from.device || from.subsystem == to.subsystem) return;
  const auto subsystem = std::find_if(spec_.subsystems.begin(), spec_.subsystems.end(),
                                      [&](const SubsystemSpec& s) { return s.name == from.subsystem; });
  if (std::find(subsystem->exports.begin(), subsystem->exports.end(), edge.from) != subsystem->exports.end()) return;
  std::vector<std::string> exported;
  for (const auto& port : subsystem->exports) exported.push_back(port.text());
  problem(edge.position,
          fmt::format("edge against the hierarchy: {} leaves subsystem {}, which does not export it; add "
                      "it to `exports` of {} (exported: {})",
                      ticked(edge.from.text()), ticked(from.subsystem), ticked(from.subsystem),
                      exported.empty() ? "nothing" : join_words(exported)));
}

void Loader::check_exports() {
  for (const auto& subsystem : spec_.subsystems) {
    std::vector<std::string> own;
    for (const auto& [id, part] : parts_)
      if (!part.device && part.subsystem == subsystem.name) own.push_back(id);
    const std::string pointer = child(child("/subsystems", subsystem.name), "exports");
    for (size_t i = 0; i < subsystem.exports.size(); ++i) {
      const PortName& port = subsystem.exports[i];
      const Position at = item_at(pointer, port.text());
      if (std::find(subsystem.exports.begin(), subsystem.exports.begin() + static_cast<long>(i), port) !=
          subsystem.exports.begin() + static_cast<long>(i))
        problem(at, fmt::format("subsystem {} exports {} twice", ticked(subsystem.name), ticked(port.text())));
      else if (std::find(own.begin(), own.end(), port.node) == own.end())
        problem(at, fmt::format("subsystem {} exports {}, but has no node {}{}", ticked(subsystem.name),
                                ticked(port.text()), ticked(port.node), alternatives(port.node, own)));
      else if (const Part& part = parts_[port.node]; part.known && part.output(port.port) == nullptr)
        problem(at, fmt::format("subsystem {} exports {}, but {} has no output {}{}", ticked(subsystem.name),
                                ticked(port.text()), ticked(port.node), ticked(port.port),
                                alternatives(port.port, part.output_names(), "outputs of " + ticked(port.node))));
    }
  }
}

void Loader::check_unconnected(const std::string& id, const Part& part) {
  for (const auto& input : part.inputs) {
    if (input.need == Need::optional) continue;
    const bool connected = std::any_of(part.edges->begin(), part.edges->end(),
                                       [&](const EdgeSpec& edge) { return edge.input == input.name; });
    const std::string base = part.device ? "/devices" : child("/subsystems", part.subsystem);
    // An edge that is there but broken was reported already.
    if (connected || graph_.marks.contains(child(child(child(base, id), "in"), input.name))) continue;
    std::vector<std::string> sources;
    for (const auto& [other, from] : parts_)
      for (const auto& output : from.outputs)
        if (other != id && output.type->name == input.type->name) sources.push_back(other + "." + output.name);
    problem(part.position,
            fmt::format("input {} of node {} is not connected; it takes {}, which {}", ticked(input.name), ticked(id),
                        ticked(input.type->name),
                        sources.empty() ? "nothing in this graph gives" : "these give: " + join_words(sources)));
  }
}

void Loader::check_joins() {
  for (const auto& node : spec_.nodes) {
    const Part& part = parts_[node.id];
    if (!part.known) continue;
    const std::string pointer = child(child(child("/subsystems", node.subsystem), node.id), "join");
    std::set<std::string> joined;
    for (const auto& group : node.joins) {
      if (group.size() < 2)
        problem(graph_.value_at(pointer),
                fmt::format("`join` of node {} names one input; a join takes at least two", ticked(node.id)));
      for (const auto& name : group) {
        const Position at = item_at(pointer, name);
        const bool connected =
            std::any_of(node.edges.begin(), node.edges.end(), [&](const EdgeSpec& edge) { return edge.input == name; });
        if (part.input(name) == nullptr)
          problem(at,
                  fmt::format("`join` of node {} names {}, which is no input of it{}", ticked(node.id), ticked(name),
                              alternatives(name, part.input_names(), "inputs of " + ticked(node.id))));
        else if (!connected)
          problem(at, fmt::format("`join` of node {} names {}, which is not connected", ticked(node.id), ticked(name)));
        if (!joined.insert(name).second)
          problem(at, fmt::format("`join` of node {} names {} twice", ticked(node.id), ticked(name)));
      }
    }
  }
}

}  // namespace takt::graph
