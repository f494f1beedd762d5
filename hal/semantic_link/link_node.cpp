// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/link_node.hpp"

namespace takt::semantic_link {

void LinkNode::say(Output<TextStatus>& output, int64_t stamp_ns) {
  TextStatus* message = output.loan();
  if (message == nullptr) return;
  message->text.resize(kLine);
  message->text.resize(device_->describe(message->text.items()));
  output.send(stamp_ns);
}

}  // namespace takt::semantic_link
