// SPDX-License-Identifier: Apache-2.0
#include "graph/plugins/description.hpp"

#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <utility>

#include "rt/sched/port_access.hpp"

namespace takt::plugin {
namespace {

using Json = nlohmann::json;

/// A text that lives as long as the description does.
std::string_view text(const Json& json, const char* key) { return json.at(key).get_ref<const std::string&>(); }

[[noreturn]] void not_here() { throw std::logic_error("a node that is described only was asked to work"); }

/// A node with the ports of a description, and nothing else.
template <class Base>
class Described : public Base {
 public:
  Described(const Json& json, const graph::MessageTypes& types) {
    for (const Json& input : json.at("inputs"))
      inputs_.emplace_back(this, text(input, "name"), *types.find(text(input, "type"))->second, text(input, "doc"),
                           input.at("optional").get<bool>() ? Need::optional : Need::required);
    for (const Json& output : json.at("outputs")) {
      outputs_.emplace_back(this, text(output, "name"), *types.find(text(output, "type"))->second, text(output, "doc"));
      std::vector<const InputPort*> by;
      for (const size_t input : output.at("stamped_by")) by.push_back(&inputs_.at(input));
      PortAccess::stamped_by(outputs_.back(), std::move(by));
    }
  }
  void setup(Setup&) override { not_here(); }
  void run(Job&) override { not_here(); }

 private:
  std::deque<InputPort> inputs_;
  std::deque<OutputPort> outputs_;
};

class DescribedDevice final : public Described<DeviceNode> {
 public:
  using Described::Described;
  Device& device() override { not_here(); }
};

class DescribedNode final : public Described<Node> {
 public:
  DescribedNode(const Json& json, const graph::MessageTypes& types) : Described(json, types) {
    for (const Json& param : json.at("params")) params_.push_back(make(param));
    std::vector<QualityLevel> levels;
    for (const Json& level : json.at("levels"))
      levels.push_back({text(level, "name"), level.at("cost").get<double>(), text(level, "doc")});
    if (levels.size() == 2) Levels(this, {levels[0], levels[1]});
    if (levels.size() == 3) Levels(this, {levels[0], levels[1], levels[2]});
    if (levels.size() == 4) Levels(this, {levels[0], levels[1], levels[2], levels[3]});
    static_assert(kMaxLevels == 4);
    if (const auto calls = json.at("calls").get<uint32_t>(); calls != 0) may(calls, text(json, "reason"));
    if (json.at("control").get<bool>()) accept_requests();
    if (json.value("state", false)) declare_state();
  }

 private:
  std::unique_ptr<ParamBase> make(const Json& json) {
    const std::string_view kind = text(json, "kind");
    const Json& value = json.at("value");
    const bool ranged = json.contains("range");
    const auto as_number = [](const Json& from) {
      return std::strtod(from.get_ref<const std::string&>().c_str(), nullptr);
    };
    if (kind == "integer")
      return ranged ? param(json, value.get<int>(), Range<int>{json["range"][0], json["range"][1]})
                    : param(json, value.get<int>());
    if (kind == "number")
      return ranged ? param(json, as_number(value),
                            Range<double>{as_number(json["range"][0]), as_number(json["range"][1])})
                    : param(json, as_number(value));
    if (kind == "flag") return param(json, value.get<bool>());
    if (kind == "text") return param(json, value.get<std::string>());
    std::vector<std::string_view> words;
    for (const Json& word : json.at("words")) words.push_back(word.get_ref<const std::string&>());
    return std::make_unique<Choice>(this, text(json, "name"), text(json, "value"), std::move(words), text(json, "doc"),
                                    fixed(json));
  }

  template <class T, class... Ranges>
  std::unique_ptr<ParamBase> param(const Json& json, T value, Ranges... range) {
    return std::make_unique<Param<T>>(this, text(json, "name"), std::move(value), range..., text(json, "unit"),
                                      text(json, "doc"), fixed(json));
  }

  static Fixed fixed(const Json& json) { return json.contains("fixed") ? Fixed{text(json, "fixed")} : Fixed{}; }

  std::vector<std::unique_ptr<ParamBase>> params_;
};

/// Holds the place in NodeTypes, which wants a class.
class Nobody final : public Node {
  void setup(Setup&) override { not_here(); }
  void run(Job&) override { not_here(); }
};

hal::SettingInfo setting(const Json& json) {
  return {text(json, "name"),
          text(json, "driver"),
          json.at("kind").get<hal::SettingKind>(),
          json.at("required").get<bool>(),
          text(json, "doc"),
          json.at("place").get<bool>()};
}

std::vector<hal::SettingInfo> settings(const Json& json) {
  std::vector<hal::SettingInfo> all;
  for (const Json& one : json.at("settings")) all.push_back(setting(one));
  return all;
}

}  // namespace

Descriptions::Descriptions(Registry& registry) : registry_(registry), types_(graph::message_types(registry)) {}

void Descriptions::add(const std::string& text) {
  const Json& all = texts_.emplace_back(Json::parse(text));
  for (const Json& type : all.at("types")) add_type(type);
  for (const Json& node : all.at("nodes")) add_node(node);
  for (const Json& kind : all.at("kinds")) add_kind(kind);
  for (const Json& driver : all.at("drivers")) add_driver(driver);
}

void Descriptions::add_type(const Json& json) {
  if (types_.contains(text(json, "name"))) return;
  OwnType& own = own_.emplace_back();
  for (const Json& f : json.at("fields"))
    own.fields.push_back({f.at(0).get_ref<const std::string&>(), f.at(1).get_ref<const std::string&>(),
                          f.at(2).get<Scalar>(), f.at(3), f.at(4), f.at(5), f.at(6)});
  own.type = {text(json, "name"), json.at("header_bytes"), own.fields, nullptr, nullptr, nullptr, nullptr};
  types_.emplace(own.type.name, &own.type);
}

void Descriptions::add_node(const Json& json) {
  const std::string name(text(json, "name"));
  registry_.nodes.add<Nobody>(name, json.at("layer").get<Layer>(), std::string(text(json, "doc")));
  // The registry is ours, and its node types are no constants; add() has no place for what a maker must know.
  const_cast<NodeType*>(registry_.nodes.find(name))->make = [&json, &types = types_] {
    return std::make_unique<DescribedNode>(json, types);
  };
}

void Descriptions::add_kind(const Json& json) {
  const auto shell = [&json, &types = types_] { return std::make_unique<DescribedDevice>(json, types); };
  registry_.devices.add({text(json, "name"), text(json, "doc"), shell, {}, settings(json)});
}

void Descriptions::add_driver(const Json& json) {
  const auto make = [](const hal::DeviceConfig&, Settings&, hal::Devices&, const takt::Clock&) -> hal::NodeResult {
    not_here();
  };
  registry_.devices.add(text(json, "kind"),
                        {text(json, "name"), text(json, "doc"), make, json.at("sort").get<hal::DriverSort>()},
                        settings(json));
}

}  // namespace takt::plugin
