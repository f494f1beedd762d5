// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "graph/language/loader.hpp"
#include "graph/language/quantity.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

/// The member as a map (list, text); empty where it is absent or of another type (the schema has reported that).
json member(const json& value, const char* key, json::value_t type) {
  if (value.is_object()) {
    const auto it = value.find(key);
    if (it != value.end() && it->type() == type) return *it;
  }
  return json(type);
}
json map_at(const json& value, const char* key) { return member(value, key, json::value_t::object); }
json list_at(const json& value, const char* key) { return member(value, key, json::value_t::array); }
std::string text_at(const json& value, const char* key) {
  return member(value, key, json::value_t::string).get<std::string>();
}

std::optional<PortName> port_name(const json& value) {
  if (!value.is_string()) return std::nullopt;
  const auto text = value.get<std::string>();
  const size_t dot = text.find('.');
  if (dot == std::string::npos || dot == 0 || dot + 1 == text.size() || text.find('.', dot + 1) != std::string::npos)
    return std::nullopt;
  return PortName{text.substr(0, dot), text.substr(dot + 1)};
}

}  // namespace

std::optional<int64_t> Loader::read_time(const Document& document, const json& value, const std::string& pointer,
                                         std::string_view key, const std::string& what) {
  if (!value.is_object() || !value.contains(key)) return std::nullopt;
  const json& time = value.at(std::string(key));
  const std::string below = child(pointer, key);
  if (!time.is_string() && !time.is_number()) return std::nullopt;
  const auto ns = parse_duration_ns(document.raw(below));
  if (ns) return *ns;
  problem(document.value_at(below), fmt::format("{} of {} {}", ticked(key), what, ns.error()));
  return std::nullopt;
}

bool Loader::claim_id(const std::string& id, const Position& at) {
  const auto [it, fresh] = claimed_.emplace(id, at);
  if (!fresh)
    problem(at, fmt::format("duplicate id {}; it stands first at {}; ids of nodes and devices are unique in the "
                            "whole graph",
                            ticked(id), to_string(it->second)));
  return fresh;
}

void Loader::read_graph() {
  const json& root = graph_.root;
  spec_.name = text_at(root, "name");
  if (const std::string word = text_at(root, "isolation"); !word.empty()) spec_.isolation = word;
  layers_ = text_at(root, "layers") == "thesis";
  const json devices = map_at(root, "devices");
  for (const auto& [id, value] : devices.items()) {
    const std::string pointer = child("/devices", id);
    claim_id(id, graph_.key_at(pointer));
    if (id == "default" || id == "set")
      problem(graph_.key_at(pointer), ticked(id) + " is no id of a device: in a profile it means " +
                                          (id == "set" ? "parameters of nodes" : "all devices"));
    DeviceSpec device;
    device.id = id;
    device.kind = text_at(value, "kind");
    device.position = graph_.key_at(pointer);
    device.edges = read_edges(map_at(value, "in"), child(pointer, "in"));
    spec_.devices.push_back(std::move(device));
  }
  const json subsystems = map_at(root, "subsystems");
  for (const auto& [name, value] : subsystems.items())
    if (value.is_object()) read_subsystem(name, value, child("/subsystems", name));
  // Order of the file, not of the alphabet: the first to claim an id keeps it, and reports read like the file.
  const auto by_position = [&](const auto& a, const auto& b) { return before(a.position, b.position); };
  std::sort(spec_.devices.begin(), spec_.devices.end(), by_position);
  std::sort(spec_.subsystems.begin(), spec_.subsystems.end(), by_position);
  std::sort(spec_.nodes.begin(), spec_.nodes.end(), by_position);
  std::erase_if(spec_.nodes, [&](const NodeSpec& node) { return !claim_id(node.id, node.position); });
  if (spec_.nodes.empty() && problems_.empty())
    problem(graph_.key_at("/subsystems"), "the graph has no node; a subsystem is a map of nodes");
  read_chains(map_at(root, "chains"));
  read_modes(map_at(root, "modes"));
}

void Loader::read_subsystem(const std::string& name, const json& value, const std::string& pointer) {
  SubsystemSpec subsystem;
  subsystem.name = name;
  subsystem.position = graph_.key_at(pointer);
  for (const auto& item : list_at(value, "exports"))
    if (const auto port = port_name(item)) subsystem.exports.push_back(*port);
  if (const json spare = member(value, "spare", json::value_t::boolean); value.contains("spare"))
    subsystem.spare = spare.get<bool>();
  spec_.subsystems.push_back(std::move(subsystem));
  for (const auto& [id, node] : value.items())
    if (id != "exports" && id != "spare" && node.is_object()) read_node(id, name, node, child(pointer, id));
}

