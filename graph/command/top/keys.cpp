// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/keys.hpp"

#include <algorithm>
#include <optional>

namespace takt::top {
namespace {

constexpr char kEscape = '\x1b';
constexpr size_t kLongestSequence = 16;

using Kind = Key::Kind;

std::optional<Key> key_of(char c) {
  if (c >= '1' && c < static_cast<char>('1' + kPages)) return Key{Kind::page, static_cast<size_t>(c - '1')};
  switch (c) {
    case '\t': return Key{Kind::next};
    case 'j': return Key{Kind::down};
    case 'k': return Key{Kind::up};
    case 'h': return Key{Kind::left};
    case 'l': return Key{Kind::right};
    case ' ': return Key{Kind::page_down};
    case 'g': return Key{Kind::first};
    case 'G': return Key{Kind::last};
    case '?': return Key{Kind::help};
    case '\f': return Key{Kind::redraw};
    case '\x1a': return Key{Kind::suspend};
    case '\x03':
    case 'q': return Key{Kind::quit};
    default: return std::nullopt;
  }
}

/// Of a whole sequence `ESC [ parameters final` or `ESC O final`. Parameters after the first say which of Shift, Alt
/// and Control were held: they change nothing.
std::optional<Key> key_of_sequence(std::string_view sequence) {
  switch (sequence.back()) {
    case 'A': return Key{Kind::up};
    case 'B': return Key{Kind::down};
    case 'C': return Key{Kind::right};
    case 'D': return Key{Kind::left};
    case 'H': return Key{Kind::first};
    case 'F': return Key{Kind::last};
    case 'Z': return Key{Kind::previous};
    case '~': break;
    default: return std::nullopt;
  }
  switch (sequence[2]) {
    case '1':
    case '7': return Key{Kind::first};
    case '4':
    case '8': return Key{Kind::last};
    case '5': return Key{Kind::page_up};
    case '6': return Key{Kind::page_down};
    default: return std::nullopt;
  }
}

bool ends_sequence(char c) { return c >= '@' && c <= '~'; }

size_t moved(size_t rows, Kind kind, const Extent& extent) {
  const size_t most = most_rows(extent);
  const size_t leap = std::max<size_t>(extent.shown, 2) - 1;  // one row stays in sight
  rows = std::min(rows, most);
  switch (kind) {
    case Kind::up: return rows - std::min<size_t>(rows, 1);
    case Kind::down: return std::min(rows + 1, most);
    case Kind::page_up: return rows - std::min(rows, leap);
    case Kind::page_down: return std::min(rows + leap, most);
    case Kind::first: return 0;
    case Kind::last: return most;
    default: return rows;
  }
}

void scroll(View& view, Kind kind, const Extent& extent) {
  const auto page = static_cast<size_t>(view.page);
  const bool follows = view.page == Page::log && !view.help;
  size_t& rows = view.help ? view.help_rows : view.rows[page];
  if (follows && view.newest) rows = most_rows(extent);
  rows = moved(rows, kind, extent);
  if (follows) view.newest = rows == most_rows(extent);
}

void open(View& view, size_t page) {
  view.page = static_cast<Page>(page);
  view.help = false;
}

}  // namespace

std::vector<Key> KeyReader::read(std::string_view bytes) {
  std::vector<Key> keys;
  const auto add = [&](std::optional<Key> key) {
    if (key) keys.push_back(*key);
  };
  for (const char c : bytes) {
    if (begun_.empty()) {
      if (c == kEscape) begun_ = c;
      else add(key_of(c));
    } else if (begun_.size() == 1) {
      if (c == '[' || c == 'O') {
        begun_ += c;
        continue;
      }
      add(Key{Kind::back});
      begun_.clear();
      if (c == kEscape) begun_ = c;
      else add(key_of(c));
    } else {
      begun_ += c;
      if (ends_sequence(c)) add(key_of_sequence(begun_));
      if (ends_sequence(c) || begun_.size() > kLongestSequence) begun_.clear();
    }
  }
  return keys;
}

std::vector<Key> KeyReader::rest() {
  const bool escape = begun_.size() == 1;
  begun_.clear();
  return escape ? std::vector<Key>{{Kind::back}} : std::vector<Key>{};
}

size_t most_rows(const Extent& extent) { return extent.rows - std::min(extent.rows, extent.shown); }

View after(View view, const Key& key, const Extent& extent) {
  const auto page = static_cast<size_t>(view.page);
  size_t& columns = view.columns[page];
  switch (key.kind) {
    case Kind::page: open(view, std::min(key.number, kPages - 1)); break;
    case Kind::next: open(view, (page + 1) % kPages); break;
    case Kind::previous: open(view, (page + kPages - 1) % kPages); break;
    case Kind::left: columns -= std::min<size_t>(columns, 1); break;
    case Kind::right: columns += extent.columns_right > 0 && !view.help ? 1 : 0; break;
    case Kind::help:
      view.help = !view.help;
      view.help_rows = 0;
      break;
    case Kind::back: view.help = false; break;
    case Kind::quit: view.ended = true; break;
    case Kind::redraw:
    case Kind::suspend: break;
    default: scroll(view, key.kind, extent);
  }
  return view;
}

}  // namespace takt::top
