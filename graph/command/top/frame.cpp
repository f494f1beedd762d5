// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/frame.hpp"

#include <fmt/format.h>

#include <utility>

namespace takt::top {
namespace {

/// Select Graphic Rendition of ECMA-48.
const char* rendition(Style style) {
  switch (style) {
    case Style::plain: return "";
    case Style::strong: return "\x1b[1m";
    case Style::faint: return "\x1b[2m";
    case Style::good: return "\x1b[32m";
    case Style::warning: return "\x1b[33m";
    case Style::bad: return "\x1b[31m";
    case Style::chosen: return "\x1b[7m";
  }
  return "";
}

std::string bytes_of(const Line& line, const Look& look) {
  std::string bytes;
  for (const Piece& piece : line) {
    const bool styled = look.colour && piece.style != Style::plain && !piece.text.empty();
    bytes += styled ? rendition(piece.style) + piece.text + "\x1b[0m" : piece.text;
  }
  return bytes;
}

}  // namespace

std::string Frame::difference(const std::vector<Line>& lines, const Size& size, const Look& look) {
  const bool all = !known_ || size.width != size_.width || size.height != size_.height;
  if (all) shown_.clear();
  std::string bytes = all ? "\x1b[H\x1b[2J" : "";
  std::vector<std::string> now;
  for (const Line& line : lines) {
    const size_t row = now.size();
    now.push_back(bytes_of(line, look));
    if (row < shown_.size() ? shown_[row] == now[row] : now[row].empty()) continue;
    bytes += fmt::format("\x1b[{};1H{}", row + 1, now[row]);
    // Not behind the last column: some terminals would clear that one.
    if (!all && width_of(line) < size.width) bytes += "\x1b[K";
  }
  for (size_t row = now.size(); row < shown_.size(); ++row) bytes += fmt::format("\x1b[{};1H\x1b[K", row + 1);
  shown_ = std::move(now);
  size_ = size;
  known_ = true;
  return bytes;
}

}  // namespace takt::top
