// SPDX-License-Identifier: Apache-2.0
// Photographs of real objects (COIL-100, thesis Sec. 3.4 works with such views) in generated scenes.
#include "nodes/object_detection/photographs.hpp"

#include <doctest/doctest.h>

#include "nodes/object_detection/evaluate.hpp"
#include "tests/recorded/recording.hpp"

using namespace takt::object_detection;
using takt::test::recording;

TEST_CASE("photographed objects, views 60 degrees apart: most windows go, few objects with them") {
  const auto folder = recording("objects/coil100");
  const auto database = read_turntable(folder, 48);
  REQUIRE(database.size() == 10);
  Exclusion of[2], none_missed[2];
  for (const ColourBins bins : {ColourBins::hsv_64x32x2, ColourBins::hsv_64x64x1}) {
    DetectorParameters p;
    p.last = Stage::colour;
    p.bins = bins;
    Detector detector(640, 480, database, p);
    ColourStageTest test(detector);
    Measurement m;
    for (uint64_t i = 0; i < 60; ++i)
      measure(make_scene(database, {}, 1, i), detector.grid(), database.size(), test, m);
    of[static_cast<size_t>(bins)] = m.at(1);
    none_missed[static_cast<size_t>(bins)] = m.at(m.no_miss_factor());
    MESSAGE((bins == ColourBins::hsv_64x32x2 ? "64x32x2: " : "64x64x1: ")
            << m.object_factor.size() << " objects: missed " << m.at(1).missed_pct << " %, excluded "
            << m.at(1).excluded_pct << " %; none missed: excluded " << m.at(m.no_miss_factor()).excluded_pct << " %");
  }
  CHECK(of[1].missed_pct < 5);
  CHECK(none_missed[1].excluded_pct >= 75);
  CHECK(none_missed[1].excluded_pct >= none_missed[0].excluded_pct);  // why bins without value are the default
}
