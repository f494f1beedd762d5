// SPDX-License-Identifier: Apache-2.0
#include "graph/view/markup.hpp"

#include <cstdint>

namespace takt::view {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD

/// Bytes of the well-formed UTF-8 character (RFC 3629) at the front of `text`, 0 if there is none or XML forbids it.
size_t character_bytes(std::string_view text) {
  const auto at = [&](size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const uint32_t first = at(0);
  const size_t size = first < 0x80 ? 1 : (first >> 5U) == 6 ? 2 : (first >> 4U) == 14 ? 3 : (first >> 3U) == 30 ? 4 : 0;
  if (size == 0) return 0;
  if (size == 1) return first >= 32 || first == '\n' || first == '\t' ? 1 : 0;
  uint32_t code = first & (0x7FU >> size);
  for (size_t i = 1; i < size; ++i) {
    if ((at(i) & 0xC0U) != 0x80U) return 0;
    code = (code << 6U) | (at(i) & 0x3FU);
  }
  const uint32_t lowest = size == 2 ? 0x80 : size == 3 ? 0x800 : 0x10000;
  const bool surrogate = code >= 0xD800 && code < 0xE000;
  return code < lowest || surrogate || code > 0x10FFFF || code == 0xFFFE || code == 0xFFFF ? 0 : size;
}

}  // namespace

std::string escape(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const size_t size = character_bytes(text);
    if (size == 0) result += kReplacement;
    else if (text[0] == '&') result += "&amp;";
    else if (text[0] == '<') result += "&lt;";
    else if (text[0] == '>') result += "&gt;";
    else if (text[0] == '"') result += "&quot;";
    else if (text[0] == '\'') result += "&#39;";
    else result += text.substr(0, size);
    text.remove_prefix(size == 0 ? 1 : size);
  }
  return result;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto byte = [&](size_t i) {
    return i < bytes.size() ? static_cast<uint32_t>(static_cast<uint8_t>(bytes[i])) : 0U;
  };
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const uint32_t three = byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
    for (const uint32_t shift : {18U, 12U, 6U, 0U}) text += alphabet[three >> shift & 63U];
    for (size_t missing = i + 3; missing > bytes.size(); --missing) text[text.size() - (missing - bytes.size())] = '=';
  }
  return text;
}

}  // namespace takt::view
