// SPDX-License-Identifier: Apache-2.0
// Which machine runs what (`machines`), and what lies between them (`network`).
#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "graph/language/loader.hpp"
#include "graph/language/part_of_machine.hpp"
#include "rt/record/picture_codec.hpp"

namespace takt::graph {

using nlohmann::json;

namespace {

/// "1Gbit", "54.5 Mbit": bit/s. Nothing: another text, or none that is above 0.
std::optional<int64_t> bandwidth_in(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  const std::string_view unit = std::string_view(end).substr(std::string_view(end).find_first_not_of(' ') == 1 ? 1 : 0);
  for (const auto& [name, factor] : {std::pair{"kbit", 1e3}, std::pair{"Mbit", 1e6}, std::pair{"Gbit", 1e9}})
    if (unit == name && std::isfinite(number) && number * factor >= 1 && number * factor < 1e15)
      return static_cast<int64_t>(number * factor);
  return std::nullopt;
}

}  // namespace

bool is_private(const std::string& address) {
  if (in_addr four{}; inet_pton(AF_INET, address.c_str(), &four) == 1) {
    const uint32_t number = ntohl(four.s_addr);
    return number >> 24 == 10 || number >> 20 == (172 << 4 | 1) || number >> 16 == (192 << 8 | 168) ||
           number >> 16 == (169 << 8 | 254) || number >> 24 == 127;
  }
  std::array<uint8_t, 16> six{};
  if (inet_pton(AF_INET6, address.c_str(), six.data()) != 1) return false;
  return (six[0] & 0xfe) == 0xfc || (six[0] == 0xfe && (six[1] & 0xc0) == 0x80) || is_loopback(address);
}

void Loader::read_machines() {
  read_network();
  const json machines = graph_.root.value("machines", json());
  if (!machines.is_object()) return;
  for (const auto& [name, value] : machines.items())
    if (value.is_object()) read_machine(name, value);
  std::sort(spec_.machines.begin(), spec_.machines.end(),
            [&](const auto& a, const auto& b) { return before(a.position, b.position); });
}

void Loader::read_machine(const std::string& name, const json& value) {
  MachineSpec machine;
  machine.name = name;
  machine.position = graph_.key_at(child("/machines", name));
  claim_id(name, machine.position);
  if (const json address = value.value("address", json()); address.is_string()) machine.address = address;
  const json runs = value.value("runs", json::array());
  for (const json& one : runs.is_array() ? runs : json::array())
    if (one.is_string()) machine.runs.push_back(one);
  const auto map_of = [&](const char* key) {
    json map = value.value(key, json());
    return map.is_object() ? map : json::object();
  };
  const json ages = map_of("ages"), wire = map_of("wire");
  for (const auto& [port, ignored] : ages.items())
    if (const auto ns =
            read_time(graph_, ages, child(child("/machines", name), "ages"), port, "machine " + ticked(name)))
      machine.ages[port] = *ns;
  for (const auto& [port, coding] : wire.items())
    if (coding.is_string()) machine.wire[port] = coding;
  spec_.machines.push_back(std::move(machine));
}

void Loader::read_network() {
  const json network = graph_.root.value("network", json());
  if (!network.is_object()) return;
  const auto time = [&](const char* key, int64_t& into) {
    const auto ns = read_time(graph_, network, "/network", key, "`network`");
    if (ns && *ns > 0) into = *ns;
    else if (ns)
      problem(graph_.value_at(child("/network", key)), fmt::format("{} of `network` must be above 0", ticked(key)));
  };
  time("latency", spec_.network.latency_ns);
  time("clock_error", spec_.network.clock_error_ns);
  if (const json domain = network.value("domain", json()); domain.is_number_integer())
    spec_.network.domain = domain.get<int>();
  if (const json trusted = network.value("trusted", json()); trusted.is_boolean()) spec_.network.trusted = trusted;
  if (const json bandwidth = network.value("bandwidth", json()); bandwidth.is_string()) {
    spec_.network.bandwidth = bandwidth_in(bandwidth);
    if (!spec_.network.bandwidth)
      problem(graph_.value_at("/network/bandwidth"),
              fmt::format("`bandwidth` of `network` is {}; write a number above 0 with kbit, Mbit or Gbit (a second), "
                          "such as 100Mbit",
                          ticked(bandwidth.get<std::string>())));
  }
}

/// Each subsystem and device runs on one machine, and what releases a node on the same one.
void Loader::check_machines() {
  if (spec_.machines.empty()) return;
  std::map<std::string, std::string> home;  // of subsystems and devices
  std::vector<std::string> all;
  for (const SubsystemSpec& subsystem : spec_.subsystems) all.push_back(subsystem.name);
  for (const DeviceSpec& device : spec_.devices) all.push_back(device.id);
  for (const MachineSpec& machine : spec_.machines) {
    const std::string pointer = child(child("/machines", machine.name), "runs");
    for (const std::string& id : machine.runs) {
      if (std::find(all.begin(), all.end(), id) == all.end())
        problem(item_at(pointer, id), fmt::format("machine {} runs {}, which is no subsystem or device{}",
                                                  ticked(machine.name), ticked(id), alternatives(id, all)));
      else if (const auto [known, fresh] = home.emplace(id, machine.name); !fresh)
        problem(item_at(pointer, id), fmt::format("machine {} runs {}, which machine {} runs", ticked(machine.name),
                                                  ticked(id), ticked(known->second)));
    }
  }
  for (const std::string& id : all)
    if (!home.contains(id))
      problem(graph_.key_at("/machines"), fmt::format("no machine runs {}; add it to `runs` of one", ticked(id)));
  for (const SubsystemSpec& subsystem : spec_.subsystems)
    if (subsystem.name == kLinkProcess)
      problem(subsystem.position,
              fmt::format("{} is no name of a subsystem in a graph with `machines`: it is the process "
                          "that talks to the others",
                          ticked(subsystem.name)));
  const auto home_of = [&](const std::string& id) {
    const auto part = parts_.find(id);
    const bool device = part == parts_.end() || part->second.device;
    const auto found = home.find(device ? id : part->second.subsystem);
    return found == home.end() ? std::string() : found->second;
  };
  check_outputs(home_of);
  check_start_order(home_of);
  for (const auto& [id, entry] : spec_.schedule.entries)
    if (entry.on && home_of(id) != home_of(entry.on->node))
      problem(entry.position, fmt::format("{} is released by {}, which another machine runs; give it a rate",
                                          ticked(id), ticked(entry.on->text())));
}

/// A machine waits at its start for the sizes of what others send: not in a circle.
void Loader::check_start_order(const std::function<std::string(const std::string&)>& home_of) {
  const std::vector<std::string> order = setup_order(spec_);
  const auto rank = [&](const std::string& id) { return std::find(order.begin(), order.end(), id); };
  const auto check = [&](const std::string& to, const std::vector<EdgeSpec>& edges) {
    for (const EdgeSpec& edge : edges)
      if (edge.input != "control" && home_of(edge.from.node) != home_of(to) && rank(edge.from.node) > rank(to))
        problem(edge.position, fmt::format("{} of machine {} reads {} of machine {}, which reads what follows from it: "
                                           "each would wait for the other at the start; let one machine run both",
                                           ticked(to), ticked(home_of(to)), ticked(edge.from.text()),
                                           ticked(home_of(edge.from.node))));
  };
  for (const DeviceSpec& device : spec_.devices) check(device.id, device.edges);
  for (const NodeSpec& node : spec_.nodes) check(node.id, node.edges);
}

/// What others count on, and what goes over the network in a coding, are outputs of what the machine runs. `home_of`:
/// the machine of a node or device.
void Loader::check_outputs(const std::function<std::string(const std::string&)>& home_of) {
  for (const MachineSpec& machine : spec_.machines) {
    std::map<std::string, const MessageType*> types;
    std::vector<std::string> outputs;
    for (const auto& [id, part] : parts_)
      for (const PortInfo& output : home_of(id) == machine.name ? part.outputs : std::vector<PortInfo>()) {
        outputs.push_back(id + "." + output.name);
        types[outputs.back()] = output.type;
      }
    const auto position = [&](const char* key, const std::string& port) {
      return graph_.key_at(child(child(child("/machines", machine.name), key), port));
    };
    const auto is_output = [&](const char* key, const std::string& port) {
      if (types.contains(port)) return true;
      problem(position(key, port),
              fmt::format("{} of machine {} names {}, which is no output of what it runs{}", ticked(key),
                          ticked(machine.name), ticked(port), alternatives(port, outputs, "its outputs")));
      return false;
    };
    for (const auto& [port, age_ns] : machine.ages) is_output("ages", port);
    for (const auto& [port, coding] : machine.wire)
      if (is_output("wire", port) && coding == "jpeg" && types[port] && !record::may_have_pictures(types[port]->fields))
        problem(position("wire", port),
                fmt::format("{} has no pictures (it is a {}); give zstd or lz4", ticked(port), types[port]->name));
  }
}

void Loader::choose_machine() {
  if (options_.machine.empty()) return run_on_one_machine(spec_);
  std::vector<std::string> names;
  for (const MachineSpec& machine : spec_.machines) names.push_back(machine.name);
  if (std::find(names.begin(), names.end(), options_.machine) == names.end())
    return problem({"--machine", 0, 0}, names.empty() ? fmt::format("graph {} has no `machines`", ticked(spec_.name))
                                                      : fmt::format("graph {} has no machine {}{}", ticked(spec_.name),
                                                                    ticked(options_.machine),
                                                                    alternatives(options_.machine, names, "machines")));
  spec_ = part_of_machine(std::move(spec_), options_.machine);
}

}  // namespace takt::graph
