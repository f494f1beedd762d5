// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/tracks.hpp"

#include <doctest/doctest.h>

#include "nodes/traffic_signs/distance.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/testing.hpp"

using namespace takt;
using namespace takt::traffic_signs;

namespace {

Sighting at(size_t sign, int x, int side = 40) { return {sign, {x, 100, side, side}, 5}; }

}  // namespace

TEST_CASE("traffic_signs: a sign counts from the second image in a row on and is forgotten after three without it") {
  Tracks tracks({});
  const auto see = [&](std::vector<Sighting> sightings, bool complete = true) { tracks.update(sightings, complete); };
  see({at(1, 50)});
  CHECK_FALSE(tracks.any_confirmed());
  CHECK(tracks.expected().size() == 1);
  see({at(2, 50)});  // another class there: not the same sign
  CHECK(tracks.tracks().size() == 2);
  CHECK_FALSE(tracks.any_confirmed());
  see({at(1, 52)});  // not in a row
  CHECK_FALSE(tracks.any_confirmed());
  see({at(1, 60)});  // 32 of 48 px overlap
  CHECK(tracks.any_confirmed());
  see({});
  see({}, false);  // not searched: no miss
  see({});
  CHECK(tracks.any_confirmed());
  see({});
  CHECK(tracks.tracks().empty());
}

TEST_CASE("traffic_signs: of two signs of a class each goes on with its own track") {
  Tracks tracks({});
  tracks.update(std::vector{at(0, 50), at(0, 75)}, true);
  tracks.update(std::vector{at(0, 71), at(0, 46)}, true);
  REQUIRE(tracks.tracks().size() == 2);
  CHECK(tracks.tracks()[0].last.box.x == 46);
  CHECK(tracks.tracks()[1].last.box.x == 71);
  CHECK(tracks.tracks()[0].confirmed);
}

TEST_CASE("traffic_signs: distance by the median disparity, size by the distance") {
  const Capacity capacity{200, 200, 1, 0};
  test::Box<DisparityMap> map(capacity);
  map->width = map->height = 200;
  map->camera.focal_px = 492.8;
  map->camera.baseline_m = 0.24;
  map->disparity.resize(200 * 200);
  for (int16_t& d : map->disparity.items()) d = DisparityMap::invalid;
  DistanceMeter meter(256);
  const Box box{40, 60, 60, 60};
  CHECK(meter.distance_m(*map, box) == 0);
  for (int y = 75; y < 105; ++y)
    for (int x = 55; x < 85; ++x) map->view().at(x, y) = static_cast<int16_t>(x < 65 ? 7 : 24);
  const double z = meter.distance_m(*map, box);
  CHECK(z == doctest::Approx(4.928));  // oracle 6
  SignModel sign;
  sign.width_m = sign.height_m = 0.6;  // 60 px at that distance are exactly 0.6 m
  CHECK(has_size(sign, box, z, 492.8, 0.99, 1.01));
  CHECK(has_size(sign, {0, 0, 118, 32}, z, 492.8, 0.5, 2.0));
  CHECK_FALSE(has_size(sign, {0, 0, 122, 60}, z, 492.8, 0.5, 2.0));
  CHECK_FALSE(has_size(sign, {0, 0, 60, 28}, z, 492.8, 0.5, 2.0));
}

TEST_CASE("traffic_signs: colours of signs are told by ratios, whatever the light") {
  for (const double light : {0.4, 0.7, 1.0}) {
    const auto lit = [&](int b, int g, int r) {
      return colour_of(static_cast<uint8_t>(b * light), static_cast<uint8_t>(g * light),
                       static_cast<uint8_t>(r * light));
    };
    CHECK(lit(35, 25, 190) == SignColour::red);
    CHECK(lit(20, 190, 240) == SignColour::yellow);
    CHECK(lit(170, 80, 10) == SignColour::blue);
    CHECK(lit(120, 130, 125) == SignColour::any);
    CHECK(lit(60, 140, 70) == SignColour::any);
  }
  ColourRegions regions(10, 9);
  std::vector<uint8_t> bgr(10 * 9 * 3, 100);
  for (int x = 4; x < 10; ++x) bgr[static_cast<size_t>((5 * 10 + x) * 3 + 2)] = 255;
  regions.count({bgr.data(), 10, 9, 3});
  CHECK(regions.pixels(SignColour::red, {0, 0, 10, 9}) == 6);
  CHECK(regions.pixels(SignColour::red, {5, 5, 2, 2}) == 4);  // whole cells
  CHECK(regions.pixels(SignColour::red, {0, 0, 4, 9}) == 0);
  CHECK(regions.pixels(SignColour::blue, {0, 0, 10, 9}) == 0);
}
