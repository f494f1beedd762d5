// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "hal/settings/json.hpp"
#include "rt/msg/field.hpp"

namespace takt::attach {

/// A message as one JSON object by its field descriptors: scalars as numbers, texts as text, of longer arrays the size
/// and the first `items` elements.
nlohmann::ordered_json message_json(const MessageType& type, const void* message, size_t items = 8);

/// The same of a message as a record holds it (rt/record/packed_message.hpp). Error: it is cut off or too long.
tl::expected<nlohmann::ordered_json, std::string> packed_json(std::span<const Field> fields,
                                                              std::span<const std::byte> packed, size_t items = 8);

}  // namespace takt::attach
