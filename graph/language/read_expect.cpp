// SPDX-License-Identifier: Apache-2.0
// What a run of the graph must show (`expect`): conditions on what outputs say and on the simulated world, and figures.
#include <fmt/format.h>

#include <algorithm>

#include "graph/language/figure_reader.hpp"
#include "graph/language/loader.hpp"
#include "graph/language/message_field.hpp"
#include "graph/language/quantity.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

const std::vector<std::string> kWindow{"from", "to"}, kTests{"is", "contains", "at_least", "at_most"},
    kOthers{"port", "field", "messages", "world", "within", "of", "holds", "unless"};

std::vector<std::string> joined(std::initializer_list<std::vector<std::string>> lists) {
  std::vector<std::string> all;
  for (const auto& list : lists) all.insert(all.end(), list.begin(), list.end());
  return all;
}

Holds holds_of(const json& value) {
  const std::string word = value.is_string() ? value.get<std::string>() : "";
  return word == "once"     ? Holds::once
         : word == "always" ? Holds::always
         : word == "never"  ? Holds::never
                            : Holds::at_end;
}

}  // namespace

void Loader::read_expect() {
  const json expect = graph_.root.value("expect", json());
  if (!expect.is_object()) return;
  ExpectSpec spec;
  spec.within_ns = read_time(graph_, expect, "/expect", "within", "`expect`").value_or(1);
  if (spec.within_ns <= 0)
    problem(graph_.value_at("/expect/within"),
            fmt::format("`within` of `expect` is {}; it must be above 0", graph_.raw("/expect/within")));
  const json all = expect.value("all", json::array());
  for (size_t i = 0; all.is_array() && i < all.size(); ++i) {
    if (!all[i].is_object()) continue;
    if (auto condition = read_condition(all[i], child("/expect/all", i)))
      spec.conditions.push_back(std::move(*condition));
  }
  FigureReader::Names names{spec_.name, ids(), {}, {"full", std::string(kSafeStopMode)}};
  for (const auto& mode : spec_.modes) names.modes.push_back(mode.name);
  for (const auto& chain : spec_.chains) names.chains.push_back(chain.name);
  FigureReader(graph_, names, problems_).read(expect, spec.figures);
  spec_.expect = std::move(spec);
}

std::optional<ConditionSpec> Loader::read_condition(const json& value, const std::string& pointer) {
  const std::vector<std::string> known = joined({kOthers, kTests, kWindow});
  for (const auto& [key, ignored] : value.items())  // the schema has reported it, and what was meant is not known
    if (std::find(known.begin(), known.end(), key) == known.end()) return std::nullopt;
  ConditionSpec condition;
  condition.position = graph_.value_at(pointer);
  if (value.contains("port") == value.contains("world")) {
    problem(condition.position, "a condition is either on a `port` or on the simulated `world`");
    return std::nullopt;
  }
  condition.holds = holds_of(value.value("holds", json()));
  const bool sound = (value.contains("port") ? read_port_condition(condition, value, pointer)
                                             : read_world_condition(condition, value, pointer)) &&
                     read_window(condition, value, pointer) && read_unless(condition, value, pointer);
  return sound ? std::optional(std::move(condition)) : std::nullopt;
}

std::optional<ConditionSpec> Loader::read_plain_condition(const json& value, const std::string& pointer) {
  const size_t before = problems_.size();
  std::optional<ConditionSpec> condition;
  if (value.is_object()) condition = read_condition(value, pointer);
  const bool plain = condition && condition->port.node.size() > 0;
  if (!plain && problems_.size() == before)
    problem(graph_.value_at(pointer),
            "this is no condition on a port, such as {port: base.odometry, field: speed_m_s, at_least: 1m/s}; keys: "
            "port, field, messages, is, contains, at_least, at_most, holds, from, to");
  return plain ? condition : std::nullopt;
}

