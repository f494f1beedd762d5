// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "graph/language/loader.hpp"
#include "graph/language/overlay.hpp"
#include "graph/language/param_text.hpp"
#include "graph/language/quantity.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

/// The value as the parameter wants it, or what is wrong.
tl::expected<ParamValue, std::string> convert(const ParamBase& param, const Given& given) {
  const std::string kind = param.kind();
  if (given.value.is_boolean()) return ParamValue(given.value.get<bool>());
  if (kind != "integer" && kind != "number") {
    if (given.value.is_string()) return ParamValue(given.value.get<std::string>());
    if (given.value.is_number_integer()) return ParamValue(given.value.get<int64_t>());
    return ParamValue(given.value.get<double>());
  }
  if (given.value.is_number_integer() && carries_no_unit(param.unit())) return ParamValue(given.value.get<int64_t>());
  const auto number = parse_in_unit(given.raw, param.unit());
  if (!number) return tl::make_unexpected(number.error());
  if (kind == "number") return ParamValue(*number);
  // 0.3m in millimetres may miss 300 by one rounding.
  const double whole = std::round(*number);
  if (std::abs(whole - *number) > 1e-9 * std::max(1.0, std::abs(whole)) || std::abs(whole) > 9e15)
    return tl::make_unexpected(fmt::format("is `{}`, an integer is wanted", given.raw));
  return ParamValue(static_cast<int64_t>(whole));
}

}  // namespace

tl::expected<ParamValue, std::string> parse_param(const ParamBase& param, const std::string& text) {
  Given given;
  given.raw = text;
  const auto value = resolve_scalar(text);
  if (!value) return tl::make_unexpected(value.error());
  given.value = value->is_null() ? json("") : *value;
  return convert(param, given);
}

namespace {

std::vector<std::string> param_names(const Node& node) {
  std::vector<std::string> names;
  for (const auto* param : node.params()) names.emplace_back(param->name());
  return names;
}

}  // namespace

Given Loader::given(const Document& document, const std::string& pointer, const json& value) {
  Given result;
  result.value = value;
  result.raw = document.raw(pointer);
  result.key = document.key_at(pointer);
  result.position = document.value_at(pointer);
  return result;
}

void Loader::make_instances() {
  std::vector<std::string> names;
  for (const auto& [name, type] : types_.all()) names.push_back(name);
  for (const auto& node : spec_.nodes) {
    if (node.type.empty()) continue;  // the schema has reported it
    const Position at = graph_.value_at(child(child(child("/subsystems", node.subsystem), node.id), "type"));
    const NodeType* type = types_.find(node.type);
    if (type == nullptr) {
      problem(at, fmt::format("node {} has the unknown type {}{}", ticked(node.id), ticked(node.type),
                              alternatives(node.type, names, "node types")));
      continue;
    }
    try {
      instances_[node.id] = type->make();
    } catch (const std::exception& error) {
      problem(at, fmt::format("node {}: type {} cannot be made: {}", ticked(node.id), ticked(node.type), error.what()));
    }
  }
}

/// Parameters of nodes that the profile chooses; the command line may choose others.
void Loader::read_profile_set() {
  const std::string pointer = child(child("/profiles", spec_.profile), "set");
  const json::json_pointer where(pointer);
  if (spec_.profile.empty() || !graph_.root.contains(where) || !graph_.root.at(where).is_object()) return;
  std::vector<std::string> nodes;
  for (const auto& node : spec_.nodes) nodes.push_back(node.id);
  for (const auto& [text, value] : graph_.root.at(where).items()) {
    if (!value.is_primitive() || value.is_null()) continue;  // the schema has reported it
    const size_t dot = std::min(text.find('.'), text.size());
    const std::string id = text.substr(0, dot);
    if (dot + 1 >= text.size())
      problem(graph_.key_at(child(pointer, text)), ticked(text) + " is not understood; write node.param: value");
    else if (std::find(nodes.begin(), nodes.end(), id) == nodes.end())
      problem(graph_.key_at(child(pointer, text)),
              fmt::format("profile {} sets {}, which is no node{}", ticked(spec_.profile), ticked(id),
                          alternatives(id, nodes, "nodes")));
    else set_.push_back({id, text.substr(dot + 1), given(child(pointer, text), value)});
  }
}

