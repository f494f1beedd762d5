// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/point.hpp>: core, stable.
#pragma once
#include <cstdint>

namespace takt {

/// A point of a cloud, in metres, and the colour of one. Algorithms on clouds need these and no message.
struct Point {
  using scalar = float;
  float x, y, z;
};
struct Colour {
  using scalar = uint8_t;
  uint8_t b, g, r;
};

}  // namespace takt
