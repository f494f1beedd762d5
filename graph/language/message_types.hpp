// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <string>

#include "graph/language/registry.hpp"

namespace takt::graph {

/// By its name.
using MessageTypes = std::map<std::string, const MessageType*, std::less<>>;

/// Every message type that a node type or device kind of the registry has a port for. No list: a type is known once
/// something speaks it. Makes a node of each type. The registry must outlive the result.
MessageTypes message_types(const Registry& registry);

}  // namespace takt::graph
