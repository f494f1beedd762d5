// SPDX-License-Identifier: Apache-2.0
#include "rt/trace/ftrace_page.hpp"

#include <algorithm>
#include <charconv>

namespace takt::trace {
namespace {

/// The number right after `key` in `text`.
std::optional<size_t> number_after(std::string_view text, std::string_view key) {
  size_t at = text.find(key);
  if (at == std::string_view::npos) return std::nullopt;
  at += key.size();
  while (at < text.size() && text[at] == ' ') ++at;
  size_t value = 0;
  const auto [end, error] = std::from_chars(text.data() + at, text.data() + text.size(), value);
  return error == std::errc() ? std::optional(value) : std::nullopt;
}

}  // namespace

std::optional<Field> find_field(std::string_view format, std::string_view name) {
  while (!format.empty()) {
    const size_t newline = std::min(format.find('\n'), format.size());
    const std::string_view line = format.substr(0, newline);
    format.remove_prefix(std::min(newline + 1, format.size()));
    // "	field:char prev_comm[16];	offset:8;	size:16;	signed:0;"
    const size_t semicolon = line.find(';');
    if (line.find("field:") == std::string_view::npos || semicolon == std::string_view::npos) continue;
    std::string_view declared = line.substr(0, semicolon);
    declared = declared.substr(0, std::min(declared.find('['), declared.size()));
    if (!declared.ends_with(name) || declared.size() == name.size() ||
        declared[declared.size() - name.size() - 1] != ' ')
      continue;
    const auto offset = number_after(line, "offset:"), size = number_after(line, "size:");
    if (offset && size) return Field{*offset, *size};
  }
  return std::nullopt;
}

std::optional<uint16_t> find_id(std::string_view format) {
  const auto id = number_after(format, "ID:");
  return id && *id <= UINT16_MAX ? std::optional(static_cast<uint16_t>(*id)) : std::nullopt;
}

int64_t read_field(std::span<const std::byte> record, Field field) {
  if (field.offset + field.size > record.size()) return 0;
  const auto read = [&](auto value) {
    std::memcpy(&value, record.data() + field.offset, sizeof value);
    return static_cast<int64_t>(value);
  };
  switch (field.size) {
    case 1: return read(int8_t{});
    case 2: return read(int16_t{});
    case 4: return read(int32_t{});
    case 8: return read(int64_t{});
    default: return 0;
  }
}

std::string_view read_text(std::span<const std::byte> record, Field field) {
  if (field.offset + field.size > record.size()) return {};
  const std::string_view all(reinterpret_cast<const char*>(record.data()) + field.offset, field.size);
  return all.substr(0, std::min(all.find('\0'), all.size()));
}

}  // namespace takt::trace
