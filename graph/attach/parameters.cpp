// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/compose/composition.hpp"
#include "graph/language/quantity.hpp"
#include "hal/device_node.hpp"
#include "rt/sched/param_mail.hpp"

namespace takt::attach {
namespace {

using Json = nlohmann::ordered_json;

Json value_json(const ParamValue& value) {
  return std::visit([](const auto& v) { return Json(v); }, value);
}

const graph::NodeSpec* spec_of(const graph::GraphSpec& graph, const std::string& node) {
  const auto spec = std::find_if(graph.nodes.begin(), graph.nodes.end(), [&](const auto& s) { return s.id == node; });
  return spec == graph.nodes.end() ? nullptr : &*spec;
}

/// What the files and the command line gave; null: nothing, the default holds.
const graph::ParamSpec* given_value(const graph::GraphSpec& graph, const std::string& node, const std::string& param) {
  const graph::NodeSpec* spec = spec_of(graph, node);
  if (spec == nullptr) return nullptr;
  const auto given = spec->params.find(param);
  return given == spec->params.end() ? nullptr : &given->second;
}

const char* word(graph::ChosenBy by) {
  switch (by) {
    case graph::ChosenBy::file: return "file";
    case graph::ChosenBy::kept: return "kept";
    case graph::ChosenBy::command_line: return "command line";
  }
  return "";
}

}  // namespace

Json parameter_json(const NodeTypes& types, const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board,
                    size_t task, size_t param) {
  const TaskPlan& owner = plan.tasks[task];
  const ParamBase& declared = *owner.node->params()[param];  // its name and unit never change
  const std::string name(declared.name());
  Json entry = {{"node", owner.name}, {"param", name},   {"value", nullptr},   {"unit", declared.unit()},
                {"from", "file"},     {"at_s", nullptr}, {"by_user", nullptr}, {"taken_up", nullptr}};
  const KeptParam& kept = board.kept(task, param);
  if (const KeptParam::Value* live = kept.newest()) {
    entry["value"] = value_json(value_of(*live));
    entry["from"] = "set";
    entry["at_s"] = static_cast<double>(live->at_ns - board.epoch_ns()) / 1e9;
    entry["by_user"] = live->by_user;
    entry["taken_up"] = kept.taken_up.load();
  } else if (const graph::ParamSpec* given = given_value(graph, owner.name, name)) {
    entry["value"] = value_json(given->value);
    entry["from"] = word(given->by);
  } else if (const graph::NodeSpec* spec = spec_of(graph, owner.name)) {
    // Not from the node itself: a job of it may be at work.
    entry["value"] = types.find(spec->type)->make()->params()[param]->value_text();
    entry["from"] = "default";
  } else {
    entry["value"] = name == FaultParam::kName ? std::string(to_text(Misbehaviour::none)) : "";  // of a device
    entry["from"] = "default";
  }
  return entry;
}

Json parameters_json(const NodeTypes& types, const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board) {
  Json entries = Json::array();
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    for (size_t p = 0; p < board.param_count(t); ++p) {
      const std::string name(plan.tasks[t].node->params()[p]->name());
      const graph::ParamSpec* given = given_value(graph, plan.tasks[t].name, name);
      if (board.kept(t, p).newest() != nullptr || (given != nullptr && given->by != graph::ChosenBy::file))
        entries.push_back(parameter_json(types, graph, plan, board, t, p));
    }
  }
  return entries;
}

std::string parameter_text(const Json& parameter) {
  const auto word = [&](const char* key) { return parameter.at(key).get<std::string>(); };
  const Json& value = parameter.at("value");
  std::string text =
      fmt::format("{}.{} {}", word("node"), word("param"), value.is_string() ? value.get<std::string>() : value.dump());
  if (!graph::carries_no_unit(word("unit")) && word("unit") != kPath) text += " " + word("unit");
  text += " (" + word("from");
  if (!parameter.at("at_s").is_null()) text += fmt::format(" at {:.1f} s", parameter.at("at_s").get<double>());
  if (const Json& times = parameter.at("taken_up"); !times.is_null() && times.get<int>() > 0)
    text += fmt::format(", taken up after {} restart{}", times.get<int>(), times.get<int>() == 1 ? "" : "s");
  return text + ")";
}

}  // namespace takt::attach
