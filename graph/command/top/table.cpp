// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/table.hpp"

#include <algorithm>

namespace takt::top {
namespace {

constexpr size_t kShortestWords = 8;
constexpr size_t kLeastForName = 12;

size_t natural_width(const Table& table, size_t column) {
  size_t width = width_of(table.columns[column].title);
  for (const auto& row : table.rows) width = std::max(width, width_of(row[column].text));
  return width;
}

struct Place {
  size_t column, width;
  bool cut = false;
};

/// Those that find place behind the name, and the widths they get.
std::vector<Place> places(const Table& table, size_t width, size_t shift) {
  std::vector<Place> shown{{0, std::min({natural_width(table, 0), std::max(kLeastForName, width / 4), width})}};
  size_t used = shown[0].width;
  for (size_t c = 1 + shift; c < table.columns.size(); ++c) {
    const size_t wanted = natural_width(table, c);
    const size_t left = width > used + 1 ? width - used - 1 : 0;
    const bool shortened = table.columns[c].words && left >= kShortestWords;
    if (wanted > left && !shortened) break;
    shown.push_back({c, std::min(wanted, left), wanted > left});
    used += 1 + shown.back().width;
  }
  return shown;
}

}  // namespace

LaidOut lay_out(const Table& table, size_t width, size_t shift, const Look& look) {
  LaidOut laid;
  laid.left = std::min(shift, table.columns.size() - 1);
  const std::vector<Place> shown = places(table, width, laid.left);
  laid.right = table.columns.size() - shown.size() - laid.left;
  if (shown.size() > 2 && shown.back().cut) ++laid.right;  // further to the left there is more room for it
  const auto add = [&](Line& line, const Place& place, const Piece& piece) {
    const bool words = place.column == 0 || table.columns[place.column].words;
    const std::string text = shortened(piece.text, place.width, look);
    if (!line.empty()) line.push_back({" ", Style::plain});
    line.push_back({words ? left_aligned(text, place.width) : right_aligned(text, place.width), piece.style});
  };
  for (const Place& place : shown) add(laid.header, place, {table.columns[place.column].title, Style::faint});
  for (const auto& row : table.rows) {
    Line& line = laid.rows.emplace_back();
    for (const Place& place : shown) add(line, place, row[place.column]);
  }
  return laid;
}

}  // namespace takt::top
