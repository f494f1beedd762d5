// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/attributes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "nodes/object_3d/seeds.hpp"

namespace takt::object_3d {
namespace {

constexpr std::array<std::string_view, kAttributes> kNames{
    "length", "width", "height", "area",  "volume", "shape_2", "shape_3", "fill",    "mass_height", "mass_offset",
    "blue",   "green", "red",    "hue_0", "hue_60", "hue_120", "hue_180", "hue_240", "hue_300",     "grey"};
constexpr size_t kMostCells = 256 * 256;  ///< 2.56 x 2.56 m
constexpr double kGreySaturation = 0.2;
constexpr float kNothing = -std::numeric_limits<float>::infinity();

void set(Attributes& b, Attribute attribute, double value) {
  b[static_cast<size_t>(attribute)] = static_cast<float>(value);
}

void describe_shape(std::span<const Point> points, Description& d) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Point& p : points) mean += Eigen::Vector3f(p.x, p.y, p.z).cast<double>();
  mean /= static_cast<double>(points.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Point& p : points) {
    const Eigen::Vector3d v = Eigen::Vector3f(p.x, p.y, p.z).cast<double>() - mean;
    covariance += v * v.transpose();
  }
  const Eigen::Vector3d l =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues();
  set(d.attributes, Attribute::shape_2, l(1) / l(2));  // ascending
  set(d.attributes, Attribute::shape_3, std::max(0.0, l(0)) / l(2));
  d.mass_x_m = mean.x(), d.mass_y_m = mean.y(), d.mass_z_m = mean.z();
}

void describe_colour(std::span<const Colour> colours, Attributes& b) {
  const double n = static_cast<double>(colours.size());
  double blue = 0, green = 0, red = 0, grey = 0;
  std::array<double, 6> hues{};
  for (const Colour& colour : colours) {
    blue += colour.b, green += colour.g, red += colour.r;
    const Hsv hsv = hsv_of(colour);
    if (hsv.saturation < kGreySaturation) ++grey;
    else ++hues[static_cast<size_t>((hsv.hue_deg + 30) / 60) % 6];
  }
  set(b, Attribute::blue, blue / (255 * n));
  set(b, Attribute::green, green / (255 * n));
  set(b, Attribute::red, red / (255 * n));
  for (size_t i = 0; i < hues.size(); ++i)
    b[static_cast<size_t>(Attribute::hue_0) + i] = static_cast<float>(hues[i] / n);
  set(b, Attribute::grey, grey / n);
}

}  // namespace

std::string_view name_of(Attribute attribute) { return kNames[static_cast<size_t>(attribute)]; }

std::optional<Attribute> attribute_of(std::string_view name) {
  const auto it = std::find(kNames.begin(), kNames.end(), name);
  if (it == kNames.end()) return std::nullopt;
  return static_cast<Attribute>(it - kNames.begin());
}

Describer::Describer(size_t capacity) : points_(capacity), scratch_(2 * capacity + 2), top_(kMostCells) {}

/// The part of the hull's cells that holds a point, with the highest one of each. Cells count whose middle lies in the
/// hull, so that those on its rim are neither all counted nor all left out.
Describer::Columns Describer::columns(std::span<const Point> points, std::span<const Point2> hull, double base_z_m) {
  Point2 low = hull[0], high = hull[0];
  for (const Point2& p : hull) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  double cell_m = kCell_m;
  const auto cells_of = [&](double extent) { return static_cast<size_t>(extent / cell_m) + 1; };
  while (cells_of(high.x - low.x) * cells_of(high.y - low.y) > kMostCells) cell_m *= 2;
  const size_t columns = cells_of(high.x - low.x), rows = cells_of(high.y - low.y);
  std::fill_n(top_.begin(), columns * rows, kNothing);
  for (const Point& p : points) {
    const auto column = static_cast<size_t>((static_cast<double>(p.x) - low.x) / cell_m),
               row = static_cast<size_t>((static_cast<double>(p.y) - low.y) / cell_m);
    float& top = top_[row * columns + column];
    top = std::max(top, p.z);
  }
  size_t within = 0, occupied = 0;
  double heights = 0, x = 0, y = 0;
  for (size_t row = 0; row < rows; ++row)
    for (size_t column = 0; column < columns; ++column) {
      const Point2 middle{low.x + (static_cast<double>(column) + 0.5) * cell_m,
                          low.y + (static_cast<double>(row) + 0.5) * cell_m};
      if (!inside(hull, middle)) continue;
      ++within;
      const float top = top_[row * columns + column];
      if (top == kNothing) continue;
      ++occupied;
      heights += static_cast<double>(top) - base_z_m;
      x += middle.x, y += middle.y;
    }
  if (occupied == 0) return {};
  const double n = static_cast<double>(occupied), area = area_of(hull) * n / static_cast<double>(within);
  return {area, area * heights / n, x / n, y / n};
}

/// Points a spacing apart show the straight side of a rectangle well, but not the four places where a round thing
/// touches it: there the outermost point lies inside by about half of kRoundGap spacings. As round as the hull is.
void Describer::widen(std::span<const Point2> hull, double spacing_m, Rectangle& outline, Columns& seen) {
  constexpr double kRoundGap = 0.65;
  const double area = area_of(hull), fill = area / (outline.length * outline.width);
  const double round = std::clamp((1 - fill) / (1 - std::numbers::pi / 4), 0.0, 1.0);
  if (!(area > 0)) return;
  const double gap = kRoundGap * spacing_m * round;
  double rim = 0;
  for (size_t i = 0; i < hull.size(); ++i) {
    const Point2 &a = hull[i], &b = hull[(i + 1) % hull.size()];
    rim += std::hypot(b.x - a.x, b.y - a.y);
  }
  const double larger = 1 + rim * gap / 2 / area;
  seen.area_m2 *= larger, seen.volume_m3 *= larger;
  outline.length += gap, outline.width += gap;
}

std::optional<Description> Describer::describe(std::span<const Point> points, std::span<const Colour> colours,
                                               double base_z_m, double spacing_m) {
  if (points.size() < 3 || points.size() > points_.size()) return std::nullopt;
  double top = -std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < points.size(); ++i) {
    points_[i] = {static_cast<double>(points[i].x), static_cast<double>(points[i].y)};
    top = std::max(top, static_cast<double>(points[i].z));
  }
  const std::span<const Point2> hull = convex_hull(std::span(points_).first(points.size()), scratch_);
  Columns seen = columns(points, hull, base_z_m);
  Description d;
  d.outline = smallest_rectangle(hull);
  widen(hull, spacing_m, d.outline, seen);
  d.base_z_m = base_z_m, d.top_z_m = top;
  d.area_x_m = seen.x_m, d.area_y_m = seen.y_m;
  const double height = top - base_z_m;
  if (!(seen.area_m2 > 0) || !(d.outline.width > 0) || !(height > 0)) return std::nullopt;
  describe_shape(points, d);
  describe_colour(colours, d.attributes);
  Attributes& b = d.attributes;
  set(b, Attribute::length, d.outline.length);
  set(b, Attribute::width, d.outline.width);
  set(b, Attribute::height, height);
  set(b, Attribute::area, seen.area_m2);
  set(b, Attribute::volume, seen.volume_m3);
  set(b, Attribute::fill, seen.area_m2 / (d.outline.length * d.outline.width));
  set(b, Attribute::mass_height, (d.mass_z_m - base_z_m) / height);
  set(b, Attribute::mass_offset, std::hypot(d.mass_x_m - d.area_x_m, d.mass_y_m - d.area_y_m) / d.outline.length);
  return d;
}

}  // namespace takt::object_3d
