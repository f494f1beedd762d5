// SPDX-License-Identifier: Apache-2.0
#include "graph/log/recorded_plan.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <map>

#include "graph/language/share.hpp"
#include "rt/abi.hpp"
#include "rt/node.hpp"
#include "rt/record/message_record.hpp"
#include "rt/xxhash.hpp"

namespace takt::log {
namespace {

Json task_json(const Plan& plan, const TaskPlan& task) {
  Json edges = Json::array(), outputs = Json::array(), params = Json::object();
  for (const EdgePlan& edge : task.edges)
    edges.push_back({{"input", task.node->inputs()[edge.input]->name()},
                     {"from", plan.ports[edge.port].node + "." + plan.ports[edge.port].port},
                     {"depth", edge.depth}});
  for (const size_t port : task.ports) outputs.push_back(plan.ports[port].port);
  for (const ParamBase* param : task.node->params()) params[std::string(param->name())] = graph::recorded_text(*param);
  return {{"name", task.name}, {"device", task.device}, {"edges", edges}, {"outputs", outputs}, {"params", params}};
}

std::string hash_text(const std::string& text) {
  return fmt::format("{:016x}", record::hash_of(std::as_bytes(std::span(text.data(), text.size()))));
}

std::string folder_hash(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;  // in an order that does not depend on the file system
  std::error_code error;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, error))
    if (entry.is_regular_file(error)) files[entry.path().lexically_relative(folder).string()] = file_hash(entry.path());
  std::string all;
  for (const auto& [name, hash] : files) all += name + " " + hash + "\n";
  return hash_text(all);
}

std::string value_text(const ParamValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* whole = std::get_if<int64_t>(&value)) return std::to_string(*whole);
  if (const auto* real = std::get_if<double>(&value)) return fmt::format("{}", *real);
  return std::get<std::string>(value);
}

/// The name of element `index` of a list or an object of the plan; its number if there is none.
std::string name_at(const Json& all, size_t index) {
  if (index >= all.size()) return std::to_string(index);
  if (all.is_object()) return std::next(all.items().begin(), static_cast<ptrdiff_t>(index)).key();
  return all[index].is_string() ? all[index].get<std::string>() : all[index].value("name", "");
}

std::string param_name(size_t task, size_t param, const Json& plan) {
  const Json tasks = plan.value("tasks", Json::array());
  return name_at(task < tasks.size() ? tasks[task].value("params", Json::object()) : Json::object(), param);
}

/// The task without what may differ.
Json structure_of(Json task) {
  task.erase("params");
  return task;
}

}  // namespace

Json plan_json(const Plan& plan) {
  Json tasks = Json::array(), ports = Json::array(), modes = Json::array();
  for (const TaskPlan& task : plan.tasks) tasks.push_back(task_json(plan, task));
  for (const PortPlan& port : plan.ports)
    ports.push_back(
        {{"name", port.node + "." + port.port},
         {"type", port.type->name},
         {"capacity", {port.capacity.width, port.capacity.height, port.capacity.channels, port.capacity.count}}});
  for (const ModePlan& mode : plan.modes) modes.push_back(mode.name);
  return {{"tasks", tasks}, {"ports", ports}, {"mode", plan.mode}, {"modes", modes}};
}

std::string event_node(const record::RecordedEvent& event, const Json& plan) {
  return event.task == record::RecordedEvent::kNoTask ? "" : name_at(plan.value("tasks", Json::array()), event.task);
}

std::string event_text(const record::RecordedEvent& event, const Json& plan) {
  if (const auto* restart = std::get_if<record::Restart>(&event.what)) {
    std::string text = fmt::format("restart before job {}", event.job);
    for (const auto& kept : restart->params)
      text += fmt::format(", {} still {}", param_name(event.task, kept.param, plan), value_text(kept.value));
    return text;
  }
  if (const auto* set = std::get_if<record::ParameterSet>(&event.what))
    return fmt::format("{} set to {}{}{}", param_name(event.task, set->param, plan), value_text(set->value),
                       set->who.empty() ? "" : " by ", set->who);
  if (const auto* change = std::get_if<record::ModeChange>(&event.what))
    return fmt::format("mode {}: {}", name_at(plan.value("modes", Json::array()), change->mode), change->reason);
  if (const auto* mark = std::get_if<record::MarkSet>(&event.what))
    return fmt::format("mark: {}{}{}", mark->words, mark->who.empty() ? "" : " by ", mark->who);
  if (const auto* said = std::get_if<record::LogSaid>(&event.what))
    return fmt::format("{}: {}", to_string(static_cast<LogLevel>(said->level)),
                       with_dropped(said->text, said->dropped));
  return record::name_of(event.kind);
}

