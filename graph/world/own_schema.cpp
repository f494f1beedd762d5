// SPDX-License-Identifier: Apache-2.0
#include "graph/world/own_schema.hpp"

#include <algorithm>
#include <cctype>

#include "graph/world/encoder.hpp"
#include "graph/world/schemas.hpp"
#include "rt/msg/scalar.hpp"

namespace takt::world {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }
char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

/// Small letters, digits and single underscores, a letter first.
std::string legal(std::string_view name) {
  std::string made;
  for (const char c : name) {
    if (is_letter(c) || is_digit(c)) made += lower(c);
    else if (!made.empty() && made.back() != '_') made += '_';
  }
  while (!made.empty() && made.back() == '_') made.pop_back();
  return made.empty() || !is_letter(made.front()) ? "field_" + made : made;
}

std::string_view scalar_name(Scalar scalar) {
  constexpr std::byte none[sizeof(uint64_t)]{};
  return visit_scalar(scalar, none, [](auto value) { return number_name<decltype(value)>(); });
}

/// One line: a field must not begin another one.
std::string comment(const Field& field) {
  std::string text(field.unit);
  const size_t scalars = field.element_bytes / scalar_bytes(field.scalar);
  if (field.is_array() && scalars > 1)
    text += (text.empty() ? "" : ", ") + std::to_string(scalars) + " for each element";
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  return text.empty() ? "" : "  # " + text;
}

std::string field_type(const Field& field) {
  if (field.text) return "string";
  std::string type(scalar_name(field.scalar));
  if (field.is_array()) return type + "[]";
  return field.count == 1 ? type : type + "[" + std::to_string(field.count) + "]";
}

void write_field(CdrWriter& to, const Field& field, std::span<const std::byte> piece) {
  if (field.text) return to.text({reinterpret_cast<const char*>(piece.data()), piece.size()});
  const size_t bytes = scalar_bytes(field.scalar), scalars = piece.size() / bytes;
  if (field.is_array()) to.count(scalars);
  to.numbers(piece.data(), scalars, bytes);
}

}  // namespace

std::string own_schema(std::string_view type_name) {
  std::string name;
  bool begins = true;
  for (const char c : type_name) {
    if (is_letter(c) || is_digit(c)) name += begins ? upper(c) : c;
    begins = !is_letter(c) && !is_digit(c);
  }
  return "takt_msgs/msg/" + (name.empty() || !is_letter(name.front()) ? "Type" + name : name);
}

std::vector<std::string> legal_names(std::span<const Field> fields) {
  std::vector<std::string> names{"timestamp"};
  for (const Field& field : fields) {
    const std::string name = legal(field.name);
    std::string free = name;
    for (int i = 2; std::find(names.begin(), names.end(), free) != names.end(); ++i)
      free = name + "_" + std::to_string(i);
    names.push_back(std::move(free));
  }
  names.erase(names.begin());
  return names;
}

std::string own_definition(std::span<const Field> fields) {
  const std::vector<std::string> names = legal_names(fields);
  std::string text = type_text<Time>() + " timestamp\n";
  for (size_t i = 0; i < fields.size(); ++i) text += field_type(fields[i]) + " " + names[i] + comment(fields[i]) + "\n";
  std::vector<std::string_view> named{"takt_msgs"};
  detail::add_used<Time>(named, text);
  return text;
}

void write_own(CdrWriter& to, int64_t stamp_ns, std::span<const Field> fields, const PieceOf& piece_of) {
  write(to, time_of(stamp_ns));
  for (const Field& field : fields) write_field(to, field, piece_of(field));
}

}  // namespace takt::world
