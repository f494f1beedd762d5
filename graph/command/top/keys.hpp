// SPDX-License-Identifier: Apache-2.0
// Keys of `takt top`: from bytes of a terminal to keys, and what a key does to the view. Nothing here touches a
// terminal.
//
//   for (const Key& key : reader.read(bytes)) view = after(view, key, extent);
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace takt::top {

enum class Page : uint8_t { nodes, chains, timeline, devices, processes, log, parameters };
constexpr size_t kPages = 7;

struct Key {
  enum class Kind : uint8_t {
    page,  ///< `number` of it
    next,
    previous,
    up,
    down,
    left,
    right,
    page_up,
    page_down,
    first,
    last,
    help,
    back,
    redraw,
    suspend,
    quit
  };
  Kind kind = Kind::quit;
  size_t number = 0;  ///< of a page, from 0
  bool operator==(const Key&) const = default;
};

/// Takes bytes as they come; a sequence of several bytes may come in parts.
class KeyReader {
 public:
  std::vector<Key> read(std::string_view bytes);
  /// A sequence has begun: after a short while without more bytes call rest().
  bool waiting() const { return !begun_.empty(); }
  /// What has begun is all there is: the Escape key alone.
  std::vector<Key> rest();

 private:
  std::string begun_;
};

/// What is looked at. Page and help scroll on their own.
struct View {
  Page page = Page::nodes;
  bool help = false, ended = false;
  std::array<size_t, kPages> rows{};     ///< of each page so many are scrolled out at the top
  std::array<size_t, kPages> columns{};  ///< of each page so many are scrolled out at the left
  size_t help_rows = 0;
  bool newest = true;  ///< the log shows its end, also when more comes
};

/// How much the page has, and how much of it is on the screen.
struct Extent {
  size_t rows = 0, shown = 0;  ///< rows of the page, places for them
  size_t columns_right = 0;    ///< columns that found no place there
};

/// How many rows may be scrolled out.
size_t most_rows(const Extent& extent);

View after(View view, const Key& key, const Extent& extent);

}  // namespace takt::top
