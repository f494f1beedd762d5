// SPDX-License-Identifier: Apache-2.0
// What spans more than one edge: chains and modes.
#include <fmt/format.h>

#include <algorithm>

#include "graph/language/loader.hpp"

namespace takt::graph {
namespace {

/// Any loss may end in safe_stop: what it leaves out must not be a device whose return is waited for.
void keep_in_safe_stop(std::vector<ModeSpec>& modes) {
  for (ModeSpec& stop : modes) {
    if (stop.name != kSafeStopMode) continue;
    for (const ModeSpec& mode : modes)
      for (const std::string& device : mode.lost) std::erase(stop.without, device);
  }
}

}  // namespace

void Loader::check_chains() {
  for (const auto& chain : spec_.chains) {
    const std::string pointer = child("/chains", chain.name);
    const size_t before = problems_.size();
    bool known = true;
    for (const auto& [key, port] : {std::pair{"from", &chain.from}, std::pair{"to", &chain.to}}) {
      const Position at = graph_.value_at(child(pointer, key));
      const auto part = parts_.find(port->node);
      if (part == parts_.end()) {
        problem(at, fmt::format("{} of chain {} is {}, but there is no node or device {}{}", ticked(key),
                                ticked(chain.name), ticked(port->text()), ticked(port->node),
                                alternatives(port->node, ids())));
        continue;
      }
      known = known && part->second.known;
      const bool end = std::string_view(key) == "to";
      if (!part->second.known || part->second.output(port->port) != nullptr ||
          (end && part->second.input(port->port) != nullptr))
        continue;
      problem(at,
              fmt::format("{} of chain {} is {}, but {} has no {} {}{}", ticked(key), ticked(chain.name),
                          ticked(port->text()), ticked(port->node), end ? "port" : "output", ticked(port->port),
                          alternatives(port->port, part->second.output_names(), "outputs of " + ticked(port->node))));
    }
    if (!known || problems_.size() > before) continue;
    // Parts that data of `from` reach, edge by edge; if `to` is an input, the last edge must be the one into it.
    std::set<std::string> reached;
    bool ends = false;
    for (bool grew = true; grew;) {
      grew = false;
      for (const auto& [id, part] : parts_)
        for (const auto& edge : *part.edges) {
          if (!(edge.from == chain.from) && !reached.contains(edge.from.node)) continue;
          grew = reached.insert(id).second || grew;
          if (id == chain.to.node) ends = ends || part.output(chain.to.port) != nullptr || edge.input == chain.to.port;
        }
    }
    // A broken edge may be the missing one.
    if (ends || std::any_of(parts_.begin(), parts_.end(), [](const auto& item) { return !item.second.sound; }))
      continue;
    problem(chain.position,
            fmt::format("chain {}: no path of edges leads from {} to {}; from {} edges lead to: {}", ticked(chain.name),
                        ticked(chain.from.text()), ticked(chain.to.text()), ticked(chain.from.text()),
                        reached.empty() ? "(nothing)" : join_words({reached.begin(), reached.end()})));
  }
}

void Loader::check_modes() {
  std::set<std::string> losable;
  for (const auto& mode : spec_.modes) {
    if (mode.defined) check_mode(mode);
    else if (mode.name != kSafeStopMode || mode.lost.empty())
      problem(mode.position, fmt::format("mode {} lacks `without`: a list of node and device ids", ticked(mode.name)));
    check_lost(mode);
    losable.insert(mode.lost.begin(), mode.lost.end());
    if (losable.size() <= ModeRules::kMostSources) continue;
    problem(mode.position, fmt::format("mode {}: `lost` of all modes names more than {} devices", ticked(mode.name),
                                       ModeRules::kMostSources));
    break;
  }
  if (options_.mode == "full" || options_.mode.empty()) return;
  std::vector<std::string> names{"full"};
  for (const auto& mode : spec_.modes)
    if (mode.defined) names.push_back(mode.name);
  if (std::find(names.begin(), names.end(), options_.mode) == names.end())
    return problem({"--mode", 0, 0}, fmt::format("graph {} has no mode {}{}", ticked(spec_.name), ticked(options_.mode),
                                                 alternatives(options_.mode, names, "modes")));
  spec_.mode = options_.mode;
}

void Loader::apply_mode() {
  keep_in_safe_stop(spec_.modes);
  const auto mode =
      std::find_if(spec_.modes.begin(), spec_.modes.end(), [&](const ModeSpec& m) { return m.name == spec_.mode; });
  if (mode == spec_.modes.end()) return;
  const std::set<std::string> without(mode->without.begin(), mode->without.end());
  std::erase_if(spec_.nodes, [&](const NodeSpec& node) { return without.contains(node.id); });
  std::erase_if(spec_.devices, [&](const DeviceSpec& device) { return without.contains(device.id); });
  std::erase_if(spec_.schedule.entries, [&](const auto& entry) { return without.contains(entry.first); });
  // Optional inputs, as check_mode has seen to, and the groups that they were joined in.
  for (DeviceSpec& device : spec_.devices)
    std::erase_if(device.edges, [&](const EdgeSpec& edge) { return without.contains(edge.from.node); });
  for (NodeSpec& node : spec_.nodes) {
    for (const EdgeSpec& edge : node.edges)
      for (auto& group : node.joins)
        if (without.contains(edge.from.node)) std::erase(group, edge.input);
    std::erase_if(node.joins, [](const auto& group) { return group.size() < 2; });
    std::erase_if(node.edges, [&](const EdgeSpec& edge) { return without.contains(edge.from.node); });
  }
}

void Loader::tell_what_is_not_enforced() {
  for (const auto& [id, entry] : spec_.schedule.entries) {
    const auto instance = instances_.find(id);
    const size_t levels = instance == instances_.end() ? 1 : instance->second->levels().size();
    if (entry.on_overrun == OnOverrun::degrade && levels == 1)
      spec_.adjusted.push_back(fmt::format(
          "on_overrun of {}: degrade -> continue: it has one quality level (takt nodes TYPE lists them)", id));
  }
}

void Loader::check_lost(const ModeSpec& mode) {
  const std::string pointer = child(child("/modes", mode.name), "lost");
  std::vector<std::string> devices;
  for (const auto& device : spec_.devices) devices.push_back(device.id);
  for (const auto& machine : spec_.machines) devices.push_back(machine.name);
  std::set<std::string> lost;
  for (const auto& id : mode.lost) {
    if (std::find(devices.begin(), devices.end(), id) == devices.end())
      problem(item_at(pointer, id), fmt::format("mode {} is for the loss of {}, which is no device{}",
                                                ticked(mode.name), ticked(id), alternatives(id, devices, "devices")));
    else if (!lost.insert(id).second)
      problem(item_at(pointer, id), fmt::format("`lost` of mode {} names {} twice", ticked(mode.name), ticked(id)));
  }
}

void Loader::check_mode(const ModeSpec& mode) {
  const std::string pointer = child(child("/modes", mode.name), "without");
  std::set<std::string> without;
  const size_t before = problems_.size();
  for (const auto& id : mode.without) {
    if (!parts_.contains(id))
      problem(item_at(pointer, id), fmt::format("mode {} is without {}, which is no node or device{}",
                                                ticked(mode.name), ticked(id), alternatives(id, ids())));
    else if (!without.insert(id).second)
      problem(item_at(pointer, id), fmt::format("mode {} names {} twice", ticked(mode.name), ticked(id)));
  }
  if (problems_.size() > before) return;
  for (const auto& [id, part] : parts_) {
    if (without.contains(id)) continue;
    for (const auto& edge : *part.edges) {
      const PortInfo* input = part.input(edge.input);
      if (!without.contains(edge.from.node) || (input != nullptr && input->need == Need::optional)) continue;
      if (!part.known) continue;
      problem(mode.position, fmt::format("mode {} leaves input {} of {} unconnected: it is without {}; add {} to "
                                         "`without`, or keep {}",
                                         ticked(mode.name), ticked(edge.input), ticked(id), ticked(edge.from.node),
                                         ticked(id), ticked(edge.from.node)));
    }
    const auto entry = spec_.schedule.entries.find(id);
    if (entry == spec_.schedule.entries.end() || !entry->second.on || !without.contains(entry->second.on->node))
      continue;
    problem(mode.position,
            fmt::format("mode {} is without {}, whose output {} releases {}; add {} to `without`, or give it a rate",
                        ticked(mode.name), ticked(entry->second.on->node), ticked(entry->second.on->text()), ticked(id),
                        ticked(id)));
  }
}

}  // namespace takt::graph
