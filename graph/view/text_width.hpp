// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string_view>

namespace takt::view {

/// Upper estimate of the width of UTF-8 text in a sans-serif face, px. DejaVu Sans is the measure: it is what viewers
/// fall back to on Linux and wider than Helvetica or Arial, so that text never leaves its box.
double text_width_px(std::string_view text, double size_px, bool bold = false);

}  // namespace takt::view