std::optional<std::string> structure_differs(const Json& recorded, const Json& plan) {
  for (const char* list : {"tasks", "ports"}) {
    const Json &then = recorded.at(list), &now = plan.at(list);
    for (size_t i = 0; i < std::min(then.size(), now.size()); ++i)
      if (structure_of(then[i]) != structure_of(now[i]))
        return fmt::format("{} in the record is {}, in the graph {}", then[i].at("name").get<std::string>(),
                           structure_of(then[i]).dump(), structure_of(now[i]).dump());
    if (then.size() != now.size())
      return fmt::format("the record has {} {}, the graph {}", then.size(), list, now.size());
  }
  if (recorded.at("modes") != plan.at("modes") || recorded.at("mode") != plan.at("mode"))
    return fmt::format("the modes of the record are {}, those of the graph {}", recorded.at("modes").dump(),
                       plan.at("modes").dump());
  return std::nullopt;
}

std::vector<std::string> changed_params(const Json& recorded, const Json& plan) {
  std::vector<std::string> changed;
  for (size_t t = 0; t < plan.at("tasks").size(); ++t) {
    if (plan.at("tasks")[t].at("device").get<bool>()) continue;  // a replay does not run it
    const Json &then = recorded.at("tasks")[t].at("params"), &now = plan.at("tasks")[t].at("params");
    for (const auto& [name, value] : now.items()) {
      const std::string before = then.value(name, "nothing");
      if (value == before) continue;
      changed.push_back(fmt::format("{}.{} is {} instead of {}", plan.at("tasks")[t].at("name").get<std::string>(),
                                    name, value.get<std::string>(), before));
    }
  }
  return changed;
}

Capacity capacity_of(const Json& recorded, size_t index) {
  const Json& numbers = recorded.at("ports").at(index).at("capacity");
  return {numbers.at(0), numbers.at(1), numbers.at(2), numbers.at(3)};
}

std::map<std::string, std::filesystem::path> assets(const Plan& plan, const std::filesystem::path& directory) {
  std::map<std::string, std::filesystem::path> places;
  for (const TaskPlan& task : plan.tasks)
    for (const ParamBase* param : task.node->params())
      if (param->unit() == kPath && !param->value_text().empty())
        places[graph::recorded_text(*param)] = directory / param->value_text();
  return places;
}

Json asset_hashes(const Plan& plan, const std::filesystem::path& directory) {
  Json hashes = Json::object();
  std::error_code error;
  for (const auto& [name, place] : assets(plan, directory)) {
    if (std::filesystem::is_directory(place, error)) hashes[name] = folder_hash(place);
    else if (std::filesystem::is_regular_file(place, error)) hashes[name] = file_hash(place);
  }
  return hashes;
}

std::string part_name(size_t i) { return fmt::format("part_{}.yaml", i); }

/// Block by block: where memory is locked, a mapping or a copy of the file would be resident as a whole.
std::string file_hash(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::array<char, 16384> block;
  XXH3_state_t state;
  XXH3_64bits_reset(&state);
  while (in.read(block.data(), block.size()) || in.gcount() > 0)
    XXH3_64bits_update(&state, block.data(), static_cast<size_t>(in.gcount()));
  return fmt::format("{:016x}", XXH3_64bits_digest(&state));
}

std::string program_hash() {
  Dl_info core{};
  const bool found = dladdr(reinterpret_cast<const void*>(&version), &core) != 0;
  return hash_text(file_hash("/proc/self/exe") + (found ? file_hash(core.dli_fname) : ""));
}

std::string file_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace takt::log
