// SPDX-License-Identifier: Apache-2.0
// The signs to look for: a folder with a list, signs.txt, and the cascades it names.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "nodes/traffic_signs/cascade.hpp"
#include "nodes/traffic_signs/colour_layout.hpp"

namespace takt::traffic_signs {

/// Share of a cascade's window that is left free on every side of the sign.
inline constexpr double kMargin = 1.0 / 12;

struct SignModel {
  std::string name;
  Cascade cascade;
  SignColour colour = SignColour::any;
  double least_share = 0;            ///< of a window's pixels that must have the colour, 0..1
  double width_m = 0, height_m = 0;  ///< nominal, of the sign itself
  ColourLayout layout;
};

/// Reads `folder`/signs.txt and the cascades it names. A line holds
///
///     sign NAME CASCADE COLOUR SHARE WIDTH HEIGHT [LAYOUT]
///
/// (COLOUR any | red | yellow | blue; WIDTH and HEIGHT in metres; LAYOUT a file for read_layout(), not with `any`; the
/// line's place among the signs is the class id of its detections) or nothing; # begins a comment. Throws CascadeError.
std::vector<SignModel> read_signs(const std::filesystem::path& folder);

}  // namespace takt::traffic_signs
