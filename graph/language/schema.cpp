// SPDX-License-Identifier: Apache-2.0
#include "graph/language/schema.hpp"

#include <algorithm>
#include <array>
#include <regex>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "graph/language/words.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

const json& schema_json(Schema schema) {
  static const std::array<json, kSchemas> parsed{
      json::parse(schema_text(Schema::graph)), json::parse(schema_text(Schema::schedule)),
      json::parse(schema_text(Schema::faults)), json::parse(schema_text(Schema::params)),
      json::parse(schema_text(Schema::machine))};
  return parsed[static_cast<size_t>(schema)];
}

const valijson::Schema& compiled(Schema schema) {
  const auto compile = [](Schema which) {
    auto result = std::make_unique<valijson::Schema>();
    valijson::SchemaParser parser;
    const valijson::adapters::NlohmannJsonAdapter adapter(schema_json(which));
    parser.populateSchema(adapter, *result);
    return result;
  };
  static const std::array compiled{compile(Schema::graph), compile(Schema::schedule), compile(Schema::faults),
                                   compile(Schema::params), compile(Schema::machine)};
  return *compiled[static_cast<size_t>(schema)];
}

bool is_of_type(const json& value, const std::string& type) {
  if (type == "object") return value.is_object();
  if (type == "array") return value.is_array();
  if (type == "string") return value.is_string();
  if (type == "boolean") return value.is_boolean();
  if (type == "integer") return value.is_number_integer();
  if (type == "number") return value.is_number();
  return value.is_null();
}

bool type_fits(const json& schema, const json& value) {
  if (!schema.contains("type")) return true;
  const json& types = schema["type"];
  if (types.is_string()) return is_of_type(value, types.get<std::string>());
  return std::any_of(types.begin(), types.end(),
                     [&](const json& t) { return is_of_type(value, t.get<std::string>()); });
}

std::string shown(const json& value) {
  if (value.is_object()) return "a map";
  if (value.is_array()) return "a list";
  if (value.is_null()) return "empty";
  const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  return ticked(text.size() > 60 ? text.substr(0, 60) + "..." : text);
}

/// Walks schema and document side by side and says what breaks the schema. valijson decides whether anything does; it
/// names neither the alternatives nor the place in words, which is what this adds.
class Explainer {
 public:
  Explainer(const Document& document, Schema which, std::vector<Problem>& problems)
      : document_(document), which_(which), root_(schema_json(which)), problems_(problems) {}

  void explain(const json& schema, const json& value, const std::string& pointer) {
    if (schema.contains("$ref")) return explain(resolve(schema), value, pointer);
    if (document_.broken.contains(pointer)) return;
    if (schema.contains("anyOf")) return any_of(schema, value, pointer);
    if (!type_fits(schema, value)) return wrong(schema, value, pointer);
    if (schema.contains("enum") &&
        std::find(schema["enum"].begin(), schema["enum"].end(), value) == schema["enum"].end())
      return wrong_word(schema, value, pointer);
    if (value.is_string()) text(schema, value, pointer);
    if (value.is_number()) number(schema, value, pointer);
    if (value.is_array()) list(schema, value, pointer);
    if (value.is_object()) map(schema, value, pointer);
  }

 private:
  const json& resolve(const json& schema) const {
    return root_.at(json::json_pointer(schema["$ref"].get<std::string>().substr(1)));
  }
  void problem(const Position& at, std::string text) { problems_.push_back({at, std::move(text)}); }

  void wrong(const json& schema, const json& value, const std::string& pointer) {
    problem(document_.value_at(pointer), place(pointer) + " is " + shown(value) +
                                             "; wanted: " + schema.value("description", std::string("another type")));
  }

  void wrong_word(const json& schema, const json& value, const std::string& pointer) {
    std::vector<std::string> words;
    for (const auto& word : schema["enum"]) words.push_back(word.is_string() ? word.get<std::string>() : word.dump());
    problem(document_.value_at(pointer), place(pointer) + " is " + shown(value) +
                                             alternatives(value.is_string() ? value.get<std::string>() : "", words));
  }

  void any_of(const json& schema, const json& value, const std::string& pointer) {
    for (const auto& branch : schema["anyOf"]) {
      const json& candidate = branch.contains("$ref") ? resolve(branch) : branch;
      if (type_fits(candidate, value)) return explain(candidate, value, pointer);
    }
    wrong(schema, value, pointer);
  }

  void text(const json& schema, const json& value, const std::string& pointer) {
    const auto word = value.get<std::string>();
    const bool too_short = schema.contains("minLength") && word.empty();
    if (too_short || (schema.contains("pattern") && !matches(schema["pattern"].get<std::string>(), word)))
      wrong(schema, value, pointer);
  }

  static bool matches(const std::string& pattern, const std::string& word) {
    static std::map<std::string, std::regex> known;
    const auto it = known.try_emplace(pattern, pattern).first;
    return std::regex_search(word, it->second);
  }

  void number(const json& schema, const json& value, const std::string& pointer) {
    const double number = value.get<double>();
    if ((schema.contains("minimum") && number < schema["minimum"].get<double>()) ||
        (schema.contains("maximum") && number > schema["maximum"].get<double>()))
      wrong(schema, value, pointer);
  }

