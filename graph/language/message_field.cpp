// SPDX-License-Identifier: Apache-2.0
#include "graph/language/message_field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <vector>

#include "graph/language/words.hpp"
#include "rt/msg/scalar.hpp"

namespace takt::graph {
namespace {

bool is_list(const Field& field) { return field.is_array() || field.count > 1; }

/// Descriptors tell characters from other bytes by the unit alone: flags and texts have none.
bool is_text(const Field& field) { return is_list(field) && field.scalar == Scalar::u8 && field.unit.empty(); }

std::vector<std::string> names_of(const MessageType& type) {
  std::vector<std::string> names;
  for (const Field& field : type.fields) {
    const bool numbers = is_list(field) && !is_text(field);
    if (!numbers || field.is_array()) names.emplace_back(field.name);
    if (numbers) names.push_back(std::string(field.name) + "[i]");
  }
  return names;
}

/// The bytes of a text without what only fills it up.
std::string words_of(const std::byte* at, size_t count) {
  std::string words;
  bool gap = false;
  for (size_t i = 0; i < count; ++i) {
    const auto c = static_cast<unsigned char>(at[i]);
    const bool separates = c <= ' ' || c == 0x7f;
    if (!separates && gap && !words.empty()) words += ' ';
    if (!separates) words += static_cast<char>(c);
    gap = separates;
  }
  return words;
}

}  // namespace

tl::expected<MessageField, std::string> find_field(const MessageType& type, std::string_view name) {
  const size_t bracket = name.find('[');
  const std::string_view word = name.substr(0, bracket);
  const auto found = std::find_if(type.fields.begin(), type.fields.end(), [&](const Field& field) {
    return field.name == word || (name.empty() && type.fields.size() == 1);
  });
  const std::string valid = alternatives(word, names_of(type), "fields of " + ticked(type.name));
  if (found == type.fields.end()) {
    const std::string what = name.empty() ? "which of its fields is meant must be said as `field`"
                                          : fmt::format("it has no field {}", ticked(name));
    return tl::make_unexpected(what + valid);
  }
  MessageField result{MessageField::Kind::number, *found, 0};
  if (bracket == std::string_view::npos) {
    if (is_text(*found)) result.kind = MessageField::Kind::text;
    else if (found->is_array()) result.kind = MessageField::Kind::size;
    else if (found->count > 1)
      return tl::make_unexpected(fmt::format("{} is a list; write {}[0] to {}[{}] for one of its numbers", ticked(name),
                                             name, name, found->count - 1));
    return result;
  }
  if (!is_list(*found) || is_text(*found))
    return tl::make_unexpected(fmt::format("{} is no list of numbers{}", ticked(word), valid));
  const std::string_view digits = name.substr(bracket + 1, name.size() - bracket - 2);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), result.index);
  if (error != std::errc{} || end != digits.data() + digits.size() || name.back() != ']' ||
      (!found->is_array() && result.index >= found->count))
    return tl::make_unexpected(fmt::format("{} has no number {}{}", ticked(word), ticked(name.substr(bracket)), valid));
  return result;
}

std::optional<FieldValue> value_of(const MessageField& wanted, const void* message) {
  const Field& field = wanted.field;
  const auto* at = static_cast<const std::byte*>(message) + field.offset;
  size_t bytes = size_t{field.count} * field.element_bytes;
  if (field.is_array()) {
    const Array<std::byte>& array = any_array(at);
    if (wanted.kind == MessageField::Kind::size) return static_cast<double>(array.size);
    at = array.data();
    bytes = size_t{array.size} * field.element_bytes;
  }
  if (wanted.kind == MessageField::Kind::text) return words_of(at, bytes);
  const size_t each = scalar_bytes(field.scalar);
  if ((wanted.index + 1) * each > bytes) return std::nullopt;
  return visit_scalar(field.scalar, at + wanted.index * each, [](auto value) { return static_cast<double>(value); });
}

}  // namespace takt::graph
