// SPDX-License-Identifier: Apache-2.0
#include "nodes/picture/draw.hpp"

#include <doctest/doctest.h>

#include <array>
#include <vector>

#include "rt/node.hpp"

namespace takt {
void register_picture(NodeTypes& types);
}

using namespace takt::picture;
using takt::Colour;

namespace {

struct Image {
  int width, height;
  std::vector<uint8_t> bytes;
  Image(int w, int h) : width(w), height(h), bytes(static_cast<size_t>(w * h * 3), 1) {}
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
  Image image(2, 2);
  draw_disparity({map.data(), 2, 2}, 10, image.view());
  CHECK(image.at(0, 0) == std::array{0, 0, 0});
  CHECK(image.at(1, 0)[0] > image.at(1, 0)[2]);
  CHECK(image.at(0, 1)[2] > image.at(0, 1)[0]);
}

TEST_CASE("grid: row 0 lies at the bottom; unknown grey, free white, occupied black") {
  const std::vector<int16_t> cells{-1, 0, 1000, 500};
  Image image(6, 6);
  draw_grid({cells.data(), 2, 2}, 3, image.view());
  CHECK(image.at(0, 5) == std::array{128, 128, 128});
  CHECK(image.at(5, 3) == std::array{255, 255, 255});
  CHECK(image.at(2, 2) == std::array{0, 0, 0});
  CHECK(image.at(3, 0)[0] > 100);
  CHECK(image.at(3, 0)[0] < 155);
}

TEST_CASE("track: forward is up, unmeasured parts are red, any length and place fits") {
  std::vector<TrackPoint> track{{0, 0}, {0, 10}, {5, 10, false}};
  Image image(200, 200);
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
  REQUIRE(node->inputs().size() == 5);
  for (const auto* input : node->inputs()) CHECK(input->need() == takt::Need::optional);
  CHECK(node->outputs().empty());
}
