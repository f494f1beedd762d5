// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "nodes/object_detection/detector.hpp"
#include "nodes/object_detection/scenes.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/image.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/unit/object_detection/objects.hpp"

namespace takt {
void register_object_detection(NodeTypes& types);
}

using namespace takt;
using namespace takt::object_detection;
using test::kObjects;

namespace {

std::unique_ptr<Node> make_node() {
  NodeTypes types;
  register_object_detection(types);
  return types.find("object_detection")->make();
}

constexpr Capacity kImages{640, 480, 3, 0}, kMasks{64, 48, 1, 0};

/// The node, set up with the shipped objects, and a pair for it.
struct Bench {
  std::unique_ptr<Node> node = make_node();
  InputPort& port = test::input(*node, "pair");
  test::Box<StereoPair> pair{kImages};

  explicit Bench(const std::vector<std::pair<std::string, ParamValue>>& params = {}) {
    PortAccess::connect(port, kImages);
    PortAccess::connect(test::input(*node, "mask"), kMasks);
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
  detector.region_of_interest({wanted.data(), 37, 27});
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
        image, nullptr, [&, asked = 0]() mutable { return asked++ < portions; }, [] { return true; }));
    detector.region_of_interest({roi.data(), grid.columns, grid.rows});
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

TEST_CASE("object_detection: the rows of the second scale follow those of the first, and each comes up in turn") {
  const auto database = read_database(kObjects, 48, TestViews::skip);
  DetectorParameters p;
  p.last = Stage::colour;
  p.threshold_scale = 4;
  p.scales = {1, 0.5};
  Detector detector(640, 480, database, p);
  REQUIRE(detector.at_scale(1).grid().rows == 12);
  REQUIRE(detector.at_scale(1).grid().columns == 17);
  const std::vector<uint8_t> grey(640 * 480 * 3, 100);
  std::vector<size_t> searched;  // rows of windows per scale
  const auto run = [&](int portions) {
    REQUIRE(detector.run(
        {grey.data(), 640, 480, 3}, nullptr, [&, asked = 0]() mutable { return asked++ < portions; },
        [] { return true; }));
    searched.clear();
    for (size_t s = 0; s < 2; ++s)
      searched.push_back(detector.at_scale(s).decision().passed_windows() /
                         static_cast<size_t>(detector.at_scale(s).grid().columns));
    return searched;
  };
  CHECK(run(30) == std::vector<size_t>{27, 3});
  CHECK(detector.searched() == doctest::Approx((27 * 37 + 3 * 17) / (27 * 37 + 12 * 17.0)));
  CHECK(run(10) == std::vector<size_t>{1, 9});
  CHECK(run(37) == std::vector<size_t>{26, 11});  // from row 1 of the first scale on
  CHECK(run(39) == std::vector<size_t>{27, 12});
  CHECK(detector.searched() == 1.0f);
}

TEST_CASE("object_detection: an object at twice its references' size is one detection, at any scales") {
  const auto database = read_database(kObjects, 48, TestViews::read);
  SceneParameters p;
  p.fewest_objects = p.most_objects = 1;
  p.scale_min = p.scale_max = 2;
  p.light_min = p.light_max = 1;
  const Scene scene = make_scene(database, p, 5, 0);
  const PlacedObject& placed = scene.objects.at(0);
  const int x = placed.x + placed.side / 2, y = placed.y + placed.side / 2;
  for (const std::vector<double>& scales : {std::vector<double>{0.5}, {1, 0.7, 0.5}}) {
    DetectorParameters parameters;
    parameters.scales = scales;
    Detector detector(640, 480, database, parameters);
    REQUIRE(detector.run(scene.view()));
    std::vector<Detection> boxes(10);
    boxes.resize(detector.detections(0.4, boxes));
    std::vector<Detection> there;
    for (const Detection& box : boxes)
      if (box.class_id == static_cast<float>(placed.object) &&
          std::abs(box.x_px + box.width_px / 2 - static_cast<float>(x)) < 64 &&
          std::abs(box.y_px + box.height_px / 2 - static_cast<float>(y)) < 64)
        there.push_back(box);
    REQUIRE(there.size() == 1);
    CHECK(there[0].score > 0.6f);
    if (scales.size() > 1) {  // the region of interest of the first scale shows it, too
      std::vector<uint8_t> roi(37 * 27);
      detector.region_of_interest({roi.data(), 37, 27});
      CHECK(roi[static_cast<size_t>((y - 32) / 16 * 37 + (x - 32) / 16)] == 255);
    } else {
      CHECK(there[0].width_px == 128);
      CHECK(there[0].height_px == 128);
    }
  }
}

TEST_CASE(
    "object_detection: of two looks of an object at one place the better is reported; its class tells the attributes") {
  auto database = read_database(kObjects, 48, TestViews::read);
  SceneParameters p;
  p.fewest_objects = p.most_objects = 1;
  p.scale_min = p.scale_max = p.light_min = p.light_max = 1;
  const Scene scene = make_scene(database, p, 5, 0);
  const auto placed = static_cast<float>(scene.objects.at(0).object);
  const auto classes = [&] {
    Detector detector(640, 480, database, {});
    REQUIRE(detector.run(scene.view()));
    std::vector<Detection> boxes(10);
    boxes.resize(detector.detections(0.3, boxes));
    std::vector<float> classes;
    for (const Detection& box : boxes)
      if (box.class_id == placed || box.class_id == 4) classes.push_back(box.class_id);
    return classes;
  };
  // The same box again, seen less well: by one of its views.
  DatabaseObject other = database[scene.objects[0].object];
  other.views.resize(1);
  other.attributes = {{"open", "true"}};
  other.name = "another";
  database.push_back(other);
  CHECK(classes() == std::vector<float>{placed, 4});  // two objects may be in one place
  database[4].name = database[scene.objects[0].object].name;
  CHECK(classes() == std::vector<float>{placed});
}

TEST_CASE("object_detection: nothing is found outside the mask, and a mask of another image does not count") {
  Bench bench;
  auto& [node, port, pair] = bench;
  test::BoxWriter<Detections> boxes(*node->outputs()[0]);
  const auto database = read_database(kObjects, 48, TestViews::read);
  SceneParameters p;
  p.fewest_objects = p.most_objects = 1;
  p.light_min = p.light_max = 1;
  const Scene scene = make_scene(database, p, 5, 0);
  const PlacedObject& placed = scene.objects.at(0);
  bench.show(scene);
  test::Box<Image> mask(kMasks);
  mask->width = 64, mask->height = 48, mask->channels = 1;
  mask->pixels.resize(64 * 48);
  InputPort& mask_port = test::input(*node, "mask");
  const auto found = [&](int64_t stamp_ns, uint64_t sequence) {
    boxes.clear();
    test::latch(port, pair, 1000, sequence);
    test::latch(mask_port, mask, stamp_ns, sequence);
    CHECK(test::run(*node));
    REQUIRE(boxes.sent());
    CHECK(boxes.message().searched == 1.0f);
    const auto items = boxes.message().boxes.items();
    return std::any_of(items.begin(), items.end(), [&](const Detection& box) {
      return box.class_id == static_cast<float>(placed.object) &&
             std::abs(box.x_px + box.width_px / 2 - static_cast<float>(placed.x + placed.side / 2)) < 40;
    });
  };
  std::fill_n(mask->pixels.data(), 64 * 48, uint8_t{0});
  CHECK_FALSE(found(1000, 1));
  CHECK(boxes.message().boxes.size == 0);
  CHECK(found(999, 2));  // of another image
  mask->pixels[static_cast<size_t>((placed.y + placed.side / 2) / 10 * 64 + (placed.x + placed.side / 2) / 10)] = 1;
  CHECK(found(1000, 3));
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
  Bench bench({{"max_detections", int64_t{2}},
               {"min_score", 0.0},
               {"threshold_scale", 2.0},
               {"stages", std::string("ch")}});  // so that there are many
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
  CHECK(says(setup_error(kImages, {{"scales", std::string("1+0.3")}}),
             "scales are `1+0.3`, must be numbers in 0.5 .. 1"));
  CHECK(says(setup_error(kImages, {{"scales", std::string("0.7+1")}}), "falling"));
  CHECK(says(setup_error(kImages, {{"window", int64_t{48}}}), "window - 1 = 47"));
  CHECK(says(setup_error({60, 480, 3, 0}), "at most 60"));
}