void Loader::read_asked() {
  for (const std::string& text : options_.conditions) {
    const bool braced = text.find_first_not_of(' ') != std::string::npos && text[text.find_first_not_of(' ')] == '{';
    Document asked = parse_document(braced ? text : "{" + text + "}", "condition", {}, problems_);
    std::swap(graph_, asked);
    if (auto condition = read_plain_condition(graph_.root, "")) spec_.asked.push_back(std::move(*condition));
    std::swap(graph_, asked);
  }
}

bool Loader::check_keys(const json& value, const std::string& pointer, std::string_view what,
                        const std::vector<std::string>& valid) {
  bool sound = true;
  for (const auto& [key, ignored] : value.items()) {
    if (std::find(valid.begin(), valid.end(), key) != valid.end()) continue;
    problem(graph_.key_at(child(pointer, key)),
            fmt::format("a condition on {} takes no {}{}", what, ticked(key), alternatives(key, valid)));
    sound = false;
  }
  return sound;
}

bool Loader::read_port_condition(ConditionSpec& condition, const json& value, const std::string& pointer) {
  if (!value["port"].is_string()) return false;
  const auto name = value["port"].get<std::string>();
  condition.port = {name.substr(0, name.find('.')), name.substr(std::min(name.size(), name.find('.') + 1))};
  const Position& at = graph_.value_at(child(pointer, "port"));
  const auto part = parts_.find(condition.port.node);
  if (part == parts_.end()) {
    problem(at, fmt::format("`port` is {}, but there is no node or device {}{}", ticked(name),
                            ticked(condition.port.node), alternatives(condition.port.node, ids())));
    return false;
  }
  if (!part->second.known) return false;
  const PortInfo* output = part->second.output(condition.port.port);
  if (output == nullptr) {
    problem(at, fmt::format("`port` is {}, but {} has no output {}{}", ticked(name), ticked(condition.port.node),
                            ticked(condition.port.port),
                            alternatives(condition.port.port, part->second.output_names(),
                                         "outputs of " + ticked(condition.port.node))));
    return false;
  }
  if (value.contains("messages")) {
    const FigureReader::Names none;
    condition.bound = FigureReader(graph_, none, problems_)
                          .read_bound(value["messages"], child(pointer, "messages"), &Bound::at_least);
    return check_keys(value, pointer, "the number of messages", joined({{"port", "messages"}, kWindow}));
  }
  condition.of = ConditionSpec::Of::field;
  condition.field = value.contains("field") && value["field"].is_string() ? value["field"].get<std::string>() : "";
  const auto field = find_field(*output->type, condition.field);
  if (!field) {
    problem(graph_.value_at(child(pointer, value.contains("field") ? "field" : "port")),
            fmt::format("messages of {}: {}", ticked(name), field.error()));
    return false;
  }
  if (condition.field.empty()) condition.field = field->field.name;
  if (!carries_no_unit(field->unit())) condition.unit = field->unit();
  if (!check_keys(value, pointer, "a field", joined({{"port", "messages", "field", "holds"}, kTests, kWindow})))
    return false;
  return field->kind == MessageField::Kind::text ? read_text_test(condition, value, pointer)
                                                 : read_number_test(condition, value, pointer);
}

bool Loader::read_world_condition(ConditionSpec& condition, const json& value, const std::string& pointer) {
  if (!value["world"].is_string()) return false;
  const auto name = value["world"].get<std::string>();
  const size_t dot = name.find('.');
  condition.object = name.substr(0, dot);
  if (dot == std::string::npos) return read_distance(condition, value, pointer);
  condition.of = ConditionSpec::Of::attribute;
  condition.attribute = name.substr(dot + 1);
  return check_keys(value, pointer, "an attribute",
                    joined({{"world", "is", "contains", "holds", "unless"}, kWindow})) &&
         read_text_test(condition, value, pointer);
}