void Loader::read_kept() {
  const std::filesystem::path file = overlay_file(options_.state, spec_.name);
  std::error_code ignored;
  if (file.empty() || spec_.name.empty() || !std::filesystem::exists(file, ignored)) return;
  spec_.kept.file = file;
  std::vector<std::string> nodes;
  for (const auto& node : spec_.nodes) nodes.push_back(node.id);
  for (const Overlay::Value& kept : read_overlay(file, spec_.name, problems_).values) {
    const std::string name = kept.node + "." + kept.param;
    if (std::find(nodes.begin(), nodes.end(), kept.node) == nodes.end()) {
      problem(kept.key, fmt::format("there is no node {}{}{}", ticked(kept.node), alternatives(kept.node, nodes),
                                    overlay_remedy(name)));
      continue;
    }
    spec_.kept.values.push_back({name, kept.text});
    for (const std::string& set : options_.set)
      if (set.starts_with(name + "=")) spec_.kept.values.back().overridden = true;
    Setting setting{kept.node, kept.param, {}};
    setting.given.value = kept.value;
    setting.given.raw = kept.text;
    setting.given.key = kept.key;
    setting.given.position = kept.position;
    setting.given.by = ChosenBy::kept;
    setting.given.remedy = overlay_remedy(name);
    set_.push_back(std::move(setting));
  }
}

void Loader::read_set() {
  const Position at{"--set", 0, 0};
  for (const auto& text : options_.set) {
    const size_t equals = text.find('='), dot = text.find('.');
    if (equals == std::string::npos || dot == std::string::npos || dot == 0 || dot + 1 >= equals) {
      problem(at, ticked(text) + " is not understood; write --set node.param=value");
      continue;
    }
    Setting setting;
    setting.id = text.substr(0, dot);
    setting.name = text.substr(dot + 1, equals - dot - 1);
    setting.given.raw = text.substr(equals + 1);
    setting.given.key = setting.given.position = at;
    setting.given.by = ChosenBy::command_line;
    std::error_code ignored;
    const auto expanded = expand_variables(setting.given.raw, std::filesystem::current_path(ignored));
    const auto value = resolve_scalar(setting.given.raw);
    if (!expanded || !value) {
      problem(at, ticked(text) + ": " + (expanded ? value.error() : expanded.error()));
      continue;
    }
    if (value->is_null()) {
      problem(at, ticked(text) + " has no value; write --set node.param=value");
      continue;
    }
    if (!claimed_.contains(setting.id)) {
      problem(at,
              fmt::format("{}: unknown id {}{}", ticked(text), ticked(setting.id), alternatives(setting.id, ids())));
      continue;
    }
    setting.given.value = value->is_string() ? json(*expanded) : *value;
    set_.push_back(std::move(setting));
  }
}

void Loader::read_params() {
  for (auto& node : spec_.nodes) {
    const auto instance = instances_.find(node.id);
    if (instance == instances_.end()) continue;
    const std::string pointer = child(child(child("/subsystems", node.subsystem), node.id), "params");
    const json::json_pointer where(pointer);
    if (graph_.root.contains(where) && graph_.root.at(where).is_object()) {
      for (const auto& [name, value] : graph_.root.at(where).items())
        if (value.is_primitive() && !value.is_null())
          read_param(node, *instance->second, name, given(child(pointer, name), value));
    }
    for (const auto& setting : set_)
      if (setting.id == node.id) read_param(node, *instance->second, setting.name, setting.given);
  }
}

void Loader::read_param(NodeSpec& node, Node& instance, const std::string& name, const Given& given) {
  for (auto* param : instance.params()) {
    if (param->name() != name) continue;
    auto value = convert(*param, given);
    const auto taken = value ? param->set(*value) : tl::make_unexpected(value.error());
    if (!taken) {
      // Where a range is quoted the unit belongs to it.
      const bool ranged = value.has_value() && !carries_no_unit(param->unit());
      return problem(given.position,
                     fmt::format("parameter {} of node {} {}{}{}", ticked(name), ticked(node.id), taken.error(),
                                 ranged ? fmt::format(" (in {})", param->unit()) : "", given.remedy));
    }
    // A path of another file than the graph's starts there.
    std::error_code ignored;
    if (const auto* path = std::get_if<std::string>(&*value); path != nullptr && !path->empty() &&
                                                              param->unit() == kPath && given.by == ChosenBy::file &&
                                                              given.position.file != graph_.file)
      *value = (std::filesystem::absolute(given.position.file, ignored).parent_path() / *path)
                   .lexically_normal()
                   .lexically_proximate(spec_.directory.lexically_normal())
                   .string();
    node.params[name] = {*value, given.position, given.by};
    return;
  }
  problem(given.key, fmt::format("node {} (type {}) has no parameter {}{}{}", ticked(node.id), ticked(node.type),
                                 ticked(name), alternatives(name, param_names(instance)), given.remedy));
}

}  // namespace takt::graph
