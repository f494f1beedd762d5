// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "graph/plugins/description.hpp"

namespace takt::plugin {
namespace {

using Json = nlohmann::json;

/// Writes the types that `before` does not have.
class Writer {
 public:
  explicit Writer(const graph::MessageTypes& known) : known_(known) {}

  Json node(const NodeType& type) {
    const auto node = type.make();
    Json json = ports(*node);
    json.update({{"name", type.name}, {"layer", type.layer}, {"doc", type.doc}});
    json["control"] = node->control() != nullptr;
    json["state"] = node->declares_state();
    json["calls"] = node->allowed_calls(), json["reason"] = node->reason_of_calls();
    json["levels"] = Json::array();
    for (const QualityLevel& level : node->levels())
      json["levels"].push_back({{"name", level.name}, {"cost", level.cost}, {"doc", level.doc}});
    json["params"] = Json::array();
    for (ParamBase* param : node->params()) json["params"].push_back(described(*param, type.name));
    return json;
  }

  Json ports(const Node& node) {
    Json inputs = Json::array(), outputs = Json::array();
    for (const InputPort* input : node.inputs())
      if (input != node.control())
        inputs.push_back({{"name", input->name()},
                          {"doc", input->doc()},
                          {"type", known(input->type())},
                          {"optional", input->need() == Need::optional}});
    for (const OutputPort* output : node.outputs()) {
      Json by = Json::array();
      for (size_t i = 0; i < node.inputs().size(); ++i)
        if (output->stamped_by(*node.inputs()[i])) by.push_back(i);
      if (by.size() == node.inputs().size()) by.clear();  // as without a word
      outputs.push_back(
          {{"name", output->name()}, {"doc", output->doc()}, {"type", known(output->type())}, {"stamped_by", by}});
    }
    return {{"inputs", inputs}, {"outputs", outputs}};
  }

  Json types = Json::array();

 private:
  /// Its name.
  std::string_view known(const MessageType& type) {
    const bool written = std::any_of(types.begin(), types.end(), [&](const Json& t) { return t["name"] == type.name; });
    if (written || known_.contains(type.name)) return type.name;
    Json fields = Json::array();
    for (const Field& f : type.fields)
      fields.push_back({f.name, f.unit, f.scalar, f.offset, f.count, f.element_bytes, f.text});
    types.push_back({{"name", type.name}, {"header_bytes", type.header_bytes}, {"fields", fields}});
    return type.name;
  }

  static bool takes(ParamBase& param, double value) { return param.set(value).has_value(); }

  /// A limit, which its text gives with six digits: the last number that the parameter takes. It takes `inside`.
  static double limit(ParamBase& param, double inside, const std::string& text, double towards) {
    const double said = std::strtod(text.c_str(), nullptr);
    if (!std::isfinite(said) || !takes(param, inside)) return said;
    double outside = std::nextafter(said + std::copysign(std::abs(said) * 1e-5, towards), towards);
    while (std::nextafter(inside, outside) != outside) {
      const double middle = inside + (outside - inside) / 2;
      if (middle == inside || middle == outside) break;
      (takes(param, middle) ? inside : outside) = middle;
    }
    return inside;
  }

  static Json described(ParamBase& param, const std::string& type) {
    Json json{{"name", param.name()}, {"unit", param.unit()}, {"doc", param.doc()}, {"kind", param.kind()}};
    if (!param.fixed().empty()) json["fixed"] = param.fixed();
    const std::string range = param.range_text();
    const size_t dots = range.find("..");
    if (const auto* whole = dynamic_cast<const Param<int>*>(&param)) {
      json["value"] = (*whole)();
      if (!range.empty()) json["range"] = {std::stoi(range), std::stoi(range.substr(dots + 2))};
    } else if (const auto* number = dynamic_cast<const Param<double>*>(&param)) {
      const double value = (*number)();  // numbers as text: JSON has no infinity
      json["value"] = fmt::format("{}", value);
      if (!range.empty())
        json["range"] = {fmt::format("{}", limit(param, value, range.substr(0, dots), -INFINITY)),
                         fmt::format("{}", limit(param, value, range.substr(dots + 2), INFINITY))};
    } else if (const auto* flag = dynamic_cast<const Param<bool>*>(&param)) {
      json["value"] = (*flag)();
    } else if (const auto* text = dynamic_cast<const Param<std::string>*>(&param)) {
      json["value"] = (*text)();
    } else if (const auto* choice = dynamic_cast<const Choice*>(&param)) {
      json["value"] = choice->word();
      json["words"] = Json::array();
      for (size_t from = 0, to = 0; from <= range.size(); from = to + 3) {
        to = std::min(range.find(" | ", from), range.size());
        json["words"].push_back(range.substr(from, to - from));
      }
    } else {
      throw std::invalid_argument(
          fmt::format("parameter {} of {} is no takt::Param and no takt::Choice", param.name(), type));
    }
    return json;
  }

  const graph::MessageTypes& known_;
};

Json described(const hal::SettingInfo& setting) {
  return {{"name", setting.name},         {"driver", setting.driver}, {"kind", setting.kind},
          {"required", setting.required}, {"doc", setting.doc},       {"place", setting.place}};
}

/// Those of one driver; without a name, those of all drivers that the kind itself adds.
Json settings_of(const hal::DeviceKind& kind, std::string_view driver) {
  hal::DeviceTypes bare;
  bare.add({"bare", "", nullptr, {}, {}});
  size_t common = driver.empty() ? bare.all().front().settings.size() : 0;
  Json settings = Json::array();
  for (const hal::SettingInfo& setting : kind.settings)
    if (setting.driver == driver && (common == 0 || common-- == 0)) settings.push_back(described(setting));
  return settings;
}

}  // namespace

std::string describe(const Registry& before, const Registry& after) {
  const graph::MessageTypes known = graph::message_types(before);
  Writer writer(known);
  Json nodes = Json::array(), kinds = Json::array(), drivers = Json::array();
  for (const auto& [name, type] : after.nodes.all())
    if (before.nodes.find(name) == nullptr) nodes.push_back(writer.node(type));
  for (const hal::DeviceKind& kind : after.devices.all()) {
    const hal::DeviceKind* const had = before.devices.find(kind.name);
    if (had == nullptr) {
      kinds.push_back(writer.ports(*kind.shell()));
      kinds.back().update({{"name", kind.name}, {"doc", kind.doc}, {"settings", settings_of(kind, "")}});
    }
    for (const hal::DriverInfo& driver : kind.drivers)
      if (had == nullptr || had->driver(driver.name) == nullptr)
        drivers.push_back({{"kind", kind.name},
                           {"name", driver.name},
                           {"doc", driver.doc},
                           {"sort", driver.sort},
                           {"settings", settings_of(kind, driver.name)}});
  }
  const Json all{{"types", writer.types}, {"nodes", nodes}, {"kinds", kinds}, {"drivers", drivers}};
  return all.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace takt::plugin
