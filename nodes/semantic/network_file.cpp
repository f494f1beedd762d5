// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/network_file.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

#include "rt/file/input_file.hpp"

namespace takt::semantic {
namespace {

using Names = std::vector<std::string>;

constexpr double kLongest_s = 1e6;

class Reader {
 public:
  Reader(const std::string& file, SemanticMap& map) : file_(file), map_(map) {}

  std::vector<std::string> read(const YAML::Node& root) {
    if (!root.IsMap()) {
      fault(root, "not a map of keys; it begins with `takt_network: 1`");
      return problems_;
    }
    only(root, {"takt_network", "attributes", "types", "actions", "objects"});
    if (!root["takt_network"] || text(root["takt_network"]) != "1") fault(root, "`takt_network: 1` is missing");
    each(root, "attributes", [&](const std::string& name, const YAML::Node& at) { read_attribute(name, at); });
    each(root, "types", [&](const std::string& name, const YAML::Node& at) { read_type(name, at); });
    each(root, "actions", [&](const std::string& name, const YAML::Node& at) { read_action(name, at); });
    each(root, "objects", [&](const std::string& name, const YAML::Node& at) { read_object(name, at); });
    return problems_;
  }

 private:
  // What every part needs ---------------------------------------------------------------------------------------------

  void fault(const YAML::Node& at, const std::string& what) {
    const YAML::Mark mark = at.Mark();
    problems_.push_back(
        fmt::format("{}:{}:{}: {}", file_, std::max(mark.line, 0) + 1, std::max(mark.column, 0) + 1, what));
  }
  static std::string text(const YAML::Node& node) { return node.IsScalar() ? node.Scalar() : std::string(); }

  void only(const YAML::Node& map, const Names& known) {
    for (const auto& entry : map)
      if (std::find(known.begin(), known.end(), text(entry.first)) == known.end())
        fault(entry.first, fmt::format("unknown key `{}`; valid are: {}", text(entry.first), fmt::join(known, ", ")));
  }

  /// visit(key, value) for the entries of a map under a key that may be absent; duplicate keys are told.
  template <class Visit>
  void each(const YAML::Node& parent, const char* key, Visit visit) {
    const YAML::Node map = parent[key];
    if (!map || map.IsNull()) return;
    if (!map.IsMap()) return fault(map, fmt::format("`{}` must be a map", key));
    std::set<std::string> seen;
    for (const auto& entry : map) {
      if (!seen.insert(text(entry.first)).second)
        fault(entry.first, fmt::format("duplicate key `{}`", text(entry.first)));
      else visit(text(entry.first), entry.second);
    }
  }

  /// The node of that name and kind; kNoNode after a fault.
  NodeId find(const YAML::Node& at, Kind kind, const std::string& name) {
    const NodeId node = map_.network().find(name);
    if (node != kNoNode && map_.network().kind(node) == kind) return node;
    Names known;
    for (const NodeId other : map_.all(kind)) known.emplace_back(map_.network().name(other));
    if (known.empty()) known.emplace_back("(none)");
    fault(at, fmt::format("there is no {} `{}`; valid are: {}", to_string(kind), name, fmt::join(known, ", ")));
    return kNoNode;
  }

  /// A number with that unit; nothing after a fault.
  std::optional<double> number(const YAML::Node& at, const std::string& unit, double low, double high) {
    const Attribute any{ValueKind::scalar, unit, low, high, {}, false};
    const auto value = parse_value(any, text(at));
    if (value) return std::get<double>(*value);
    fault(at, value.error());
    return std::nullopt;
  }

  void flag(const YAML::Node& parent, const char* key, bool& value) {
    const YAML::Node at = parent[key];
    if (!at) return;
    if (text(at) == "true" || text(at) == "false") value = text(at) == "true";
    else fault(at, fmt::format("`{}` must be true or false", key));
  }

  Value value(const YAML::Node& at, NodeId attribute) {
    std::string words = text(at);
    if (at.IsSequence())
      for (const auto& item : at) words += (words.empty() ? "" : " ") + text(item);
    const auto parsed = parse_value(map_.attribute(attribute), words);
    if (parsed) return *parsed;
    fault(at, fmt::format("`{}`: {}", map_.network().name(attribute), parsed.error()));
    return {};
  }

