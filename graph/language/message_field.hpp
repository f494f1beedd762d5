// SPDX-License-Identifier: Apache-2.0
// One value of a message whose type is known by its descriptors only.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <variant>

#include "rt/msg/field.hpp"

namespace takt::graph {

struct MessageField {
  enum class Kind : uint8_t { number, text, size };
  Kind kind = Kind::number;
  Field field;
  size_t index = 0;  ///< of a number: which of the field's numbers
  /// Of the value; "" for sizes and texts.
  std::string_view unit() const { return kind == Kind::number ? field.unit : ""; }
};

/// What `name` means in messages of that type: "speed_m_s" a number; "text" a text, whatever separates its words being
/// one space; "boxes" how many elements an array has; "boxes[6]" the 7th number of a list or an array, counted through
/// all its elements. An empty name means the only field of the type. The error says which there are.
tl::expected<MessageField, std::string> find_field(const MessageType& type, std::string_view name);

using FieldValue = std::variant<double, std::string>;

/// Nothing if an array has no such number.
std::optional<FieldValue> value_of(const MessageField& field, const void* message);

}  // namespace takt::graph
