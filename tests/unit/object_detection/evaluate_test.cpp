// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/evaluate.hpp"

#include <doctest/doctest.h>

#include "nodes/object_detection/tally.hpp"
#include "rt/msg/ace/detections.hpp"
#include "tests/unit/object_detection/objects.hpp"

using namespace takt::object_detection;
using takt::test::kObjects;

namespace {

/// Without the thresholds that suit the lab.
std::vector<DatabaseObject> automatic(std::vector<DatabaseObject> database) {
  for (DatabaseObject& object : database) object.thresholds = {};
  return database;
}

struct Shipped {
  std::vector<DatabaseObject> database = automatic(read_database(kObjects, 48, TestViews::read));
  Detector detector{640, 480, database, [] {
                      DetectorParameters p;
                      p.last = Stage::colour;
                      return p;
                    }()};
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
    passed += s.detector.at_scale(0).decision().passed_windows();
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

TEST_CASE("an occluder hides as much of an object as it says, and the rest of the scene stays as it was") {
  const Shipped s;
  SceneParameters p;
  p.fewest_objects = p.most_objects = 1;
  p.noise_sigma = 0;
  p.occlusion_max = 0.6;
  double least = 1, most = 0;
  for (uint64_t i = 0; i < 60; ++i) {
    const Scene scene = make_scene(s.database, p, 4, i);
    REQUIRE(scene.objects.size() == 1);
    least = std::min(least, scene.objects[0].occluded);
    most = std::max(most, scene.objects[0].occluded);
  }
  CHECK(least < 0.1);
  CHECK(most > 0.5);
  CHECK(most < 0.65);  // whole lines of pixels
}

TEST_CASE("a tally: a box of the right class over half of the object finds it, others are false") {
  Scene scene;
  scene.objects = {{1, 100, 100, 40, 0.35}, {2, 300, 100, 40, 0.05}};
  const std::vector<takt::Detection> boxes = {
      {1, 110, 90, 64, 64, 0.7f}, {1, 130, 90, 64, 64, 0.6f}, {2, 100, 100, 64, 64, 0.4f}};
  Tally all(0), good(0.5);
  all.add(scene, boxes);
  good.add(scene, boxes);
  CHECK(all.objects() == 2);
  CHECK(all.missed() == 1);
  CHECK(all.false_positives() == 2);  // one beside its object, one on another's place
  CHECK(good.false_positives() == 1);
  CHECK(all.detected_pct() == 50);
  CHECK(all.missed_pct(3) == 0);
  CHECK(all.missed_pct(0) == 100);
  CHECK(all.missed_pct(1) == -1);
}