  void added(const YAML::Node& at, const std::string& name, const tl::expected<NodeId, NetworkError>& node) {
    if (!node) fault(at, fmt::format("`{}`: {}", name, to_string(node.error())));
  }

  // The parts ---------------------------------------------------------------------------------------------------------

  void read_attribute(const std::string& name, const YAML::Node& at) {
    if (!at.IsMap()) return fault(at, fmt::format("`{}` must be a map such as {{kind: boolean}}", name));
    only(at, {"kind", "range", "words", "identity"});
    static const Names kKindNames{"scalar", "boolean", "colour", "enumerated"};
    const std::string kind = at["kind"] ? text(at["kind"]) : "";
    const auto found = std::find(kKindNames.begin(), kKindNames.end(), kind);
    if (found == kKindNames.end())
      return fault(at["kind"] ? at["kind"] : at,
                   fmt::format("`{}` needs a kind; valid are: {}", name, fmt::join(kKindNames, ", ")));
    Attribute attribute;
    attribute.kind = static_cast<ValueKind>(found - kKindNames.begin());
    flag(at, "identity", attribute.identity);
    if (attribute.kind == ValueKind::scalar && !read_range(name, at, attribute)) return;
    if (attribute.kind == ValueKind::enumerated) {
      const YAML::Node words = at["words"];
      if (!words || !words.IsSequence() || words.size() < 2)
        return fault(words ? words : at, fmt::format("`{}` needs at least two words such as [empty, full]", name));
      for (const auto& word : words) attribute.words.push_back(text(word));
    }
    added(at, name, map_.add_attribute(name, std::move(attribute)));
  }

  bool read_range(const std::string& name, const YAML::Node& at, Attribute& attribute) {
    const YAML::Node range = at["range"];
    if (range && range.IsSequence() && range.size() == 2) {
      const std::string high = text(range[1]);
      attribute.unit = high.substr(std::min(high.find_first_not_of("+-.0123456789"), high.size()));
      const auto from = number(range[0], attribute.unit, -1e12, 1e12),
                 to = number(range[1], attribute.unit, -1e12, 1e12);
      if (!from || !to) return false;
      attribute.low = *from, attribute.high = *to;
      if (*from < *to) return true;
    }
    fault(range ? range : at,
          fmt::format("`{}` needs a range of two ascending values of one unit such as [0kg, 20kg]", name));
    return false;
  }

  void read_type(const std::string& name, const YAML::Node& at) {
    const auto type = map_.add_type(name);
    added(at, name, type);
    if (!type || at.IsNull()) return;
    if (!at.IsMap()) return fault(at, fmt::format("`{}` must be a map such as {{attributes: [level]}}", name));
    only(at, {"attributes"});
    const YAML::Node attributes = at["attributes"];
    if (!attributes) return;
    const auto add = [&](const YAML::Node& where, const std::string& attribute, double weight) {
      const NodeId node = find(where, Kind::attribute, attribute);
      if (node == kNoNode) return;
      if (map_.network().connected(*type, node)) return fault(where, fmt::format("`{}` stands there twice", attribute));
      if (const auto done = map_.add_to_type(*type, node, weight); !done)
        fault(where, std::string(to_string(done.error())));
    };
    if (attributes.IsSequence())
      for (const auto& item : attributes) add(item, text(item), 1);
    else
      each(at, "attributes", [&](const std::string& attribute, const YAML::Node& value) {
        if (const auto weight = number(value, "", 0, 1e6)) add(value, attribute, *weight);
      });
  }

