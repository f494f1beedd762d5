// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/confidence.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "nodes/ground_map/ground_detector.hpp"

using namespace takt;
using namespace takt::ground_map;

TEST_CASE("nothing is doubtful before anything is ground, but what floods the sensor") {
  const ConfidenceTable table({});
  CHECK(table.table()[256 * 120 + 40] == kSure);
  CHECK(table.table()[256 * 249 + 40] == kSure);
  CHECK(table.table()[256 * 250] == DoubtParameters{}.doubtful);
}

TEST_CASE("the shade of ground, and lit ground beside shade, are doubtful; other saturations and lights are not") {
  std::vector<uint8_t> ground(256 * 256);
  ground[256 * 150 + 80] = 1;
  DoubtParameters p;
  p.shade_deepest = 0.4;
  p.shade_faintest = 0.8;
  p.shade_saturation = 10;
  ConfidenceTable table(p);
  table.rebuild(ground.data());
  const auto at = [&](int s, int v) { return table.table()[256 * v + s]; };
  CHECK(at(80, 150) == kSure);       // ground itself
  CHECK(at(80, 120) == p.doubtful);  // 0.8 of its light
  CHECK(at(80, 121) == kSure);       // hardly darker
  CHECK(at(80, 60) == p.doubtful);   // 0.4
  CHECK(at(80, 59) == kSure);        // too dark for a shadow
  CHECK(at(90, 100) == p.doubtful);
  CHECK(at(91, 100) == kSure);  // another colour
  CHECK(at(69, 100) == kSure);
  CHECK(at(80, 188) == p.doubtful);  // the shade was learnt, and this is the sun
  CHECK(at(80, 187) == kSure);
  CHECK(at(80, 249) == p.doubtful);
}

TEST_CASE("a detector doubts the shadow on its floor and not the wall") {
  constexpr int kWidth = 64, kHeight = 48;
  std::vector<uint8_t> bgr(kWidth * kHeight * 3), mask(kWidth * kHeight);
  const ImageView<uint8_t> image(bgr.data(), kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const uint8_t sun[] = {80, 110, 140}, shade[] = {40, 55, 70}, wall[] = {200, 120, 40},
                    flooded[] = {255, 255, 255};
      const uint8_t* colour = y >= 30 ? sun : y >= 20 ? (x < 32 ? shade : wall) : flooded;
      std::copy_n(colour, 3, &image.at(x, y));
    }
  GroundDetector detector(kWidth, kHeight, {});
  detector.analyse(image);
  detector.learn();
  detector.classify({mask.data(), kWidth, kHeight});
  const Confidence confidence = detector.confidence();
  CHECK(mask[40 * kWidth + 10] == 255);
  CHECK(mask[25 * kWidth + 10] == 0);
  CHECK(confidence.at(10, 40) == kSure);
  CHECK(confidence.at(10, 25) == DoubtParameters{}.doubtful);
  CHECK(confidence.at(50, 25) == kSure);
  CHECK(confidence.at(10, 10) == DoubtParameters{}.doubtful);
}
