// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/evaluate.hpp"

#include <doctest/doctest.h>

using namespace takt::object_detection;

namespace {

const std::filesystem::path kObjects = std::filesystem::path(TAKT_SOURCE_DIR) / "graph/objects";

struct Shipped {
  std::vector<DatabaseObject> database = read_database(kObjects, 48, TestViews::read);
  Detector detector{640, 480, database, {}};
};

}  // namespace

TEST_CASE("scenes are functions of seed and index, with objects inside and apart") {
  const Shipped s;
  const Scene a = make_scene(s.database, {}, 1, 4), b = make_scene(s.database, {}, 1, 4);
  CHECK(a.pixels == b.pixels);
  CHECK(a.pixels != make_scene(s.database, {}, 1, 5).pixels);
  CHECK(a.pixels != make_scene(s.database, {}, 2, 4).pixels);
  size_t objects = 0;
  for (uint64_t i = 0; i < 20; ++i) {
    const Scene scene = make_scene(s.database, {}, 1, i);
    REQUIRE(scene.pixels.size() == 640u * 480u * 3u);
    objects += scene.objects.size();
    for (size_t k = 0; k < scene.objects.size(); ++k) {
      const PlacedObject& o = scene.objects[k];
      CHECK((o.x >= 0 && o.y >= 0 && o.x + o.side <= 640 && o.y + o.side <= 480 && o.side >= 38 && o.side <= 58));
      for (size_t m = 0; m < k; ++m) {
        const PlacedObject& q = scene.objects[m];
        CHECK((o.x + o.side <= q.x || q.x + q.side <= o.x || o.y + o.side <= q.y || q.y + q.side <= o.y));
      }
    }
  }
  CHECK(objects > 10);
}

TEST_CASE("exclusion: passing means to lie below the threshold, a missed object is one without a passing window") {
  Measurement m;
  m.window_factor = {0.5f, 1.0f, 1.5f, 2.0f};
  m.object_factor = {0.5f, 1.0f};
  CHECK(m.at(1).excluded_pct == 75);
  CHECK(m.at(1).missed_pct == 50);
  CHECK(m.at(m.no_miss_factor()).missed_pct == 0);
  CHECK(m.at(m.no_miss_factor()).excluded_pct == 50);
}

TEST_CASE("the measured share is that of the decision itself") {
  Shipped s;
  ColourStageTest test(s.detector);
  Measurement m;
  size_t passed = 0, windows = 0;
  for (uint64_t i = 0; i < 5; ++i) {
    measure(make_scene(s.database, {}, 9, i), s.detector.grid(), s.database.size(), test, m);
    passed += s.detector.decision().passed_windows();
    windows += static_cast<size_t>(s.detector.grid().windows());
  }
  CHECK(m.window_factor.size() == windows);
  CHECK(m.at(1).excluded_pct ==
        doctest::Approx(100.0 - 100.0 * static_cast<double>(passed) / static_cast<double>(windows)));
}

TEST_CASE("views never seen before are not missed while at least 75 % of the windows are excluded (6.10)") {
  Shipped s;
  ColourStageTest ours(s.detector);
  MeanColourTest mean_colour(s.detector.grid(), s.database);
  Measurement m, baseline;
  for (uint64_t i = 0; i < 30; ++i) {
    const Scene scene = make_scene(s.database, {}, 77, i);
    measure(scene, s.detector.grid(), s.database.size(), ours, m);
    measure(scene, s.detector.grid(), s.database.size(), mean_colour, baseline);
  }
  MESSAGE(m.object_factor.size() << " objects: missed " << m.at(1).missed_pct << " %, excluded " << m.at(1).excluded_pct
                                 << " %; mean colour, none missed: excluded "
                                 << baseline.at(baseline.no_miss_factor()).excluded_pct << " %");
  REQUIRE(m.object_factor.size() > 20);
  CHECK(m.at(1).missed_pct == 0);
  CHECK(m.at(1).excluded_pct >= 75);
  CHECK(m.at(1).excluded_pct > baseline.at(baseline.no_miss_factor()).excluded_pct);
}
