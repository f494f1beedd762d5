// SPDX-License-Identifier: Apache-2.0
// The list of all message types, for what walks them by name. A file that uses one message includes that one's header.
#pragma once
#include <span>

#include "rt/msg/field.hpp"

namespace takt {

/// Every message type, in an order that does not change: new ones go to the end.
std::span<const MessageType* const> message_types();

}  // namespace takt
