// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/settings/json.hpp"
#include "rt/msg/field.hpp"

namespace takt::attach {

/// A message as one JSON object by its field descriptors: scalars as numbers, texts as text, of longer arrays the size
/// and the first `items` elements.
nlohmann::ordered_json message_json(const MessageType& type, const void* message, size_t items = 8);

}  // namespace takt::attach
