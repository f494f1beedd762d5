// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "graph/check/check.hpp"

namespace takt::graph {

std::string nodes_text(const NodeTypes& types) {
  std::string text;
  for (const auto& [name, type] : types.all())
    text += fmt::format("{:<14} {:<11} {}\n", name, to_string(type.layer), type.doc);
  return text;
}

std::string node_text(const NodeType& type) {
  const std::unique_ptr<Node> node = type.make();
  std::string text = fmt::format("{} ({} layer): {}\n", type.name, to_string(type.layer), type.doc);
  for (const InputPort* input : node->inputs())
    text += fmt::format("  in   {:<14} {:<14} {}{}\n", input->name(), input->type().name, input->doc(),
                        input->need() == Need::optional ? " (optional)" : "");
  for (const OutputPort* output : node->outputs())
    text += fmt::format("  out  {:<14} {:<14} {}\n", output->name(), output->type().name, output->doc());
  if (!node->params().empty())
    text += fmt::format("  {:<19} {:>12} {:<5} {:<22} {}\n", "parameter", "default", "unit", "valid", "meaning");
  for (const ParamBase* param : node->params())
    text += fmt::format("  {:<19} {:>12} {:<5} {:<22} {}\n", param->name(), param->value_text(), param->unit(),
                        param->range_text(), param->doc());
  return text;
}

}  // namespace takt::graph
