// SPDX-License-Identifier: Apache-2.0
#include "graph/language/part_of_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "graph/language/words.hpp"

namespace takt::graph {
namespace {

constexpr int64_t kRemoteBudget_ns = 1'000'000;  ///< to copy what has come
constexpr Rate kMachineRate{10, 1};

class Splitter {
 public:
  Splitter(GraphSpec& graph, const std::string& machine) : graph_(graph), whole_(graph), machine_(machine) {
    for (const MachineSpec& one : graph_.machines)
      for (const std::string& id : one.runs) home_[id] = one.name;
    for (const NodeSpec& node : graph_.nodes) home_[node.id] = home_[node.subsystem];
  }

  void take() {
    find_borders();
    std::erase_if(graph_.nodes, [&](const NodeSpec& node) { return !here(node.id); });
    std::erase_if(graph_.devices, [&](const DeviceSpec& device) { return !here(device.id); });
    std::erase_if(graph_.subsystems, [&](const SubsystemSpec& subsystem) { return !here(subsystem.name); });
    std::erase_if(graph_.schedule.entries, [&](const auto& entry) { return !here(entry.first); });
    for (const std::string& id : setup_order(whole_)) {
      if (const auto ports = needed_.find(id); ports != needed_.end()) add_remote(id, ports->second);
      const auto node =
          std::find_if(graph_.nodes.begin(), graph_.nodes.end(), [&](const auto& n) { return n.id == id; });
      if (node != graph_.nodes.end()) std::rotate(node, node + 1, graph_.nodes.end());
    }
    for (const MachineSpec& other : graph_.machines)
      if (other.name != machine_) add_machine(other);
    for (const DeviceSpec& device : graph_.devices) ids_.insert(device.id);
    for (const NodeSpec& node : graph_.nodes) ids_.insert(node.id);
    take_modes();
    take_chains();
    take_expectations();
    std::erase_if(graph_.record.ports, [&](const RecordSpec::Port& rule) { return !has(rule.port); });
    std::erase_if(graph_.record.freeze, [&](const ConditionSpec& condition) { return !has(condition.port); });
    std::erase_if(graph_.asked, [&](const ConditionSpec& condition) { return !has(condition.port); });
    graph_.machine = machine_;
    for (const NodeSpec& node : whole_.nodes)
      if (!here(node.id)) graph_.elsewhere[node.id] = home_.at(node.id);
    for (const DeviceSpec& device : whole_.devices)
      if (!here(device.id)) graph_.elsewhere[device.id] = home_.at(device.id);
    graph_.isolation = "subsystem";
  }

 private:
  bool here(const std::string& id) const {
    const auto found = home_.find(id);
    return found != home_.end() && found->second == machine_;
  }
  /// Whether that output is there, in this part.
  bool has(const PortName& port) const {
    if (here(port.node)) return ids_.contains(port.node);
    const auto ports = needed_.find(port.node);
    return ports != needed_.end() && ports->second.contains(port.port);
  }

  template <class Each>
  void for_each_edge(const Each& each) const {
    for (const DeviceSpec& device : whole_.devices)
      for (const EdgeSpec& edge : device.edges) each(device.id, edge);
    for (const NodeSpec& node : whole_.nodes)
      for (const EdgeSpec& edge : node.edges) each(node.id, edge);
  }

  void find_borders() {
    for_each_edge([&](const std::string& to, const EdgeSpec& edge) {
      if (here(to) && !here(edge.from.node)) needed_[edge.from.node].insert(edge.from.port);
      if (!here(to) && here(edge.from.node) &&
          std::find(graph_.exported.begin(), graph_.exported.end(), edge.from) == graph_.exported.end())
        graph_.exported.push_back(edge.from);
      if (!here(to) && here(edge.from.node)) graph_.export_readers[edge.from.text()].insert(home_.at(to));
    });
  }

  /// Of what is released by messages, that of the first in the row.
  Rate rate_of(const std::string& id) const {
    const auto entry = whole_.schedule.entries.find(id);
    if (entry != whole_.schedule.entries.end() && entry->second.rate) return *entry->second.rate;
    if (entry != whole_.schedule.entries.end() && entry->second.on) return rate_of(entry->second.on->node);
    const auto device =
        std::find_if(whole_.devices.begin(), whole_.devices.end(), [&](const auto& d) { return d.id == id; });
    return device != whole_.devices.end() && device->rate ? *device->rate : Rate{10, 1};
  }

  void add_remote(const std::string& id, const std::set<std::string>& ports) {
    DeviceSpec device;
    device.id = id;
    device.remote = RemoteSpec{home_.at(id), "", false, {ports.begin(), ports.end()}};
    for (const NodeSpec& node : whole_.nodes)
      if (node.id == id) device.remote->type = node.type, device.position = node.position;
    for (const DeviceSpec& other : whole_.devices)
      if (other.id == id)
        device.remote->type = other.kind, device.remote->of_device = true, device.position = other.position;
    const Rate rate = rate_of(id);
    device.remote->lag_ns = lag_of(id, ports, rate);
    add(std::move(device), Rate{2 * rate.numerator, rate.denominator});
  }

  /// What the graph says of its age, then the way here; and the newest one stays so until the next one is here.
  std::optional<int64_t> lag_of(const std::string& id, const std::set<std::string>& ports, const Rate& rate) const {
    const auto machine = std::find_if(whole_.machines.begin(), whole_.machines.end(),
                                      [&](const MachineSpec& other) { return other.name == home_.at(id); });
    int64_t oldest_ns = 0;
    for (const std::string& port : ports) {
      const auto age = machine->ages.find(id + "." + port);
      if (age == machine->ages.end()) return std::nullopt;
      oldest_ns = std::max(oldest_ns, age->second);
    }
    return oldest_ns + whole_.network.latency_ns + 2 * whole_.network.clock_error_ns + rate.period_ns();
  }