  void list(const json& schema, const json& value, const std::string& pointer) {
    if (schema.contains("minItems") && value.size() < schema["minItems"].get<size_t>())
      return problem(document_.value_at(pointer),
                     place(pointer) + " has " + std::to_string(value.size()) +
                         " entries; wanted: " + schema.value("description", std::string()));
    for (size_t i = 0; i < value.size(); ++i) {
      if (schema.contains("items")) explain(schema["items"], value[i], child(pointer, i));
      if (schema.value("uniqueItems", false) && std::find(value.begin(), value.begin() + static_cast<long>(i),
                                                          value[i]) != value.begin() + static_cast<long>(i))
        problem(document_.value_at(child(pointer, i)), place(pointer) + " names " + shown(value[i]) + " twice");
    }
  }

  void map(const json& schema, const json& value, const std::string& pointer) {
    std::vector<std::string> keys;
    const json properties = schema.value("properties", json::object());
    for (const auto& item : properties.items()) keys.push_back(item.key());
    const json required = schema.value("required", json::array());
    for (const auto& key : required) {
      const auto name = key.get<std::string>();
      if (!value.contains(name) && !document_.broken.contains(child(pointer, name)))
        problem(document_.key_at(pointer), place(pointer) + " lacks " + ticked(name) +
                                               "; wanted: " + description(properties.value(name, json::object())));
    }
    for (const auto& [key, entry] : value.items()) {
      const std::string below = child(pointer, key);
      if (properties.contains(key)) {
        explain(properties[key], entry, below);
        continue;
      }
      const json rest = schema.value("additionalProperties", json(true));
      if (rest.is_boolean() && !rest.get<bool>()) {
        problem(document_.key_at(below),
                "unknown key " + ticked(key) + " in " + place(pointer) + alternatives(key, keys));
        continue;
      }
      if (schema.contains("propertyNames")) name(resolve(schema["propertyNames"]), key, below);
      if (rest.is_object()) explain(rest, entry, below);
    }
  }

  void name(const json& schema, const std::string& key, const std::string& pointer) {
    if (!matches(schema["pattern"].get<std::string>(), key))
      problem(document_.key_at(pointer), ticked(key) + " is no valid id; wanted: " + description(schema));
  }

  std::string description(const json& schema) const {
    const json& target = schema.contains("$ref") ? resolve(schema) : schema;
    return target.value("description", std::string("a value"));
  }

  /// "node `stereo`", "`depth` of input `pair` of node `ego_motion`".
  std::string place(const std::string& pointer) const {
    std::vector<std::string> words;
    for (size_t at = 0; at < pointer.size();) {
      const size_t end = std::min(pointer.find('/', at + 1), pointer.size());
      words.push_back(pointer.substr(at + 1, end - at - 1));
      at = end;
    }
    static constexpr std::array<const char*, kSchemas> kWholes{"the graph", "the schedule", "the scenario",
                                                               "the parameter file", "the machine file"};
    const std::string whole = kWholes[static_cast<size_t>(which_)];
    if (words.empty()) return whole;
    if (words.size() == 1) return ticked(words[0]) + " of " + whole;
    static const std::map<std::string, std::string> kinds{
        {"devices", "device "},     {"profiles", "profile "}, {"subsystems", "subsystem "},
        {"chains", "chain "},       {"modes", "mode "},       {"nodes", "the entry of "},
        {"expect", "expectation "}, {"faults", ""},           {"network", "interface "}};
    if (words[0] == "faults") words[1] = "faults[" + words[1] + "]";
    if (words[0] == "expect" && words[1] == "all" && words.size() > 2) {
      words[1] = "all[" + words[2] + "]";
      words.erase(words.begin() + 2);
    }
    const auto kind = kinds.find(words[0]);
    std::string text = (kind == kinds.end() ? words[0] + " " : kind->second) + ticked(words[1]);
    size_t next = 2;
    if (words[0] == "subsystems" && words.size() > 2 && words[2] != "exports" && words[2] != "spare")
      text = "node " + ticked(words[2]), next = 3;
    for (size_t i = next; i < words.size(); ++i) {
      const bool input = words[i] == "in" && i + 1 < words.size();
      const bool parameter = words[i] == "params" && i + 1 < words.size();
      if (input || parameter) ++i;
      text = (input ? "input " : parameter ? "parameter " : "") + ticked(words[i]) + " of " + text;
    }
    return text;
  }

  const Document& document_;
  Schema which_;
  const json& root_;
  std::vector<Problem>& problems_;
};

bool run_library(const json& value, Schema schema, valijson::ValidationResults* results) {
  valijson::Validator validator(valijson::Validator::kStrongTypes);
  const valijson::adapters::NlohmannJsonAdapter adapter(value);
  return validator.validate(compiled(schema), adapter, results);
}

}  // namespace

bool valid_by_library(const json& value, Schema schema) { return run_library(value, schema, nullptr); }

bool validate(const Document& document, Schema schema, std::vector<Problem>& problems) {
  valijson::ValidationResults results;
  if (run_library(document.root, schema, &results)) return true;
  const size_t before = problems.size();
  Explainer(document, schema, problems).explain(schema_json(schema), document.root, "");
  if (problems.size() > before || !document.broken.empty()) return false;
  // The walk above and valijson disagree: better its words than silence.
  for (const auto& error : results)
    problems.push_back({document.value_at(""), "breaks the schema: " + error.description});
  return false;
}

}  // namespace takt::graph