  void read_action(const std::string& name, const YAML::Node& at) {
    if (!at.IsMap()) return fault(at, fmt::format("`{}` must be a map of roles, cost, requires and results", name));
    only(at, {"roles", "cost", "requires", "results"});
    Action action;
    each(at, "roles", [&](const std::string& role, const YAML::Node& type) {
      const NodeId node = find(type, Kind::type, text(type));
      if (node != kNoNode) action.roles.push_back({role, node});
    });
    if (action.roles.empty()) return fault(at, fmt::format("`{}` needs a role such as {{target: cup}}", name));
    if (const YAML::Node cost = at["cost"])
      if (const auto seconds = number(cost, "s", 0, kLongest_s)) action.cost_s = *seconds;
    each(at, "requires",
         [&](const std::string& key, const YAML::Node& v) { read_clause(key, v, action, action.required); });
    each(at, "results",
         [&](const std::string& key, const YAML::Node& v) { read_clause(key, v, action, action.results); });
    if (action.results.empty())
      fault(at, fmt::format("`{}` has no results, so nothing is ever done for its sake", name));
    added(at, name, map_.add_action(name, std::move(action)));
  }

  /// "ROLE.ATTRIBUTE: value".
  void read_clause(const std::string& key, const YAML::Node& at, const Action& action, std::vector<Clause>& into) {
    const std::string role = key.substr(0, key.find('.'));
    const auto found =
        std::find_if(action.roles.begin(), action.roles.end(), [&](const Role& r) { return r.name == role; });
    if (found == action.roles.end() || role.size() == key.size()) {
      Names known;
      for (const Role& r : action.roles) known.push_back(r.name + ".ATTRIBUTE");
      return fault(at, fmt::format("`{}` names no attribute of a role; valid are: {}", key, fmt::join(known, ", ")));
    }
    const NodeId attribute = find(at, Kind::attribute, key.substr(role.size() + 1));
    if (attribute == kNoNode) return;
    if (!map_.network().connected(found->type, attribute))
      return fault(at, fmt::format("`{}`: the type {} has no such attribute", key, map_.network().name(found->type)));
    into.push_back({static_cast<uint32_t>(found - action.roles.begin()), attribute, value(at, attribute)});
  }

  void read_object(const std::string& name, const YAML::Node& at) {
    if (!at.IsMap() || !at["type"])
      return fault(at, fmt::format("`{}` must be a map such as {{type: cup, at: [1m, 2m]}}", name));
    only(at, {"type", "at", "states"});
    const NodeId type = find(at["type"], Kind::type, text(at["type"]));
    const YAML::Node place = at["at"];
    if (!place || !place.IsSequence() || place.size() != 2)
      return fault(place ? place : at, fmt::format("`{}` needs a place such as at: [1m, 2m]", name));
    const auto x = number(place[0], "m", -1e6, 1e6), y = number(place[1], "m", -1e6, 1e6);
    if (type == kNoNode || !x || !y) return;
    const auto object = map_.add_object(type, *x, *y, name);
    added(at, name, object);
    if (!object) return;
    map_.object(*object).sightings = 1;  // somebody saw it there once
    map_.object(*object).confidence = 1;
    each(at, "states", [&](const std::string& key, const YAML::Node& v) {
      const NodeId attribute = find(v, Kind::attribute, key);
      if (attribute == kNoNode) return;
      const Value state = value(v, attribute);
      if (known(state) && !map_.set_state(*object, attribute, state))
        fault(v, fmt::format("`{}`: an object has room for {} states", name, kMostStates));
    });
  }

  std::string file_;
  SemanticMap& map_;
  std::vector<std::string> problems_;
};

}  // namespace

tl::expected<void, std::vector<std::string>> parse_network(const std::string& text, const std::string& name,
                                                           SemanticMap& map) {
  std::vector<std::string> problems;
  try {
    problems = Reader(name, map).read(YAML::Load(text));
  } catch (const YAML::Exception& error) {
    problems = {fmt::format("{}:{}:{}: {}", name, std::max(error.mark.line, 0) + 1, std::max(error.mark.column, 0) + 1,
                            error.msg)};
  }
  if (!problems.empty()) return tl::make_unexpected(std::move(problems));
  return {};
}

tl::expected<void, std::vector<std::string>> read_network(const std::filesystem::path& file, SemanticMap& map) {
  if (const std::string why = why_unreadable(file, kLargestText); !why.empty())
    return tl::make_unexpected(std::vector<std::string>{file.string() + ":1:1: " + why});
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return tl::make_unexpected(std::vector<std::string>{file.string() + ":1:1: cannot be read"});
  return parse_network(text, file.string(), map);
}

}  // namespace takt::semantic
