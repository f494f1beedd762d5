// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/text.hpp"

#include <algorithm>
#include <array>

namespace takt::top {
namespace {

struct Character {
  char32_t code = 0;
  size_t bytes = 1;
  bool sound = false;  ///< well-formed UTF-8
};

Character first_of(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return {lead, 1, true};
  const size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  char32_t code = lead & (0xFFU >> (bytes + 1));
  for (size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return {};
    code = code << 6 | (byte(i) & 0x3FU);
  }
  constexpr std::array<char32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast[bytes] || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) return {};
  return {code, bytes, true};
}

struct Range {
  char32_t from, to;
};

bool within(char32_t code, const auto& ranges) {
  return std::any_of(ranges.begin(), ranges.end(), [&](const Range& r) { return code >= r.from && code <= r.to; });
}

/// 0: unknown, or none of its own, such as marks that stand above the letter before them.
size_t columns(char32_t code) {
  static constexpr std::array<Range, 7> kOne{
      {{0x20, 0x7E}, {0xA0, 0xAC}, {0xAE, 0x2FF}, {0x370, 0x482}, {0x48A, 0x52F}, {0x1E00, 0x1FFF}, {0x2010, 0x2027}}};
  static constexpr std::array<Range, 4> kSigns{
      {{0x2030, 0x205E}, {0x20A0, 0x20BF}, {0x2190, 0x2319}, {0x2500, 0x25FC}}};
  static constexpr std::array<Range, 6> kTwo{
      {{0x3001, 0x3029}, {0x3041, 0x3096}, {0x30A1, 0x30FA}, {0x4E00, 0x9FFF}, {0xAC00, 0xD7A3}, {0xFF01, 0xFF60}}};
  return within(code, kOne) || within(code, kSigns) ? 1 : within(code, kTwo) ? 2 : 0;
}

/// Bytes of the longest beginning that is at most that wide.
size_t bytes_within(std::string_view text, size_t width) {
  size_t used = 0, at = 0;
  while (at < text.size()) {
    const Character next = first_of(text.substr(at));
    used += columns(next.code);
    if (used > width) break;
    at += next.bytes;
  }
  return at;
}

}  // namespace

size_t width_of(std::string_view text) {
  size_t width = 0;
  for (size_t at = 0; at < text.size();) {
    const Character next = first_of(text.substr(at));
    width += columns(next.code);
    at += next.bytes;
  }
  return width;
}

size_t width_of(const Line& line) {
  size_t width = 0;
  for (const Piece& piece : line) width += width_of(piece.text);
  return width;
}

std::string clean(std::string_view text, const Look& look) {
  std::string result;
  for (size_t at = 0; at < text.size();) {
    const Character next = first_of(text.substr(at));
    const bool blank = next.code == '\n' || next.code == '\t' || next.code == '\r';
    const bool shown = next.sound && columns(next.code) > 0 && (look.utf8 || next.code < 0x80);
    if (blank) result += ' ';
    else if (shown) result += text.substr(at, next.bytes);
    else result += '?';
    at += next.bytes;
  }
  return result;
}

std::string shortened(std::string_view text, size_t width, const Look& look) {
  if (width_of(text) <= width) return std::string(text);
  if (width == 0) return "";
  return std::string(text.substr(0, bytes_within(text, width - 1))) + (look.utf8 ? "…" : "~");
}

Line fitted(const Line& line, size_t width, const Look& look) {
  if (width_of(line) <= width) return line;
  Line result;
  for (size_t left = width; const Piece& piece : line) {
    const size_t wide = width_of(piece.text);
    // One column stays for the sign, since more follows.
    const bool last = wide >= left;
    result.push_back({last ? shortened(piece.text + "  ", left, look) : piece.text, piece.style});
    if (last) break;
    left -= wide;
  }
  return result;
}

std::vector<std::string> wrapped(std::string_view text, size_t width, size_t indent) {
  width = std::max<size_t>(width, 2);
  if (indent + 2 > width) indent = 0;
  std::vector<std::string> lines{""};
  size_t used = 0;
  const auto next_line = [&] {
    lines.emplace_back(indent, ' ');
    used = indent;
  };
  bool begun = false;  // the line has a word
  for (size_t at = 0; at < text.size();) {
    const size_t blank = std::min(text.find(' ', at), text.size());
    std::string_view word = text.substr(at, blank - at);
    at = blank + 1;
    if (begun && used + 1 + width_of(word) > width) next_line(), begun = false;
    if (begun) lines.back() += ' ', ++used;
    while (used + width_of(word) > width) {
      const size_t fits = std::max<size_t>(bytes_within(word, width - used), 1);
      lines.back() += word.substr(0, fits);
      word.remove_prefix(fits);
      next_line();
    }
    lines.back() += word;
    used += width_of(word);
    begun = true;
  }
  return lines;
}

std::string left_aligned(std::string_view text, size_t width) {
  const size_t wide = width_of(text);
  return std::string(text) + std::string(wide < width ? width - wide : 0, ' ');
}

std::string right_aligned(std::string_view text, size_t width) {
  const size_t wide = width_of(text);
  return std::string(wide < width ? width - wide : 0, ' ') + std::string(text);
}

}  // namespace takt::top
