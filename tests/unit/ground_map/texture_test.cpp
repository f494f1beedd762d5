// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/texture.hpp"

#include <doctest/doctest.h>

#include <numeric>

#include "nodes/ground_map/ground_detector.hpp"
#include "nodes/ground_map/saturation_value.hpp"

using namespace takt::ground_map;
using takt::ImageView;

namespace {

struct Planes {
  int width, height;
  std::vector<uint8_t> s, v;
  Planes(int w, int h, uint8_t saturation, uint8_t value)
      : width(w), height(h), s(static_cast<size_t>(w * h), saturation), v(s.size(), value) {}
  ImageView<uint8_t> saturation() { return {s.data(), width, height}; }
  ImageView<uint8_t> value() { return {v.data(), width, height}; }
};

}  // namespace

TEST_CASE("saturation and value of plain colours") {
  CHECK(saturation_value(0, 0, 0).saturation == 0);
  CHECK(saturation_value(90, 90, 90).saturation == 0);
  CHECK(saturation_value(0, 0, 200).saturation == 255);
  CHECK(saturation_value(0, 0, 200).value == 200);
  CHECK(saturation_value(100, 150, 200).saturation == 128);  // 127.5
}

TEST_CASE("the default reference area of a 640 x 480 image is the area that t_m is meant for (C-7)") {
  const ReferenceArea area(640, 480, {});
  CHECK(area.pixels() == kDefaultAreaPx);
  CHECK(area.spans().front().y == 374);
  CHECK(area.spans().back().y == 469);  // the lowest 2 % skipped
  CHECK(area.contains(320, 420));
  CHECK_FALSE(area.contains(320, 475));
  CHECK_FALSE(area.contains(320, 370));
  CHECK(area.contains(165, 468));
  CHECK_FALSE(area.contains(165, 380));  // narrower above
}

TEST_CASE("a descriptor spans the bins with t_m pixels or more, t_m in proportion to the area") {
  const ReferenceArea area(640, 480, {}), half(320, 240, {});
  Planes planes(640, 480, 50, 120);
  for (int x = 0; x < 80; ++x) planes.saturation().at(240 + x, 400) = 90, planes.value().at(240 + x, 400) = 30;
  for (int x = 0; x < 79; ++x) planes.saturation().at(240 + x, 402) = 200, planes.value().at(240 + x, 402) = 250;
  CHECK(*describe(planes.saturation(), planes.value(), area, 80) == Descriptor{50, 90, 30, 120});
  CHECK(*describe(planes.saturation(), planes.value(), area, 79) == Descriptor{50, 200, 30, 250});

  Planes small(320, 240, 50, 120);  // a quarter of the pixels: 20 are enough
  for (int x = 0; x < 20; ++x) small.saturation().at(120 + x, 200) = 90;
  for (int x = 0; x < 19; ++x) small.saturation().at(120 + x, 202) = 200;
  CHECK(*describe(small.saturation(), small.value(), half, 80.0) == Descriptor{50, 90, 120, 120});
}

TEST_CASE("no entry where no bin is full enough") {
  const ReferenceArea area(64, 48, {});
  Planes planes(64, 48, 0, 0);
  std::iota(planes.v.begin(), planes.v.end(), uint8_t{0});
  CHECK_FALSE(describe(planes.saturation(), planes.value(), area, 24576.0 / 4).has_value());
}

TEST_CASE("oracle 13: weights of the ring are 0.6 0.8 1.0 0.2 0.4 for N_b = 5 and the newest at 2 (E-19)") {
  TextureMemory memory(5, 0.9);
  for (uint8_t i = 0; i < 8; ++i) memory.add({i, i, i, i});
  CHECK(memory.entry(2).s_min == 7);  // the newest
  const int expected[] = {3, 4, 5, 1, 2};
  for (int k = 0; k < 5; ++k) CHECK(memory.weight(k) == expected[k]);
  // Wherever the newest lies, all weights add up to (N_b + 1) / 2.
  for (int i = 0; i < 5; ++i) {
    memory.add({0, 255, 0, 255});
    int sum = 0;
    for (int k = 0; k < 5; ++k) sum += memory.weight(k);
    CHECK(sum == 15);
  }
}

