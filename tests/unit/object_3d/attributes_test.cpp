// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "nodes/object_3d/scenes.hpp"
#include "rt/msg/point.hpp"

using namespace takt;
using namespace takt::object_3d;

namespace {

/// All sides of a box but the lower one, a point each 4 mm; turned by 30 deg, its foot at (0.2, 1.0, 0.5).
std::vector<Point> box_points(double length, double width, double height) {
  std::vector<Point> points;
  const double c = std::cos(std::numbers::pi / 6), s = std::sin(std::numbers::pi / 6), step = 0.004;
  const auto add = [&](double x, double y, double z) {
    points.push_back({static_cast<float>(0.2 + c * x - s * y), static_cast<float>(1.0 + s * x + c * y),
                      static_cast<float>(0.5 + z)});
  };
  for (double x = -length / 2; x <= length / 2 + 1e-9; x += step)
    for (double y = -width / 2; y <= width / 2 + 1e-9; y += step) add(x, y, height);
  for (double z = 0; z <= height; z += step) {
    for (double x = -length / 2; x <= length / 2 + 1e-9; x += step) add(x, -width / 2, z), add(x, width / 2, z);
    for (double y = -width / 2; y <= width / 2 + 1e-9; y += step) add(-length / 2, y, z), add(length / 2, y, z);
  }
  return points;
}

}  // namespace

TEST_CASE("attributes of a box from all sides: its measures, its place, a full rectangle") {
  const auto points = box_points(0.24, 0.12, 0.16);
  const std::vector<Colour> colours(points.size(), Colour{51, 102, 204});
  Describer describer(points.size());
  const auto found = describer.describe(points, colours, 0.5, 0);
  REQUIRE(found);
  const Attributes& b = found->attributes;
  const auto is = [&](Attribute attribute, double wanted) {
    CAPTURE(name_of(attribute));
    CHECK(value(b, attribute) == doctest::Approx(wanted).epsilon(0.02));
  };
  is(Attribute::length, 0.24);
  is(Attribute::width, 0.12);
  is(Attribute::height, 0.16);
  is(Attribute::area, 0.24 * 0.12);
  is(Attribute::volume, 0.24 * 0.12 * 0.16);
  is(Attribute::fill, 1);
  CHECK(value(b, Attribute::mass_offset) < 0.02);
  is(Attribute::blue, 0.2);
  is(Attribute::green, 0.4);
  is(Attribute::red, 0.8);
  is(Attribute::hue_0, 1);  // hue 20 deg
  CHECK(value(b, Attribute::grey) == 0);
  CHECK(found->outline.yaw_rad == doctest::Approx(std::numbers::pi / 6).epsilon(0.01));
  CHECK(found->outline.centre.x == doctest::Approx(0.2));
  CHECK(found->area_x_m == doctest::Approx(0.2).epsilon(0.01));
  CHECK(found->area_y_m == doctest::Approx(1.0).epsilon(0.01));
}

TEST_CASE("shape: the eigenvalue ratios of a plate are those of its sides") {
  std::vector<Point> plate;
  for (int x = 0; x <= 40; ++x)
    for (int y = 0; y <= 20; ++y) plate.push_back({0.01f * static_cast<float>(x), 0.01f * static_cast<float>(y), 0.1f});
  Describer describer(plate.size());
  const auto found = describer.describe(plate, std::vector<Colour>(plate.size()), 0, 0);
  REQUIRE(found);
  CHECK(value(found->attributes, Attribute::shape_2) == doctest::Approx((21.0 * 21 - 1) / (41.0 * 41 - 1)));
  CHECK(value(found->attributes, Attribute::shape_3) < 1e-6);
  CHECK(value(found->attributes, Attribute::grey) == 1);
}

TEST_CASE("a hole in an object is no part of its area, and fill says so") {
  std::vector<Point> ring;
  for (int x = -50; x <= 50; ++x)
    for (int y = -50; y <= 50; ++y)
      if (std::abs(x) > 25 || std::abs(y) > 25)
        ring.push_back({0.002f * static_cast<float>(x), 0.002f * static_cast<float>(y), 0.1f});
  Describer describer(ring.size());
  const auto found = describer.describe(ring, std::vector<Colour>(ring.size()), 0, 0);
  REQUIRE(found);
  CHECK(value(found->attributes, Attribute::fill) == doctest::Approx(0.75).epsilon(0.06));
}

TEST_CASE("what has no outline or no height is not described") {
  Describer describer(10);
  const std::vector<Colour> colours(4);
  CHECK_FALSE(describer.describe(std::vector<Point>{{0, 0, 1}, {1, 1, 1}}, std::span(colours).first(2), 0, 0));
  CHECK_FALSE(
      describer.describe(std::vector<Point>{{0, 0, 1}, {1, 1, 1}, {2, 2, 1}}, std::span(colours).first(3), 0, 0));
  CHECK_FALSE(
      describer.describe(std::vector<Point>{{0, 0, 1}, {1, 0, 1}, {1, 1, 1}}, std::span(colours).first(3), 1, 0));
}

TEST_CASE("every attribute has a name of its own, by which it is found") {
  for (size_t i = 0; i < kAttributes; ++i) {
    const auto attribute = static_cast<Attribute>(i);
    CHECK(attribute_of(name_of(attribute)) == attribute);
  }
  CHECK_FALSE(attribute_of("weight"));
}

TEST_CASE("boxes and cylinders seen from one side through stereo noise measure what they are within 5 %") {
  const std::vector<Model> solids{{"box", {{Solid::box, 0, 0, 0, 0.20, 0.14, 0.15}}, {70, 120, 170}},
                                  {"cylinder", {{Solid::cylinder, 0, 0, 0, 0.14, 0, 0.15}}, {60, 60, 190}}};
  ObjectFinder finder(320 * 240, 8, {}, nullptr);
  for (uint64_t i = 0; i < 10; ++i) {
    const size_t kind = i % 2;
    const Scene scene = make_scene(solids, {kind}, {}, 4, i);
    const auto found = finder.run(scene.cloud(), {}, [] { return true; });
    REQUIRE(found.size() == 1);
    CHECK(found[0].on == kOnSupport);
    const Part& part = scene.placed[0].model.parts[0];
    const double across = kind == 0 ? part.width : part.length;
    const Attributes& b = found[0].what.attributes;
    CHECK(value(b, Attribute::length) == doctest::Approx(std::max(part.length, across)).epsilon(0.05));
    CHECK(value(b, Attribute::width) == doctest::Approx(std::min(part.length, across)).epsilon(0.05));
    CHECK(value(b, Attribute::height) == doctest::Approx(part.height).epsilon(0.05));
  }
}
