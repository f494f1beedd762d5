// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/screen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "graph/command/top/pages.hpp"

namespace takt::top {
namespace {

constexpr double kSilent_s = 2;  ///< four states have not come

Line spaced(std::vector<Piece> pieces, std::string_view between) {
  Line line;
  for (Piece& piece : pieces) {
    if (!line.empty()) line.push_back({std::string(between), Style::faint});
    line.push_back(std::move(piece));
  }
  return line;
}

/// Pieces one after the other, on as many lines as they need.
std::vector<Line> flowing(const std::vector<Piece>& pieces, std::string_view between, size_t width) {
  std::vector<Line> lines;
  std::vector<Piece> begun;
  for (const Piece& piece : pieces) {
    begun.push_back(piece);
    if (begun.size() < 2 || width_of(spaced(begun, between)) <= width) continue;
    begun.pop_back();
    lines.push_back(spaced(std::exchange(begun, {piece}), between));
  }
  lines.push_back(spaced(begun, between));
  return lines;
}

std::vector<Line> head(const Watched& run, const Window& window) {
  const Look& look = window.look;
  uint64_t misses = 0;
  for (const NodeSeen& node : run.nodes) misses += node.deadline_misses;
  std::vector<Piece> pieces{
      {clean(run.graph, look), Style::strong},
      {clean(run.profile, look)},
      {clean(run.policy, look)},
      {run.heard ? clean(run.mode, look) : "waiting for the run"},
      {duration_text(run.running_s)},
      {fmt::format("{} miss{}", misses, misses == 1 ? "" : "es"), misses > 0 ? Style::bad : Style::good}};
  if (window.silent_s >= kSilent_s)
    pieces.push_back({fmt::format("no news for {:.0f} s", window.silent_s), Style::bad});
  return flowing(pieces, look.utf8 ? " · " : ", ", window.size.width);
}

/// Names where all of them find place, else numbers, and the name of the page that is open.
Line tabs(const View& view, const Window& window) {
  for (const bool named : {true, false}) {
    std::vector<Piece> pieces;
    for (size_t p = 0; p < kPages; ++p) {
      const bool open = !view.help && p == static_cast<size_t>(view.page);
      std::string text = fmt::format("{}", p + 1);
      if (named || open) text += fmt::format(" {}", name_of(static_cast<Page>(p)));
      pieces.push_back(open ? Piece{"[" + text + "]", Style::chosen} : Piece{text, Style::plain});
    }
    pieces.push_back(view.help ? Piece{"[? help]", Style::chosen} : Piece{named ? "? help" : "?", Style::plain});
    Line line = spaced(pieces, " ");
    if (!named || width_of(line) <= window.size.width) return line;
  }
  return {};
}

/// Where one is, and what is out of sight.
Line foot(const Content& page, const Extent& extent, size_t first, const Window& window) {
  std::vector<Piece> pieces;
  const size_t last = std::min(first + extent.shown, extent.rows);
  if (last - first < extent.rows)
    pieces.push_back({fmt::format("{}-{} of {}", first + 1, last, extent.rows), Style::faint});
  if (page.left > 0) pieces.push_back({fmt::format("< {}", page.left), Style::chosen});
  if (page.right > 0) pieces.push_back({fmt::format("{} >", page.right), Style::chosen});
  for (const char* words : {"q ends", "? help", "@ device", "! above its limit"}) {
    pieces.push_back({words, Style::faint});
    if (width_of(spaced(pieces, "  ")) > window.size.width) pieces.pop_back();
  }
  return spaced(pieces, "  ");
}

size_t first_row(const View& view, const Extent& extent) {
  const size_t most = most_rows(extent);
  if (view.help) return std::min(view.help_rows, most);
  if (view.page == Page::log && view.newest) return most;
  return std::min(view.rows[static_cast<size_t>(view.page)], most);
}

}  // namespace

std::string duration_text(double seconds) {
  if (seconds < 60) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<int64_t>(seconds);
  return whole < 3600 ? fmt::format("{}:{:02}", whole / 60, whole % 60)
                      : fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

Screen screen_of(const Watched& run, const View& view, const Window& window) {
  const auto [width, height] = window.size;
  const Fit fit{width, view.columns[static_cast<size_t>(view.page)], window.look};
  const Content page = view.help ? help_page(fit) : content(run, view.page, fit);
  Screen screen;
  screen.lines = head(run, window);
  screen.lines.push_back(tabs(view, window));
  screen.lines.insert(screen.lines.end(), page.head.begin(), page.head.end());
  const size_t fixed = screen.lines.size() + 1;
  screen.extent = {page.rows.size(), height > fixed ? height - fixed : 1, page.right};
  const size_t first = first_row(view, screen.extent);
  for (size_t r = 0; r < screen.extent.shown; ++r)
    screen.lines.push_back(first + r < page.rows.size() ? page.rows[first + r] : Line{});
  screen.lines.push_back(foot(page, screen.extent, first, window));
  if (screen.lines.size() > height) screen.lines.resize(height);
  for (Line& line : screen.lines) line = fitted(line, width, window.look);
  return screen;
}

}  // namespace takt::top
