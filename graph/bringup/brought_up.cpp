// SPDX-License-Identifier: Apache-2.0
#include "graph/bringup/brought_up.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "graph/language/param_text.hpp"
#include "graph/language/registry.hpp"
#include "rt/file/output_file.hpp"
#include "rt/record/message_record.hpp"

namespace takt::bringup {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kBase = "mobile_base", kHead = "camera_head";

std::string hash(const std::string& text) {
  return fmt::format("{:016x}", record::hash_of(std::as_bytes(std::span(text.data(), text.size()))));
}

Json to_json(const Trial& trial) {
  return {{"of", trial.of}, {"at", trial.at}, {"passed", trial.passed}, {"said", trial.said}};
}

Trial trial_of(const Json& json) {
  return {json.at("of").get<std::string>(), json.at("at").get<std::string>(), json.at("said").get<std::string>(),
          json.at("passed").get<bool>()};
}

const graph::DeviceSpec* device_of(const graph::GraphSpec& graph, const std::string& id) {
  const auto found =
      std::find_if(graph.devices.begin(), graph.devices.end(), [&](const auto& d) { return d.id == id; });
  return found == graph.devices.end() ? nullptr : &*found;
}

const graph::NodeSpec* node_of(const graph::GraphSpec& graph, const std::string& id) {
  const auto found = std::find_if(graph.nodes.begin(), graph.nodes.end(), [&](const auto& n) { return n.id == id; });
  return found == graph.nodes.end() ? nullptr : &*found;
}

/// What decides what the output says: its node with parameters and inputs, and all behind these.
void describe(const graph::GraphSpec& graph, const std::string& id, std::set<std::string>& seen, std::string& text) {
  if (!seen.insert(id).second) return;
  std::vector<graph::EdgeSpec> edges;
  if (const graph::DeviceSpec* device = device_of(graph, id)) {
    text += fmt::format("device {} {}\n", id, fingerprint(*device));
  } else if (const graph::NodeSpec* node = node_of(graph, id)) {
    text += fmt::format("node {} {}\n", id, node->type);
    for (const auto& [name, param] : node->params)
      text += fmt::format("  {} = {}\n", name,
                          std::visit([](const auto& value) { return fmt::format("{}", value); }, param.value));
    edges = node->edges;
  }
  for (const graph::EdgeSpec& edge : edges) {
    text += fmt::format("  {} from {}, {} ns\n", edge.input, edge.from.text(), edge.max_age_ns.value_or(0));
    describe(graph, edge.from.node, seen, text);
  }
}

}  // namespace

tl::expected<BroughtUp, std::string> BroughtUp::read(const std::filesystem::path& file) {
  BroughtUp known;
  std::ifstream stream(file);
  if (!stream) return known;
  const Json json = Json::parse(stream, nullptr, false);
  try {
    if (json.at("takt") != 1) throw std::out_of_range("takt");
    for (const auto& [id, trial] : json.at("devices").items()) known.devices[id] = trial_of(trial);
    known.stop_chain = trial_of(json.at("stop_chain"));
  } catch (const std::exception&) {
    return tl::unexpected(
        fmt::format("{} does not say what was brought up; remove it, and try the devices again: takt "
                    "bringup",
                    file.string()));
  }
  return known;
}

tl::expected<void, std::string> BroughtUp::write(const std::filesystem::path& file, const std::string& graph) const {
  Json tried = Json::object();
  for (const auto& [id, trial] : devices) tried[id] = to_json(trial);
  const Json json{{"takt", 1}, {"graph", graph}, {"devices", tried}, {"stop_chain", to_json(stop_chain)}};
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  if (const auto written = write_file(file, json.dump(2) + "\n"); !written) return tl::unexpected(written.error().what);
  return {};
}

std::filesystem::path brought_up_file(const std::filesystem::path& state_folder, const std::string& graph) {
  return state_folder.empty() ? std::filesystem::path() : state_folder / "bringup" / (graph + ".json");
}

std::string fingerprint(const graph::DeviceSpec& device) {
  return hash(fmt::format("{} {} {}", device.kind, device.driver, device.settings.dump()));
}

std::string stop_fingerprint(const graph::GraphSpec& graph, const std::string& base) {
  const graph::DeviceSpec* device = device_of(graph, base);
  if (device == nullptr) return "";
  for (const graph::EdgeSpec& edge : device->edges) {
    if (edge.input != "stop") continue;
    std::set<std::string> seen;
    std::string text = fmt::format("base {} {} ns\n", fingerprint(*device), edge.max_age_ns.value_or(0));
    describe(graph, edge.from.node, seen, text);
    return hash(text);
  }
  return "";
}

std::vector<const graph::DeviceSpec*> real_devices(const graph::GraphSpec& graph, const Registry& registry,
                                                   bool doubles) {
  std::vector<const graph::DeviceSpec*> real;
  for (const graph::DeviceSpec& device : graph.devices) {
    const hal::DeviceKind* kind = registry.devices.find(device.kind);
    const hal::DriverInfo* driver = kind != nullptr ? kind->driver(device.driver) : nullptr;
    if (driver == nullptr) continue;
    const bool is_real = driver->sort == hal::DriverSort::hardware || driver->sort == hal::DriverSort::neighbour;
    if (is_real || (doubles && driver->sort == hal::DriverSort::doubled))
      real.push_back(&device);
  }
  const auto moves = [](const graph::DeviceSpec* device) {
    return device->kind == kBase ? 2 : device->kind == kHead ? 1 : 0;
  };
  std::stable_sort(real.begin(), real.end(), [&](const auto* a, const auto* b) { return moves(a) < moves(b); });
  return real;
}

const graph::DeviceSpec* base_of(const std::vector<const graph::DeviceSpec*>& devices) {
  return !devices.empty() && devices.back()->kind == kBase ? devices.back() : nullptr;
}

std::vector<std::string> lacks(const graph::GraphSpec& graph, const Registry& registry, const BroughtUp& known) {
  std::vector<std::string> lines;
  const auto real = real_devices(graph, registry);
  const graph::DeviceSpec* base = base_of(real);
  if (base == nullptr) return lines;
  const auto judge = [&](const std::string& what, const Trial& trial, const std::string& of) {
    if (trial.of.empty()) lines.push_back(what + " was never tried");
    else if (!trial.passed) lines.push_back(fmt::format("{} did not pass at {}: {}", what, trial.at, trial.said));
    else if (trial.of != of)
      lines.push_back(fmt::format("{} was tried at {}, and has other settings now", what, trial.at));
  };
  for (const graph::DeviceSpec* device : real) {
    const auto trial = known.devices.find(device->id);
    judge(device->id, trial == known.devices.end() ? Trial{} : trial->second, fingerprint(*device));
  }
  const std::string chain = stop_fingerprint(graph, base->id);
  if (chain.empty()) lines.push_back(fmt::format("nothing stops {}: its input `stop` is not connected", base->id));
  else judge("the stop of " + base->id, known.stop_chain, chain);
  return lines;
}

}  // namespace takt::bringup
