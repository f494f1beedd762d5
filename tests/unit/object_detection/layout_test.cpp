// SPDX-License-Identifier: Apache-2.0
// The verifying stage: what it learns, what it keeps out, what it refuses.
#include <doctest/doctest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "nodes/object_detection/detector.hpp"
#include "nodes/object_detection/layout_learning.hpp"
#include "nodes/object_detection/revisions.hpp"
#include "nodes/object_detection/scenes.hpp"
#include "nodes/object_detection/tally.hpp"
#include "rt/msg/ace/detections.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/object_detection/objects.hpp"

using takt::Detection;
using namespace takt::object_detection;
using takt::test::kObjects;

namespace {

/// Generated surroundings of a seed.
Photograph photograph(std::span<const DatabaseObject> database, uint64_t seed) {
  SceneParameters p;
  p.fewest_objects = p.most_objects = 0;
  const Scene scene = make_scene(database, p, seed, 0);
  return {"generated", scene.width, scene.height, scene.pixels};
}

std::vector<Photograph> photographs(std::span<const DatabaseObject> database) {
  return {photograph(database, 101), photograph(database, 102)};
}

/// Where the views pass, but for the last stage, as badly as they may.
DetectorParameters wide_open(Stage last) {
  DetectorParameters p;
  p.last = last;
  p.threshold_scale = 1.5;
  return p;
}

}  // namespace

TEST_CASE("what the histograms take for objects elsewhere the layout keeps out, and finds the objects more exactly") {
  const auto database = read_database(kObjects, 48, TestViews::read);
  Detector histograms(640, 480, database, wide_open(Stage::cooccurrence)),
      layout(640, 480, database, wide_open(Stage::layout), photographs(database));
  Tally before, after;
  double off_px = 0;
  size_t found = 0;
  for (uint64_t i = 0; i < 16; ++i) {
    SceneParameters p;
    p.fewest_objects = p.most_objects = i < 12 ? 1 : 0;
    const Scene scene = make_scene(database, p, 9, i);
    std::vector<Detection> boxes(100);
    REQUIRE(histograms.run(scene.view()));
    boxes.resize(histograms.detections(0, boxes));
    before.add(scene, boxes);
    boxes.resize(100);
    REQUIRE(layout.run(scene.view()));
    boxes.resize(layout.detections(0, boxes));
    after.add(scene, boxes);
    for (const Detection& box : boxes) {
      for (const PlacedObject& object : scene.objects) {
        if (box.class_id != static_cast<float>(object.object)) continue;
        const double x =
            static_cast<double>(box.x_px) + static_cast<double>(box.width_px) / 2 - object.x - object.side / 2.0;
        if (std::abs(x) < object.side) off_px += std::abs(x), ++found;
      }
    }
  }
  CHECK(before.missed() == 0);
  CHECK(after.missed() == 0);
  CHECK(before.false_positives() > 20);
  CHECK(after.false_positives() < before.false_positives() / 4);
  REQUIRE(found >= 12);
  CHECK(off_px / static_cast<double>(found) < 5);  // windows stand 16 px apart
}

TEST_CASE("templates of the same photographs are equal; each knows its own view from the surroundings") {
  auto database = read_database(kObjects, 48, TestViews::skip);
  database.resize(2);
  const auto around = photographs(database);
  const auto objects = learn_layout(database, around), again = learn_layout(database, around);
  REQUIRE(objects.size() == database.size());
  for (size_t o = 0; o < objects.size(); ++o) {
    REQUIRE(objects[o].views.size() == database[o].views.size());
    CHECK(objects[o].threshold > 0);
    for (size_t v = 0; v < objects[o].views.size(); ++v) {
      const LayoutTemplate& view = objects[o].views[v];
      CHECK(view.weight == again[o].views[v].weight);
      CHECK(view.unit > 0);
      LayoutSums sums(640, 480);
      LayoutFeatures features;
      sums.take(database[o].views[v].view(), 0, 0, 48, 48);
      sums.features({0, 0, 48}, features);
      const float own = view.evidence(features);
      sums.take(around[0].view(), 0, 0, 640, 480);
      sums.features({300, 200, 48}, features);
      CHECK(own > kLayoutEvidence);
      CHECK(view.evidence(features) < 0);
    }
  }
}

TEST_CASE("photographs are part of a database and of its revisions; too small ones are refused") {
  const takt::test::TemporaryFolder folder;
  const auto objects = folder.path / "objects";
  std::filesystem::create_directory(objects);
  cv::Mat3b view(16, 16, cv::Vec3b(40, 60, 200)), surroundings(64, 80, cv::Vec3b(90, 90, 90));
  surroundings.rowRange(20, 40) = cv::Vec3b(200, 100, 20);
  cv::imwrite((objects / "view.png").string(), view);
  cv::imwrite((objects / "table.png").string(), surroundings);
  folder.write("objects/objects.txt", "background table.png\nobject cup\nview view.png\n");
  CHECK(read_database(objects, 16, TestViews::skip).size() == 1);
  auto read = read_backgrounds(objects);
  REQUIRE(read.size() == 1);
  CHECK(read[0].width == 80);
  CHECK(read[0].height == 64);
  CHECK(read[0].view().at(5, 30, 0) == 200);
  const std::string revision = publish_revision(objects, 16);
  CHECK(read_backgrounds(revision_folder(objects, revision)).size() == 1);
  cv::imwrite((objects / "table.png").string(), ~surroundings);
  CHECK(publish_revision(objects, 16) != revision);
  folder.write("objects/objects.txt", "background absent.png\nobject cup\nview view.png\n");
  CHECK_THROWS_AS(read_backgrounds(objects), DatabaseError);

  const auto database = read_database(objects, 16, TestViews::skip);
  read[0].height = 31;
  CHECK_THROWS_WITH_AS(learn_layout(database, read), doctest::Contains("80 x 31 px, must have at least 32"),
                       std::invalid_argument);
}
