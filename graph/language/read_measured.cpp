// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <limits>

#include "graph/language/loader.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

// What is missing, of another type or out of range was reported by the schema, and is passed over here.

void read(const json& map, const char* key, std::string& value) {
  if (map.contains(key) && map[key].is_string()) value = map[key].get<std::string>();
}

void read(const json& map, const char* key, double& value) {
  if (map.contains(key) && map[key].is_number()) value = map[key].get<double>();
}

template <class Whole>
void read(const json& map, const char* key, Whole& value) {
  if (map.contains(key) && map[key].is_number_integer() && map[key] >= 0 &&
      map[key] <= std::numeric_limits<Whole>::max())
    value = map[key].template get<Whole>();
}

}  // namespace

void Loader::read_measured(const json& value) {
  MeasuredSpec measured;
  measured.position = schedule_.key_at("/measured");
  const json machine = value.value("machine", json::object());
  if (machine.is_object()) {
    read(machine, "cpu", measured.machine.cpu);
    read(machine, "cores", measured.machine.cores);
    read(machine, "kernel", measured.machine.kernel);
  }
  read(value, "at", measured.at);
  read(value, "policy", measured.policy);
  read(value, "quantile", measured.quantile);
  read(value, "margin", measured.margin);
  const json nodes = value.value("nodes", json::object());
  if (nodes.is_object()) {
    for (const auto& [id, entry] : nodes.items()) {
      const std::string pointer = child("/measured/nodes", id);
      if (!claimed_.contains(id))
        problem(schedule_.key_at(pointer),
                fmt::format("`measured` names {}, but graph {} has no such node or device{}; take it out, or measure "
                            "anew with `takt profile`",
                            ticked(id), ticked(spec_.name), alternatives(id, ids())));
      if (!entry.is_object()) continue;
      MeasuredSpec::Exec& exec = measured.nodes[id];
      exec.exec_ns = read_time(schedule_, entry, pointer, "exec", "the measurement of " + ticked(id)).value_or(0);
      read(entry, "samples", exec.samples);
    }
  }
  spec_.schedule.measured = std::move(measured);
}

}  // namespace takt::graph
