// SPDX-License-Identifier: Apache-2.0
// The colour layout of a sign from its drawings.
#pragma once
#include "nodes/traffic_signs/colour_layout.hpp"
#include "nodes/traffic_signs/sign_drawing.hpp"

namespace takt::traffic_signs {

/// About 120 cells. Those that have the sign's colour in at least 65 % of the drawings are coloured, those that have it
/// in at most 25 % are plain; drawings of 20 to 100 px, so that letters are neither. The ground behind has the sign's
/// colour in half of the drawings, so that cells beside it are neither. Equal arguments give equal layouts; empty for a
/// sign of `any` colour.
ColourLayout learn_layout(SignClass sign, uint64_t seed);

}  // namespace takt::traffic_signs
