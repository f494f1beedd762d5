// SPDX-License-Identifier: Apache-2.0
// Where regions begin: components of a colour, the boxes of a detector. Both work on the
// pixels of a cloud.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "nodes/object_3d/pixel_grid.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/point.hpp"

namespace takt::object_3d {

/// A part of HSV space; the default is skin. Hue in degrees, from low to high through 360 where low is above high.
struct ColourModel {
  double hue_low_deg = 335, hue_high_deg = 25;
  double saturation_low = 0.15, saturation_high = 0.75;
  double value_low = 0.25, value_high = 1;

  bool holds(const Colour& colour) const;
};

/// Hue in degrees 0 .. 360 (0 for grey), saturation and value 0 .. 1.
struct Hsv {
  double hue_deg, saturation, value;
};
Hsv hsv_of(const Colour& colour);

struct ComponentLimits {
  double smallest_px = 100, largest_px = 20'000;  ///< area of a component in pixels of the image
};

class ColourSeeds {
 public:
  /// Takes the memory for grids of up to `cells` cells; nothing else allocates.
  explicit ColourSeeds(size_t cells);

  /// Pixels of the colour, opened by 3 x 3 and closed by 5 x 5 cells of the grid; of each 8-connected component whose
  /// area (cells times step_px squared) is within the limits the point nearest to its median column and row. Written in
  /// the order of the components' first pixels; returns how many, at most seeds.size(). Cells without a point have no
  /// colour.
  size_t find(const PixelGrid& grid, std::span<const Colour> colours, const ColourModel& model,
              const ComponentLimits& limits, int step_px, std::span<uint32_t> seeds);
  /// The cells that the last find() saw in the colour, after opening and closing.
  std::span<const uint8_t> mask() const { return mask_; }

 private:
  enum class Window : uint8_t { lowest, highest };
  void each_window(const PixelGrid& grid, int half, Window wanted);
  size_t flood(const PixelGrid& grid, size_t first);
  uint32_t median_point(const PixelGrid& grid, size_t count);

  std::vector<uint8_t> mask_, other_;
  std::vector<uint32_t> cells_;
  std::vector<int32_t> scratch_;
};

/// The point of median depth among those in the middle half of a box (px of the image, as Detections have them). None
/// where there is no point. `scratch` holds as many as the grid has cells.
std::optional<uint32_t> seed_in_box(const PixelGrid& grid, std::span<const Point> points, const Detection& box,
                                    int step_px, std::span<uint32_t> scratch);

}  // namespace takt::object_3d
