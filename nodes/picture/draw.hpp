// SPDX-License-Identifier: Apache-2.0
// Pictures of results as BGR images. Pure functions on plain data; the caller owns all memory.
#pragma once
#include <cstdint>
#include <span>

#include "rt/msg/ace/detections.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/point.hpp"

namespace takt::picture {

using Bgr = ImageView<uint8_t>;  ///< 3 channels

/// Blue for far (0) over green to red for near (1); clamped.
Colour heat(double share);

/// Disparity 0 .. disparities - 1 from blue to red, negative black. `out` has the size of `map`.
void draw_disparity(ImageView<const int16_t> map, int disparities, Bgr out);

/// Cells as squares of `scale` px, row 0 at the bottom (y forward is up): unknown grey, free white, occupied black,
/// values between on the way. `out` is scale times the grid's size.
void draw_grid(ImageView<const int16_t> cells, int scale, Bgr out);

/// An image of one or three channels in colour. `out` has its size.
void draw_image(ImageView<const uint8_t> image, Bgr out);

/// Over an image of the mask's size: what is not 0 in the mask turns half green, and its border all green.
void draw_mask(ImageView<const uint8_t> mask, Bgr out);

/// Over an image: each detection's box in a colour of its class, and the class number in its upper left corner.
void draw_detections(std::span<const Detection> boxes, Bgr out);

/// A point of a path seen from above, m.
struct TrackPoint {
  double right_m = 0, forward_m = 0;
  bool measured = true;
};

/// The path from above, forward up, scaled to fit, on a metre grid; points that were not measured in red, the start as
/// a green square. Returns the spacing of the grid's lines in m.
double draw_track(std::span<const TrackPoint> track, Bgr out);

}  // namespace takt::picture
