// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "graph/check/check.hpp"

namespace takt::graph {
namespace {

/// Whose stamps an output sends, where that is not those of all inputs.
std::string stamp_text(const Node& node, const OutputPort& output) {
  std::string names;
  bool all = true;
  for (const InputPort* input : node.inputs()) {
    if (output.stamped_by(*input)) names += fmt::format("{}{}", names.empty() ? "" : ", ", input->name());
    else all = false;
  }
  return all ? "" : " (stamps of " + names + ")";
}

}  // namespace

std::string nodes_text(const NodeTypes& types) {
  std::string text = "node types\n";
  for (const auto& [name, type] : types.all())
    text += fmt::format("  {:<14} {:<11} {}\n", name, to_string(type.layer), type.doc);
  return text;
}

std::string node_text(const NodeType& type) {
  const std::unique_ptr<Node> node = type.make();
  std::string text = fmt::format("{} ({} layer): {}\n", type.name, to_string(type.layer), type.doc);
  for (const InputPort* input : node->inputs())
    text += fmt::format("  in   {:<14} {:<14} {}{}\n", input->name(), input->type().name, input->doc(),
                        input->need() == Need::optional ? " (optional)" : "");
  for (const OutputPort* output : node->outputs())
    text += fmt::format("  out  {:<14} {:<14} {}{}\n", output->name(), output->type().name, output->doc(),
                        stamp_text(*node, *output));
  if (node->levels().size() > 1)
    for (size_t l = 0; l < node->levels().size(); ++l)
      text += fmt::format("  level {:<12} {:<14} {} (about {:g} of the CPU time)\n", l, node->levels()[l].name,
                          node->levels()[l].doc, node->levels()[l].cost);
  if (!node->params().empty())
    text += fmt::format("  {:<19} {:>12} {:<5} {:<22} {}\n", "parameter", "default", "unit", "valid", "meaning");
  for (const ParamBase* param : node->params())
    text += fmt::format("  {:<19} {:>12} {:<5} {:<22} {}\n", param->name(), param->value_text(), param->unit(),
                        param->range_text(), param->doc());
  return text;
}

std::string devices_text(const hal::DeviceTypes& types) {
  std::string text = "device kinds\n";
  for (const hal::DeviceKind& kind : types.all()) {
    std::string drivers;
    for (const hal::DriverInfo& driver : kind.drivers)
      drivers += fmt::format("{}{}", drivers.empty() ? "" : ", ", driver.name);
    text += fmt::format("  {:<14} {:<34} drivers: {}\n", kind.name, kind.doc, drivers);
  }
  return text;
}

std::string device_text(const hal::DeviceKind& kind) {
  std::string text = fmt::format("{} (sensor layer): {}\n", kind.name, kind.doc);
  for (const hal::DriverInfo& driver : kind.drivers)
    text += fmt::format("  driver {:<12} {}\n", driver.name, driver.doc);
  text += fmt::format("  {:<22} {:<10} {:<24} {}\n", "setting", "driver", "value", "meaning; default");
  for (const hal::SettingInfo& setting : kind.settings)
    text += fmt::format("  {:<22} {:<10} {:<24} {}{}\n", setting.name, setting.driver.empty() ? "all" : setting.driver,
                        hal::to_text(setting.kind), setting.doc, setting.required ? " (required)" : "");
  return text;
}

}  // namespace takt::graph
