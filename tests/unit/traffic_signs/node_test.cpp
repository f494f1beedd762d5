// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "nodes/traffic_signs/sign_detector.hpp"
#include "nodes/traffic_signs/sign_scenes.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/traffic_signs/signs.hpp"

namespace takt {
void register_traffic_signs(NodeTypes& types);
}

using namespace takt;
using namespace takt::traffic_signs;
using test::kSigns;

namespace {

constexpr Capacity kImages{640, 480, 3, 0};
constexpr size_t kArrowRight = 4;

std::unique_ptr<Node> make_node() {
  NodeTypes types;
  register_traffic_signs(types);
  return types.find("traffic_signs")->make();
}

/// One right arrow of 0.6 m at 4.9 m: 60 px wide. Without noise, so that a test does not depend on luck.
SignScene one_sign() {
  cv::RNG random(4);
  cv::Mat3f image(480, 640, cv::Vec3f(120, 125, 118));
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) image(y, x) += cv::Vec3f::all(static_cast<float>((x * 7 + y * 13) % 31));
  const cv::Rect2f box = draw_sign(image, SignClass::arrow_right, {300, 200, 60, 60}, random);
  SignScene scene;
  image.convertTo(scene.image, CV_8U);
  scene.signs.push_back(
      {SignClass::arrow_right, {cvRound(box.x), cvRound(box.y), cvRound(box.width), cvRound(box.height)}});
  return scene;
}

struct Bench {
  std::unique_ptr<Node> node = make_node();
  InputPort &port = test::input(*node, "pair"), &disparity_port = test::input(*node, "disparity"),
            &roi_port = test::input(*node, "roi");
  test::Box<StereoPair> pair{kImages};
  test::Box<DisparityMap> map{kImages};
  test::Box<Image> roi{{4, 4, 1, 0}};
  uint64_t sequence = 0;

  Bench() {
    PortAccess::connect(port, kImages);
    PortAccess::connect(disparity_port, kImages);
    PortAccess::connect(roi_port, {4, 4, 1, 0});
    test::set(*node, "signs", kSigns.string());
    test::set_up(*node);
    pair->width = 640, pair->height = 480, pair->channels = 3;
    pair->left.resize(640 * 480 * 3);
    map->width = 640, map->height = 480;
    map->camera = {492.8, 320, 240, 0.24};
    map->disparity.resize(640 * 480);
    for (int16_t& d : map->disparity.items()) d = 24;  // 4.928 m
    roi->width = roi->height = 4, roi->channels = 1;
    roi->pixels.resize(16);
    const SignScene scene = one_sign();
    std::copy(scene.image.datastart, scene.image.dataend, pair->left.data());
  }
  bool show(int64_t stamp) {
    test::latch(port, pair, stamp, ++sequence);
    return test::run(*node);
  }
};

}  // namespace

TEST_CASE("traffic_signs: a sign in two images in a row is given with place and crossing flag, one alone is not") {
  Bench bench;
  test::BoxWriter<Detections> boxes(*bench.node->outputs()[0]);
  test::BoxWriter<PointCloud> places(*bench.node->outputs()[1]);
  test::BoxWriter<DigitalState> crossing(*bench.node->outputs()[2]);
  CHECK_FALSE(test::run(*bench.node));  // nothing latched
  test::latch(bench.disparity_port, bench.map, 100, 1);
  REQUIRE(bench.show(100));
  CHECK(boxes.sent());
  CHECK(boxes.message().boxes.size == 0);
  CHECK(boxes.message().searched == 1.0f);
  CHECK(crossing.message().levels == 0);
  test::latch(bench.disparity_port, bench.map, 300, 2);
  REQUIRE(bench.show(300));
  CHECK(boxes.stamp_ns() == 300);
  REQUIRE(boxes.message().boxes.size == 1);
  const Detection& found = boxes.message().boxes[0];
  const Box shown = one_sign().signs[0].box;
  const Box box{static_cast<int>(found.x_px), static_cast<int>(found.y_px), static_cast<int>(found.width_px),
                static_cast<int>(found.height_px)};
  CHECK(found.class_id == static_cast<float>(kArrowRight));
  CHECK(intersection_over_union(box, shown) > 0.6);
  REQUIRE(places.message().points.size == 1);
  CHECK(places.message().points[0].z == doctest::Approx(4.928));
  CHECK(std::abs(places.message().points[0].x - (330 - 320) * 4.928f / 492.8f) < 0.1f);  // 10 px
  CHECK(crossing.message().levels == 1);
  CHECK(crossing.message().changed == 1);
  REQUIRE(bench.show(500));  // no disparity of that stamp
  REQUIRE(places.message().points.size == 1);
  CHECK(std::isnan(places.message().points[0].z));
  CHECK(crossing.message().changed == 0);
  PortAccess::held(bench.port)[0].sequence = 3;  // the same pair again
  PortAccess::set_held(bench.port, 1, false, 3);
  CHECK_FALSE(test::run(*bench.node));
}

