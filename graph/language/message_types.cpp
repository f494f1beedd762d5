// SPDX-License-Identifier: Apache-2.0
#include "graph/language/message_types.hpp"

namespace takt::graph {

MessageTypes message_types(const Registry& registry) {
  MessageTypes types;
  const auto add = [&](const Node& node) {
    for (const InputPort* input : node.inputs()) types.emplace(input->type().name, &input->type());
    for (const OutputPort* output : node.outputs()) types.emplace(output->type().name, &output->type());
  };
  for (const auto& [name, type] : registry.nodes.all()) add(*type.make());
  for (const hal::DeviceKind& kind : registry.devices.all()) add(*kind.shell());
  return types;
}

}  // namespace takt::graph
