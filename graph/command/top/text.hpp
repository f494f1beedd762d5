// SPDX-License-Identifier: Apache-2.0
// Text as a terminal shows it: how wide it is, and how it is made to fit without hiding that something is missing.
//
//   Line line{{"stereo", Style::strong}, {" 3 misses", Style::bad}};
//   if (width_of(line) > width) line = fitted(line, width, look);
//
// Widths are columns of the terminal. Pure functions, any thread.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace takt::top {

/// What a piece of text means; the terminal's colours show it where it has some. Nothing is said by colour alone.
enum class Style : uint8_t { plain, strong, faint, good, warning, bad, chosen };

struct Piece {
  std::string text;
  Style style = Style::plain;
};
using Line = std::vector<Piece>;

/// What the terminal can show.
struct Look {
  bool colour = false;
  bool utf8 = false;  ///< else ASCII alone
};

struct Size {
  size_t width = 80, height = 24;
};

/// Columns of text that clean() gave.
size_t width_of(std::string_view text);
size_t width_of(const Line& line);

/// The text without control characters and without characters whose width is unknown; in ASCII without all others, too.
/// Each such character becomes `?`, a line break or tab a blank.
std::string clean(std::string_view text, const Look& look);

/// At most that wide; a text that was cut ends with `…`, in ASCII with `~`.
std::string shortened(std::string_view text, size_t width, const Look& look);
Line fitted(const Line& line, size_t width, const Look& look);

/// Lines of whole words; a word that is wider than a line is split. Lines after the first begin with so many blanks.
std::vector<std::string> wrapped(std::string_view text, size_t width, size_t indent = 0);

/// Blanks before or behind the text, up to that width.
std::string left_aligned(std::string_view text, size_t width);
std::string right_aligned(std::string_view text, size_t width);

}  // namespace takt::top
