// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "nodes/object_detection/detector.hpp"
#include "nodes/object_detection/scenes.hpp"
#include "tests/unit/mapping_3d/node_harness.hpp"

namespace takt {
void register_object_detection(NodeTypes& types);
}

using namespace takt;
using namespace takt::object_detection;

namespace {

const std::filesystem::path kObjects = std::filesystem::path(TAKT_SOURCE_DIR) / "graph/objects";

std::unique_ptr<Node> make_node() {
  NodeTypes types;
  register_object_detection(types);
  return types.find("object_detection")->make();
}

constexpr Capacity kImages{640, 480, 3, 0};

/// The node, set up with the shipped objects, and a pair for it.
struct Bench {
  std::unique_ptr<Node> node = make_node();
  InputPort& port = test::input(*node, "pair");
  test::Box<StereoPair> pair{kImages};

  explicit Bench(const std::vector<std::pair<std::string, ParamValue>>& params = {}) {
    PortAccess::connect(port, kImages);
    test::set(*node, "database", kObjects.string());
    for (const auto& [name, value] : params) test::set(*node, name, value);
    test::set_up(*node);
    pair->width = 640, pair->height = 480, pair->channels = 3;
    pair->left.resize(640 * 480 * 3);
  }
  void show(const Scene& scene) {
    REQUIRE(scene.pixels.size() == pair->left.items().size());
    std::copy(scene.pixels.begin(), scene.pixels.end(), pair->left.data());
  }
};

/// The error of the set-up; empty if there is none.
std::string setup_error(const Capacity& images, const std::vector<std::pair<std::string, ParamValue>>& params = {}) {
  const auto node = make_node();
  test::set(*node, "database", kObjects.string());
  for (const auto& [name, value] : params) test::set(*node, name, value);
  PortAccess::connect(test::input(*node, "pair"), images);
  try {
    test::set_up(*node);
  } catch (const SetupError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("object_detection: boxes and region of interest of the left image, with its stamp") {
  Bench bench;
  auto& [node, port, pair] = bench;
  test::BoxWriter<Detections> boxes(*node->outputs()[0]);
  test::BoxWriter<Image> roi(*node->outputs()[1]);
  CHECK_FALSE(test::run(*node));  // nothing latched

  // One object, well visible.
  const auto database = read_database(kObjects, 48, TestViews::read);
  SceneParameters p;
  p.scale_min = p.scale_max = p.light_min = p.light_max = 1;
  p.most_objects = 1;
  Scene scene;
  for (uint64_t i = 0; scene.objects.empty(); ++i) scene = make_scene(database, p, 5, i);
  pair->health = image_health::blurred;
  bench.show(scene);
  test::latch(port, pair, 1234, 1);
  CHECK(test::run(*node));
  REQUIRE(boxes.sent());
  REQUIRE(roi.sent());
  CHECK(boxes.stamp_ns() == 1234);
  CHECK(roi.stamp_ns() == 1234);
  CHECK(boxes.message().image_width == 640);
  CHECK(boxes.message().image_height == 480);
  REQUIRE(boxes.message().boxes.size >= 1);
  const Detection& best = boxes.message().boxes[0];
  const PlacedObject& placed = scene.objects[0];
  CHECK(best.class_id == static_cast<float>(placed.object));
  CHECK(best.score > 0.6f);
  CHECK(std::abs(best.x_px + best.width_px / 2 - static_cast<float>(placed.x + placed.side / 2)) <= 24);
  CHECK(std::abs(best.y_px + best.height_px / 2 - static_cast<float>(placed.y + placed.side / 2)) <= 24);

  // The picture shows just what the detector passes.
  Detector detector(640, 480, database, {});
  REQUIRE(detector.run(scene.view()));
  REQUIRE(roi.message().width == 37);
  REQUIRE(roi.message().height == 27);
  CHECK(roi.message().channels == 1);
  CHECK(roi.message().health == image_health::blurred);
  std::vector<uint8_t> wanted(37 * 27);
  detector.decision().region_of_interest({wanted.data(), 37, 27});
  const auto got = roi.message().pixels.items();
  CHECK(std::equal(wanted.begin(), wanted.end(), got.begin(), got.end()));
  CHECK(std::count(got.begin(), got.end(), 255) > 0);

  // The same pair again is no work; an image of another size is refused.
  PortAccess::held(port)[0].sequence = 1;
  PortAccess::set_held(port, 1, false, 1);
  CHECK_FALSE(test::run(*node));
  pair->width = 320;
  test::latch(port, pair, 1300, 2);
  CHECK_FALSE(test::run(*node));
}

TEST_CASE("object_detection: with little time the best so far is sent; the next image goes on where this one ended") {
  const auto database = read_database(kObjects, 48, TestViews::skip);
  DetectorParameters p;
  p.last = Stage::colour;
  p.threshold_scale = 4;  // every window passes, so that those which were searched show
  Detector detector(640, 480, database, p);
  const std::vector<uint8_t> grey(640 * 480 * 3, 100);
  const ImageView<const uint8_t> image(grey.data(), 640, 480, 3);
  const SearchGrid& grid = detector.grid();
  std::vector<uint8_t> roi(static_cast<size_t>(grid.windows()));
  const auto searched_rows = [&](int portions) {
    REQUIRE(detector.run(
        image, [&, asked = 0]() mutable { return asked++ < portions; }, [] { return true; }));
    detector.decision().region_of_interest({roi.data(), grid.columns, grid.rows});
    std::vector<int> rows;
    for (int row = 0; row < grid.rows; ++row)
      if (roi[static_cast<size_t>(row * grid.columns)] == 255) rows.push_back(row);
    return rows;
  };
  REQUIRE(grid.rows == 27);
  const auto range = [](int from, int to) {
    std::vector<int> v;
    for (int i = from; i < to; ++i) v.push_back(i);
    return v;
  };
  CHECK(searched_rows(10) == range(0, 10));
  CHECK(detector.searched() == doctest::Approx(10.0 / 27));
  CHECK(searched_rows(10) == range(10, 20));
  CHECK(searched_rows(0).empty());
  const auto wrapped = searched_rows(10);  // 20 .. 26, then 0 .. 2
  CHECK(wrapped.size() == 10);
  CHECK(wrapped[2] == 2);
  CHECK(wrapped[3] == 20);
  CHECK(searched_rows(100) == range(0, 27));
  CHECK(detector.searched() == 1.0f);
  CHECK(searched_rows(5) == range(0, 5));
}

TEST_CASE("object_detection: out of time it sends what it has and says how much was searched") {
  Bench bench;
  auto& [node, port, pair] = bench;
  test::BoxWriter<Detections> boxes(*node->outputs()[0]);
  test::latch(port, pair, 1234, 1);
  VirtualClock late(99'500'000);  // half a millisecond before the deadline, less than `reserve`
  Job job(late, 0, 0, 100'000'000, 0, "full");
  node->run(job);
  REQUIRE(boxes.sent());
  CHECK(boxes.message().searched == 0.0f);
  CHECK(boxes.message().boxes.size == 0);
  test::latch(port, pair, 1235, 2);
  CHECK(test::run(*node));
  CHECK(boxes.message().searched == 1.0f);
}

TEST_CASE("object_detection: at most max_detections boxes") {
  Bench bench(
      {{"max_detections", int64_t{2}}, {"min_score", 0.0}, {"stages", std::string("ch")}});  // so that there are many
  auto& [node, port, pair] = bench;
  test::BoxWriter<Detections> boxes(*node->outputs()[0]);
  const auto database = read_database(kObjects, 48, TestViews::read);
  bench.show(make_scene(database, {}, 3, 0));
  test::latch(port, pair, 1, 1);
  CHECK(test::run(*node));
  REQUIRE(boxes.sent());
  CHECK(boxes.message().boxes.size == 2);
  CHECK(boxes.message().boxes[0].score >= boxes.message().boxes[1].score);
}

TEST_CASE("object_detection: what cannot work is said before start") {
  const auto says = [](const std::string& error, const char* words) { return error.find(words) != std::string::npos; };
  CHECK(setup_error(kImages).empty());
  CHECK(says(setup_error({640, 480, 1, 0}), "must have three"));
  CHECK(says(setup_error(kImages, {{"database", std::string("/nonexistent")}}), "objects.txt: cannot be read"));
  CHECK(says(setup_error(kImages, {{"reference", int64_t{32}}}), "must be 32 x 32"));
  CHECK(says(setup_error(kImages, {{"window", int64_t{48}}}), "window - 1 = 47"));
  CHECK(says(setup_error({60, 480, 3, 0}), "at most 60"));
}