bool Loader::read_distance(ConditionSpec& condition, const json& value, const std::string& pointer) {
  condition.of = ConditionSpec::Of::distance;
  condition.unit = "m";
  if (!check_keys(value, pointer, "a distance", joined({{"world", "within", "of", "holds", "unless"}, kWindow})))
    return false;
  if (!value.contains("within") || !value.contains("of")) {
    problem(
        condition.position,
        fmt::format("{} is an object: say how far from where it is, as `within: 0.5m, of: [3m, 4m]` or `of: OBJECT`; "
                    "an attribute is written {}",
                    ticked(condition.object), ticked(condition.object + ".ATTRIBUTE")));
    return false;
  }
  const auto length = [&](const std::string& place, const char* what) -> std::optional<double> {
    const auto metres = parse_in_unit(graph_.raw(place), "m");
    if (metres) return *metres;
    problem(graph_.value_at(place), fmt::format("{} {}", ticked(what), metres.error()));
    return std::nullopt;
  };
  condition.bound.at_most = length(child(pointer, "within"), "within");
  if (!condition.bound.at_most) return false;
  const json& of = value["of"];
  const std::string place = child(pointer, "of");
  if (of.is_string()) {
    condition.other = of.get<std::string>();
    return true;
  }
  if (!of.is_array() || of.size() != 2) {
    problem(graph_.value_at(place), "`of` is a place as a list of two lengths, x and y of the map, or an object");
    return false;
  }
  const auto x = length(child(place, size_t{0}), "of"), y = length(child(place, size_t{1}), "of");
  condition.x_m = x.value_or(0);
  condition.y_m = y.value_or(0);
  return x && y;
}

bool Loader::read_number_test(ConditionSpec& condition, const json& value, const std::string& pointer) {
  const auto number = [&](const char* key, std::optional<double>& into) {
    if (!value.contains(key)) return true;
    const auto parsed = parse_in_unit(graph_.raw(child(pointer, key)), condition.unit);
    if (parsed) into = *parsed;
    else
      problem(graph_.value_at(child(pointer, key)),
              fmt::format("{} of {} {}", ticked(key), ticked(condition.field), parsed.error()));
    return parsed.has_value();
  };
  const bool bounded = value.contains("at_least") || value.contains("at_most");
  if (value.contains("contains") || bounded == value.contains("is")) {
    problem(condition.position,
            fmt::format("{} is a number: it takes `at_least`, `at_most` or both, or `is`", ticked(condition.field)));
    return false;
  }
  if (bounded) return number("at_least", condition.bound.at_least) && number("at_most", condition.bound.at_most);
  const bool sound = number("is", condition.bound.at_least);
  condition.bound.at_most = condition.bound.at_least;
  return sound;
}

bool Loader::read_text_test(ConditionSpec& condition, const json& value, const std::string& pointer) {
  if (value.contains("at_least") || value.contains("at_most") || value.contains("is") == value.contains("contains")) {
    problem(condition.position,
            fmt::format("{} is a text: it takes either `is` or `contains`",
                        ticked(condition.attribute.empty() ? condition.field : condition.attribute)));
    return false;
  }
  if (value.contains("is")) condition.is = graph_.raw(child(pointer, "is"));
  else condition.contains = graph_.raw(child(pointer, "contains"));
  return true;
}

bool Loader::read_window(ConditionSpec& condition, const json& value, const std::string& pointer) {
  const size_t before = problems_.size();
  condition.from_ns = read_time(graph_, value, pointer, "from", "a condition").value_or(0);
  condition.to_ns = read_time(graph_, value, pointer, "to", "a condition");
  if (condition.to_ns && *condition.to_ns <= condition.from_ns)
    problem(graph_.value_at(child(pointer, "to")), "`to` is not after `from`: nothing would count");
  return problems_.size() == before;
}

bool Loader::read_unless(ConditionSpec& condition, const json& value, const std::string& pointer) {
  if (!value.contains("unless")) return true;
  const std::string place = child(pointer, "unless");
  auto exception = read_condition(value["unless"], place);
  if (!exception) return false;
  const json& given = value["unless"];
  if (exception->of != ConditionSpec::Of::field || given.contains("holds") || given.contains("from") ||
      given.contains("to")) {
    problem(graph_.value_at(place), "`unless` is a test of a `field` of a `port`, without `holds`, `from` and `to`");
    return false;
  }
  condition.unless.push_back(std::move(*exception));
  return true;
}

}  // namespace takt::graph
