// SPDX-License-Identifier: Apache-2.0
// What an object is like (thesis Sec. 3.3.3; ): spatial, topological and colour attributes of
// the points that one viewpoint shows of it.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "nodes/object_3d/outline.hpp"
#include "rt/msg/point.hpp"

namespace takt::object_3d {

enum class Attribute : uint8_t {
  length,       ///< m; longer side of the smallest rectangle around the object from above
  width,        ///< m; its shorter side
  height,       ///< m; highest point above the base
  area,         ///< m^2; outline from above: hull, less the cells inside it that show nothing
  volume,       ///< m^3; columns of that area from the base to their highest point
  shape_2,      ///< l2 / l1 of the eigenvalues l1 >= l2 >= l3 of the points' covariance
  shape_3,      ///< l3 / l1
  fill,         ///< area / (length width): box 1, cylinder 0.785
  mass_height,  ///< centre of mass (mean point) above the base / height
  mass_offset,  ///< horizontal distance of centre of mass and centre of area / length
  blue,         ///< mean colour, 0..1
  green,
  red,
  hue_0,  ///< share of the points whose hue lies within 30 deg of 0; the next ones 60 deg further
  hue_60,
  hue_120,
  hue_180,
  hue_240,
  hue_300,
  grey  ///< share of the points with a saturation below 0.2
};
inline constexpr size_t kAttributes = 20;
using Attributes = std::array<float, kAttributes>;

std::string_view name_of(Attribute attribute);
std::optional<Attribute> attribute_of(std::string_view name);
inline float value(const Attributes& b, Attribute attribute) { return b[static_cast<size_t>(attribute)]; }

struct Description {
  Attributes attributes{};
  Rectangle outline;
  double base_z_m = 0, top_z_m = 0;
  double mass_x_m = 0, mass_y_m = 0, mass_z_m = 0;  ///< centre of mass
  double area_x_m = 0, area_y_m = 0;                ///< centre of area
};

class Describer {
 public:
  /// Edge of the cells of area and volume: wide enough that a surface has a point in each.
  static constexpr double kCell_m = 0.015;

  /// Takes the memory for objects of up to `capacity` points; nothing else allocates.
  explicit Describer(size_t capacity);

  /// z up; `colours` as many as points. The object stands at `base_z_m`; neighbouring points are `spacing_m` apart
  /// across the line of sight, 0: not known. None for fewer than three points or an outline without area.
  std::optional<Description> describe(std::span<const Point> points, std::span<const Colour> colours, double base_z_m,
                                      double spacing_m);

 private:
  struct Columns {
    double area_m2 = 0, volume_m3 = 0, x_m = 0, y_m = 0;
  };
  Columns columns(std::span<const Point> points, std::span<const Point2> hull, double base_z_m);
  static void widen(std::span<const Point2> hull, double spacing_m, Rectangle& outline, Columns& seen);

  std::vector<Point2> points_, scratch_;
  std::vector<float> top_;
};

}  // namespace takt::object_3d