TEST_CASE("before the first entry nothing is ground; the newest alone suffices; what is not seen again is forgotten") {
  TextureMemory memory(500, 0.9);
  CHECK(memory.limit() == 450);
  CHECK(memory.table()[256 * 100 + 20] == 0);
  memory.add({10, 30, 90, 110});
  CHECK(memory.sum(20, 100) == 500);
  CHECK(memory.table()[256 * 100 + 20] == 1);
  CHECK(memory.table()[256 * 100 + 31] == 0);
  for (int i = 0; i < 49; ++i) memory.add({200, 201, 200, 201});
  CHECK(memory.table()[256 * 100 + 20] == 1);  // 451
  memory.add({200, 201, 200, 201});
  CHECK(memory.sum(20, 100) == 450);
  CHECK(memory.table()[256 * 100 + 20] == 0);
  CHECK(memory.sum(200, 200) == 500 * 50 - 49 * 50 / 2);
}

TEST_CASE("the mask keeps what hangs together with the reference area along rows and columns") {
  const int w = 40, h = 30;
  const ReferenceArea area(w, h, {});
  MaskCleaner cleaner(w, h, 1);  // no averaging
  std::vector<uint8_t> raw(static_cast<size_t>(w * h)), mask(raw.size(), 7);
  const ImageView<uint8_t> r(raw.data(), w, h), m(mask.data(), w, h);
  for (int y = 20; y < 30; ++y)
    for (int x = 10; x < 30; ++x) r.at(x, y) = 1;
  r.at(9, 19) = 1;                                 // touches by a corner only
  r.at(29, 19) = r.at(30, 19) = r.at(30, 18) = 1;  // a path
  r.at(5, 5) = 1;
  cleaner.clean(r, area, m);
  CHECK(m.at(20, 25) == 255);
  CHECK(m.at(30, 18) == 255);
  CHECK(m.at(9, 19) == 0);
  CHECK(m.at(5, 5) == 0);
  CHECK(m.at(0, 29) == 0);
}

TEST_CASE("a detector learns the lower middle and finds the same colour in one piece with it") {
  const int w = 64, h = 48;
  std::vector<uint8_t> bgr(static_cast<size_t>(w * h * 3)), mask(static_cast<size_t>(w * h));
  const ImageView<uint8_t> image(bgr.data(), w, h, 3), m(mask.data(), w, h);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const bool floor = y > 20 || (y < 8 && x > 40);  // a patch of the same colour above the wall between
      image.at(x, y, 0) = floor ? 80 : 200, image.at(x, y, 1) = floor ? 110 : 120, image.at(x, y, 2) = floor ? 140 : 40;
    }
  GroundDetector detector(w, h, {});
  detector.analyse(image);
  detector.classify(m);
  CHECK(m.at(32, 40) == 0);  // nothing learnt yet
  CHECK(detector.learn());
  detector.classify(m);
  CHECK(m.at(32, 40) == 255);
  CHECK(m.at(0, 30) == 255);
  CHECK(m.at(32, 15) == 0);
  CHECK(m.at(60, 3) == 0);

  // A grey image has no saturation, and is told apart by value.
  std::vector<uint8_t> grey(mask.size(), 90);
  std::fill(grey.begin(), grey.begin() + w * 20, uint8_t{200});
  GroundDetector in_grey(w, h, {});
  in_grey.analyse(ImageView<const uint8_t>(grey.data(), w, h));
  CHECK(in_grey.learn());
  in_grey.classify(m);
  CHECK(m.at(32, 40) == 255);
  CHECK(m.at(32, 10) == 0);
}
