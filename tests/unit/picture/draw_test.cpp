// SPDX-License-Identifier: Apache-2.0
#include "nodes/picture/draw.hpp"

#include <doctest/doctest.h>

#include <array>
#include <vector>

#include "rt/msg/ace/detections.hpp"
#include "rt/msg/point.hpp"
#include "rt/node.hpp"

namespace takt {
void register_picture(NodeTypes& types);
}

using namespace takt::picture;
using takt::Colour;

namespace {

struct DrawnImage {
  int width, height;
  std::vector<uint8_t> bytes;
  DrawnImage(int w, int h) : width(w), height(h), bytes(static_cast<size_t>(w * h * 3), 1) {}
  Bgr view() { return {bytes.data(), width, height, 3}; }
  std::array<int, 3> at(int x, int y) { return {view().at(x, y, 0), view().at(x, y, 1), view().at(x, y, 2)}; }
};

}  // namespace

TEST_CASE("heat runs from blue over green to red and clamps") {
  CHECK(heat(0).b > heat(0).r);
  CHECK(heat(0.5).g == 255);
  CHECK(heat(1).r > heat(1).b);
  CHECK(heat(-3).b == heat(0).b);
  CHECK(heat(7).r == heat(1).r);
}

TEST_CASE("disparity: invalid is black, near is red, far is blue") {
  const std::vector<int16_t> map{-1, 0, 9, 9};
  DrawnImage image(2, 2);
  draw_disparity({map.data(), 2, 2}, 10, image.view());
  CHECK(image.at(0, 0) == std::array{0, 0, 0});
  CHECK(image.at(1, 0)[0] > image.at(1, 0)[2]);
  CHECK(image.at(0, 1)[2] > image.at(0, 1)[0]);
}

TEST_CASE("grid: row 0 lies at the bottom; unknown grey, free white, occupied black") {
  const std::vector<int16_t> cells{-1, 0, 1000, 500};
  DrawnImage image(6, 6);
  draw_grid({cells.data(), 2, 2}, 3, image.view());
  CHECK(image.at(0, 5) == std::array{128, 128, 128});
  CHECK(image.at(5, 3) == std::array{255, 255, 255});
  CHECK(image.at(2, 2) == std::array{0, 0, 0});
  CHECK(image.at(3, 0)[0] > 100);
  CHECK(image.at(3, 0)[0] < 155);
}

TEST_CASE("image: one channel is grey, three are kept") {
  const std::vector<uint8_t> grey{7, 200}, colour{1, 2, 3, 4, 5, 6};
  DrawnImage image(2, 1);
  draw_image({grey.data(), 2, 1}, image.view());
  CHECK(image.at(1, 0) == std::array{200, 200, 200});
  draw_image({colour.data(), 2, 1, 3}, image.view());
  CHECK(image.at(0, 0) == std::array{1, 2, 3});
  CHECK(image.at(1, 0) == std::array{4, 5, 6});
}

TEST_CASE("mask: ground is tinted, its border inside the image is plain green, the rest is untouched") {
  std::vector<uint8_t> mask(10 * 10, 0);
  for (int y = 4; y < 10; ++y)
    for (int x = 0; x < 10; ++x) mask[static_cast<size_t>(10 * y + x)] = 255;
  DrawnImage image(10, 10);
  for (auto& byte : image.bytes) byte = 100;
  draw_mask({mask.data(), 10, 10}, image.view());
  for (int x = 0; x < 10; ++x) {
    CHECK(image.at(x, 3) == std::array{100, 100, 100});
    CHECK(image.at(x, 4) == std::array{0, 220, 0});
    CHECK(image.at(x, 9) == std::array{50, 160, 50});
  }
}

TEST_CASE("detections: a frame and a number in the colour of the class; what lies outside is cut off") {
  const std::vector<takt::Detection> boxes{
      {0, 20, 30, 40, 50, 0.9f}, {1, 190, 190, 40, 40, 0.9f}, {2, -90, -90, 9, 9, 1}};
  DrawnImage image(200, 200);
  draw_detections(boxes, image.view());
  const auto frame = image.at(20, 55);
  CHECK(frame != std::array{1, 1, 1});
  CHECK(image.at(40, 30) == frame);
  CHECK(image.at(190, 195) != frame);
  CHECK(image.at(190, 195) != std::array{1, 1, 1});
  CHECK(image.at(45, 65) == std::array{1, 1, 1});  // inside
  CHECK(image.at(80, 100) == std::array{1, 1, 1});
  int number = 0;
  for (int y = 34; y < 52; ++y)
    for (int x = 24; x < 38; ++x) number += image.at(x, y) == frame;
  CHECK(number > 10);
}

TEST_CASE("track: forward is up, unmeasured parts are red, any length and place fits") {
  std::vector<TrackPoint> track{{0, 0}, {0, 10}, {5, 10, false}};
  DrawnImage image(200, 200);
  CHECK(draw_track(track, image.view()) == 10);
  int blue_rows = 0, red = 0, lowest_red = 0;
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x) {
      blue_rows += image.at(x, y) == std::array{160, 60, 0};
      if (image.at(x, y) == std::array{0, 0, 220}) ++red, lowest_red = y;
    }
  CHECK(blue_rows > 100);
  CHECK(red > 30);
  CHECK(lowest_red < 100);
  CHECK(draw_track({}, image.view()) > 0);
  for (auto& p : track) p.right_m += 1e5, p.forward_m *= 1e4;
  CHECK(draw_track(track, image.view()) >= 1000);
}

TEST_CASE("the node type registers; every input is optional") {
  takt::NodeTypes types;
  takt::register_picture(types);
  const auto* type = types.find("picture");
  REQUIRE(type);
  const auto node = type->make();
  REQUIRE(node->inputs().size() == 14);  // with control
  for (const auto* input : node->inputs()) CHECK(input->need() == takt::Need::optional);
  CHECK(node->outputs().empty());
}