TEST_CASE("traffic_signs: what has the wrong size, or lies outside the region of interest, does not count") {
  for (const bool by_size : {true, false}) {
    Bench bench;
    test::BoxWriter<Detections> boxes(*bench.node->outputs()[0]);
    for (int16_t& d : bench.map->disparity.items()) d = by_size ? 6 : 24;  // 19.7 m: 2.4 m wide
    for (uint8_t& pixel : bench.roi->pixels.items()) pixel = by_size ? 255 : 0;
    for (const int64_t stamp : {100, 300, 500}) {
      test::latch(bench.disparity_port, bench.map, stamp, static_cast<uint64_t>(stamp));
      test::latch(bench.roi_port, bench.roi, stamp, static_cast<uint64_t>(stamp));
      REQUIRE(bench.show(stamp));
      CHECK(boxes.message().boxes.size == 0);
    }
    test::latch(bench.port, bench.pair, 600, 10);
    CHECK(test::run(*bench.node));  // without either it is found
    test::latch(bench.port, bench.pair, 700, 11);
    CHECK(test::run(*bench.node));
    CHECK(boxes.message().boxes.size == 1);
  }
}

TEST_CASE("traffic_signs: out of time it sends what it has and says how much was searched") {
  Bench bench;
  test::BoxWriter<Detections> boxes(*bench.node->outputs()[0]);
  test::latch(bench.port, bench.pair, 100, 1);
  VirtualClock late(99'500'000);  // half a millisecond before the deadline, less than `reserve`
  Job job(late, 0, 0, 100'000'000, 0, "full");
  bench.node->run(job);
  REQUIRE(boxes.sent());
  CHECK(boxes.message().searched == 0.0f);
}

TEST_CASE("traffic_signs: the image is searched in turns where time is short, and nothing is left out") {
  SignDetector detector(640, 480, read_signs(kSigns), {});
  const SignScene scene = one_sign();
  const ImageView<const uint8_t> image(scene.image.ptr(), 640, 480, 3);
  REQUIRE(detector.run(image, {}, {}, [] { return true; }));
  const float whole = detector.searched();
  CHECK(whole == 1.0f);
  REQUIRE(detector.sightings().size() == 1);
  const Sighting all = detector.sightings()[0];
  float together = 0;
  int found = 0, turns = 0;
  for (; together < 0.999f; ++turns) {
    REQUIRE(turns < 100);
    int asked = 0;
    REQUIRE(detector.run(image, {}, {}, [&] { return asked++ < 300; }));
    together += detector.searched();
    for (const Sighting& s : detector.sightings()) found += intersection_over_union(s.box, all.box) > 0.5;
  }
  CHECK(turns > 3);
  CHECK(found >= 1);
  // Where it is expected it is found first, however short the time.
  int asked = 0;
  REQUIRE(detector.run(image, {&all, 1}, {}, [&] { return asked++ < 120; }));
  CHECK(detector.focused());
  CHECK(detector.searched() < 0.1f);
  REQUIRE(detector.sightings().size() == 1);
  CHECK(intersection_over_union(detector.sightings()[0].box, all.box) > 0.7);
  CHECK_FALSE(detector.run({scene.image.ptr(), 320, 480, 3}, {}, {}, [] { return true; }));
}

TEST_CASE("traffic_signs: what cannot work is said before start") {
  const auto error = [](const Capacity& images, const std::string& signs) -> std::string {
    const auto node = make_node();
    test::set(*node, "signs", signs);
    PortAccess::connect(test::input(*node, "pair"), images);
    try {
      test::set_up(*node);
    } catch (const SetupError& error) {
      return error.what();
    }
    return "";
  };
  const auto says = [](const std::string& error, const char* words) { return error.find(words) != std::string::npos; };
  CHECK(error(kImages, kSigns.string()).empty());
  CHECK(says(error({640, 480, 1, 0}, kSigns.string()), "must have three"));
  CHECK(says(error(kImages, "/nonexistent"), "signs.txt: cannot be read"));
  CHECK(says(error({20, 480, 3, 0}, kSigns.string()), "does not fit into an image of 20 x 480 px"));
  const test::TemporaryFolder folder;
  const auto list_error = [&](const std::string& text) {
    folder.write("signs.txt", text);
    return error(kImages, folder.path.string());
  };
  CHECK(says(list_error("# none\n"), "names no sign"));
  CHECK(says(list_error("\nobject stop\n"), "signs.txt:2: unknown word `object`"));
  CHECK(says(list_error("sign stop stop.xml red 0.2\n"), "takes NAME CASCADE COLOUR SHARE WIDTH HEIGHT"));
  CHECK(says(list_error("sign stop stop.xml red 0.2 1 1 a b\n"),
             "takes NAME CASCADE COLOUR SHARE WIDTH HEIGHT [LAYOUT]"));
  CHECK(says(list_error("sign light l.xml any 0 1 1 l.layout\n"), "a layout needs a colour other than any"));
  CHECK(says(list_error("sign stop stop.xml green 0.2 1 1\n"), "valid are any, red, yellow, blue"));
  CHECK(says(list_error("sign stop stop.xml red 2 1 1\n"), "must lie in 0..1"));
  CHECK(says(list_error("sign stop stop.xml red 0.2 1 1\n"), "stop.xml: cannot be read"));
}