  void add_machine(const MachineSpec& other) {
    DeviceSpec device;
    device.id = other.name;
    device.position = other.position;
    device.remote = RemoteSpec{other.name, "", false, {}, 0};
    add(std::move(device), kMachineRate);
  }

  void add(DeviceSpec device, Rate rate) {
    ScheduleEntry entry;
    entry.rate = rate;
    entry.budget_ns = kRemoteBudget_ns;
    entry.position = device.position;
    graph_.schedule.entries[device.id] = entry;
    graph_.devices.push_back(std::move(device));
  }

  void take_modes() {
    for (ModeSpec& mode : graph_.modes)
      for (auto* list : {&mode.without, &mode.lost})
        std::erase_if(*list, [&](const std::string& id) { return !ids_.contains(id); });
  }

  enum class Over { whole, part };
  /// Ids that data of an output reach over edges of the whole graph, or over those of this part alone.
  std::set<std::string> reached_from(const PortName& from, Over over) const {
    std::set<std::string> reached;
    for (size_t before = SIZE_MAX; before != reached.size();) {
      before = reached.size();
      for_each_edge([&](const std::string& to, const EdgeSpec& edge) {
        if (over == Over::part && !here(to)) return;
        if (edge.from == from || reached.contains(edge.from.node)) reached.insert(to);
      });
    }
    return reached;
  }

  /// A chain that begins elsewhere begins here where it comes in; its bound holds as it did, since stamps are kept.
  void take_chains() {
    std::erase_if(graph_.chains, [&](ChainSpec& chain) {
      if (!here(chain.to.node)) return true;
      if (has(chain.from)) return false;
      const std::set<std::string> there = reached_from(chain.from, Over::whole);
      for (const auto& [id, ports] : needed_)
        for (const std::string& port : ports)
          if (there.contains(id) && reached_from({id, port}, Over::part).contains(chain.to.node)) {
            graph_.adjusted.push_back(fmt::format("chain {}: from {}: {} is on machine {}", chain.name, id + "." + port,
                                                  chain.from.text(), home_.at(chain.from.node)));
            chain.from = {id, port};
            return false;
          }
      return true;
    });
  }

  void take_expectations() {
    if (!graph_.expect) return;
    const auto foreign = [&](const auto& item) { return !ids_.contains(item.first); };
    auto& expect = *graph_.expect;
    std::erase_if(expect.conditions, [&](const ConditionSpec& c) {
      return (c.of == ConditionSpec::Of::messages || c.of == ConditionSpec::Of::field) && !has(c.port);
    });
    for (auto* figures :
         {&expect.figures.rates, &expect.figures.results, &expect.figures.misses, &expect.figures.stale})
      std::erase_if(*figures, foreign);
    std::erase_if(expect.figures.ages, [&](const auto& item) {
      return std::none_of(graph_.chains.begin(), graph_.chains.end(),
                          [&](const auto& chain) { return chain.name == item.first; });
    });
  }

  GraphSpec& graph_;
  const GraphSpec whole_;
  const std::string machine_;
  std::map<std::string, std::string> home_;              ///< machine of subsystems, devices and nodes
  std::map<std::string, std::set<std::string>> needed_;  ///< outputs of others, by who makes them
  std::set<std::string> ids_;                            ///< of nodes and devices of this part
};

}  // namespace

std::vector<std::string> setup_order(const GraphSpec& graph) {
  std::vector<std::pair<std::string, std::set<std::string>>> all;  // with those whose data each reads
  const auto add = [&](const std::string& id, const std::vector<EdgeSpec>& edges) {
    auto& producers = all.emplace_back(id, std::set<std::string>()).second;
    for (const EdgeSpec& edge : edges)
      if (edge.input != "control") producers.insert(edge.from.node);
  };
  for (const DeviceSpec& device : graph.devices) add(device.id, device.edges);
  for (const NodeSpec& node : graph.nodes) add(node.id, node.edges);
  for (auto& [id, producers] : all)  // of a graph with mistakes, too
    std::erase_if(producers, [&](const std::string& producer) {
      return std::none_of(all.begin(), all.end(), [&](const auto& one) { return one.first == producer; });
    });
  const auto needs_itself = [&](const auto& one) {
    std::set<std::string> needed = one.second;
    for (size_t before = 0; before != needed.size();) {
      before = needed.size();
      for (const auto& [id, producers] : all)
        if (needed.contains(id)) needed.insert(producers.begin(), producers.end());
    }
    return needed.contains(one.first);
  };
  std::vector<std::string> order;
  while (!all.empty()) {
    auto next = std::find_if(all.begin(), all.end(), [](const auto& one) { return one.second.empty(); });
    if (next == all.end()) next = std::find_if(all.begin(), all.end(), needs_itself);
    const std::string id = next->first;
    order.push_back(id);
    all.erase(next);
    for (auto& [other, producers] : all) producers.erase(id);
  }
  return order;
}

GraphSpec part_of_machine(GraphSpec graph, const std::string& machine) {
  Splitter(graph, machine).take();
  return graph;
}

void run_on_one_machine(GraphSpec& graph) {
  for (ModeSpec& mode : graph.modes)
    std::erase_if(mode.lost, [&](const std::string& id) {
      return std::any_of(graph.machines.begin(), graph.machines.end(),
                         [&](const auto& machine) { return machine.name == id; });
    });
}

}  // namespace takt::graph
