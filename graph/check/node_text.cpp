// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <vector>

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

using Row = std::vector<std::string>;

template <class... Cell>
Row row(const Cell&... cells) {
  return {fmt::format("{}", cells)...};
}

/// Rows below one another, their cells in columns: two blanks at least between them, which a reader and a program can
/// tell.
std::string columns(const std::vector<Row>& rows) {
  std::vector<size_t> widths;
  for (const Row& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text;
  for (const Row& row : rows) {
    for (size_t c = 0; c + 1 < row.size(); ++c) text += fmt::format("  {:<{}}", row[c], widths[c]);
    text += fmt::format("  {}\n", row.back());
  }
  return text;
}

}  // namespace

std::string nodes_text(const NodeTypes& types) {
  std::vector<Row> rows;
  for (const auto& [name, type] : types.all()) rows.push_back(row(name, to_string(type.layer), type.doc));
  return "node types\n" + columns(rows);
}

std::string node_text(const NodeType& type) {
  const std::unique_ptr<Node> node = type.make();
  std::vector<Row> ports, params{row("parameter", "default", "unit", "valid", "in a run", "meaning")};
  for (const InputPort* input : node->inputs())
    ports.push_back(row("in", input->name(), input->type().name,
                        fmt::format("{}{}", input->doc(), input->need() == Need::optional ? " (optional)" : "")));
  for (const OutputPort* output : node->outputs())
    ports.push_back(row("out", output->name(), output->type().name,
                        fmt::format("{}{}", output->doc(), stamp_text(*node, *output))));
  for (size_t l = 0; node->levels().size() > 1 && l < node->levels().size(); ++l) {
    const auto& level = node->levels()[l];
    ports.push_back(
        row(fmt::format("level {}", l), level.name, fmt::format("{:g} of the CPU time", level.cost), level.doc));
  }
  for (const ParamBase* param : node->params())
    params.push_back(row(param->name(), param->value_text(), param->unit(), param->range_text(),
                         param->fixed().empty() ? "live" : param->fixed(), param->doc()));
  return fmt::format("{} ({} layer): {}\n", type.name, to_string(type.layer), type.doc) + columns(ports) +
         (params.size() > 1 ? columns(params) : "");
}

std::string devices_text(const hal::DeviceTypes& types) {
  std::vector<Row> rows;
  for (const hal::DeviceKind& kind : types.all()) {
    std::string drivers;
    for (const hal::DriverInfo& driver : kind.drivers)
      drivers += fmt::format("{}{}", drivers.empty() ? "drivers: " : ", ", driver.name);
    rows.push_back(row(kind.name, kind.doc, drivers));
  }
  return "device kinds\n" + columns(rows);
}

std::string device_text(const hal::DeviceKind& kind) {
  std::vector<Row> drivers, settings{row("setting", "driver", "value", "meaning; default")};
  for (const hal::DriverInfo& driver : kind.drivers) drivers.push_back(row("driver", driver.name, driver.doc));
  for (const hal::SettingInfo& setting : kind.settings)
    settings.push_back(row(setting.name, setting.driver.empty() ? "all" : setting.driver, hal::to_text(setting.kind),
                           fmt::format("{}{}", setting.doc, setting.required ? " (required)" : "")));
  return fmt::format("{} (sensor layer): {}\n", kind.name, kind.doc) + columns(drivers) + columns(settings);
}

}  // namespace takt::graph
