// SPDX-License-Identifier: Apache-2.0
#include "graph/view/text_width.hpp"

#include <array>
#include <cstdint>

namespace takt::view {
namespace {

// Advance widths of DejaVu Sans for the characters 32 to 126, in hundredths of the font size, rounded up.
constexpr std::array<uint8_t, 95> kRegular{32, 41, 46, 84, 64, 96, 78, 28, 40, 40, 50, 84, 32, 37,  32, 34, 64, 64, 64,
                                           64, 64, 64, 64, 64, 64, 64, 34, 34, 84, 84, 84, 54, 100, 69, 69, 70, 78, 64,
                                           58, 78, 76, 30, 30, 66, 56, 87, 75, 79, 61, 79, 70, 64,  62, 74, 69, 99, 69,
                                           62, 69, 40, 34, 40, 84, 50, 50, 62, 64, 55, 64, 62, 36,  64, 64, 28, 28, 58,
                                           28, 98, 64, 62, 64, 64, 42, 53, 40, 64, 60, 82, 60, 60,  53, 64, 34, 64, 84};
constexpr double kBold = 1.15;   // bold letters of the face are at most this much wider
constexpr double kOther = 1.05;  // widest of the other characters, in font sizes

}  // namespace

double text_width_px(std::string_view text, double size_px, bool bold) {
  double width = 0;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 32 && byte < 127) width += kRegular[byte - 32U] / 100.0 * (bold ? kBold : 1.0);
    else if ((byte & 0xC0U) != 0x80U) width += kOther;  // the first byte of any other character
  }
  return width * size_px;
}

}  // namespace takt::view