void Loader::read_node(const std::string& id, const std::string& subsystem, const json& value,
                       const std::string& pointer) {
  NodeSpec node;
  node.id = id;
  node.type = text_at(value, "type");
  node.subsystem = subsystem;
  node.position = graph_.key_at(pointer);
  node.edges = read_edges(map_at(value, "in"), child(pointer, "in"));
  read_joins(node, list_at(value, "join"));
  spec_.nodes.push_back(std::move(node));
}

std::vector<EdgeSpec> Loader::read_edges(const json& inputs, const std::string& pointer) {
  std::vector<EdgeSpec> edges;
  for (const auto& [input, value] : inputs.items()) {
    const std::string below = child(pointer, input);
    EdgeSpec edge;
    edge.input = input;
    const auto from = port_name(value.is_object() ? value.value("from", json()) : value);
    if (!from) continue;
    edge.from = *from;
    edge.position = graph_.value_at(value.is_object() ? child(below, "from") : below);
    if (value.is_object()) {
      const json depth = value.value("depth", json());
      if (depth.is_number_integer() && depth >= 1 && depth <= InputPort::kMaxDepth) edge.depth = depth.get<int>();
      edge.max_age_ns = read_time(graph_, value, below, "max_age", "input " + ticked(input));
      if (edge.max_age_ns && *edge.max_age_ns <= 0)
        problem(graph_.value_at(child(below, "max_age")),
                fmt::format("`max_age` of input {} is {}; it must be above 0", ticked(input),
                            graph_.raw(child(below, "max_age"))));
    }
    edges.push_back(std::move(edge));
  }
  return edges;
}

void Loader::read_joins(NodeSpec& node, const json& value) {
  std::vector<std::string> flat;
  for (const auto& item : value) {
    if (item.is_string()) flat.push_back(item.get<std::string>());
    if (!item.is_array()) continue;
    std::vector<std::string> group;
    for (const auto& name : item)
      if (name.is_string()) group.push_back(name.get<std::string>());
    node.joins.push_back(std::move(group));
  }
  if (!flat.empty()) node.joins.push_back(std::move(flat));
}

void Loader::read_chains(const json& value) {
  for (const auto& [name, chain] : value.items()) {
    const std::string pointer = child("/chains", name);
    ChainSpec spec;
    spec.name = name;
    spec.position = graph_.key_at(pointer);
    const auto from = port_name(chain.is_object() ? chain.value("from", json()) : json());
    const auto to = port_name(chain.is_object() ? chain.value("to", json()) : json());
    const auto max_age = read_time(graph_, chain, pointer, "max_age", "chain " + ticked(name));
    if (max_age && *max_age <= 0)
      problem(graph_.value_at(child(pointer, "max_age")),
              fmt::format("`max_age` of chain {} is {}; it must be above 0", ticked(name),
                          graph_.raw(child(pointer, "max_age"))));
    if (!from || !to) continue;
    spec.from = *from;
    spec.to = *to;
    spec.max_age_ns = max_age.value_or(0);
    spec_.chains.push_back(std::move(spec));
  }
}

void Loader::read_modes(const json& value) {
  for (const auto& [name, mode] : value.items()) {
    ModeSpec spec;
    spec.name = name;
    spec.position = graph_.key_at(child("/modes", name));
    if (name == "full")
      problem(spec.position, "mode `full` is the whole graph and cannot be redefined; choose another name");
    for (const auto& id : list_at(mode, "without"))
      if (id.is_string()) spec.without.push_back(id.get<std::string>());
    for (const auto& id : list_at(mode, "lost"))
      if (id.is_string()) spec.lost.push_back(id.get<std::string>());
    spec.defined = !mode.is_object() || mode.contains("without");
    spec_.modes.push_back(std::move(spec));
  }
  // The first of the file that covers a loss is taken.
  std::sort(spec_.modes.begin(), spec_.modes.end(),
            [&](const ModeSpec& a, const ModeSpec& b) { return before(a.position, b.position); });
}

}  // namespace takt::graph
