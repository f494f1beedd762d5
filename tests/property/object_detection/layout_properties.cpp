// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "nodes/object_detection/layout_stage.hpp"
#include "nodes/object_detection/reference.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property/object_detection/random_images.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::object_detection;
using takt::test::Random;

namespace {

std::vector<LayoutTemplate> templates(Random& random) {
  std::vector<LayoutTemplate> views(static_cast<size_t>(random.in(1, 3)));
  for (LayoutTemplate& view : views) {
    for (int16_t& weight : view.weight)
      weight = static_cast<int16_t>(random.in(-kLargestLayoutWeight, kLargestLayoutWeight));
    view.middle = random.in(-9'000'000, 9'000'000);
    view.unit = 1e-6f * static_cast<float>(random.in(1, 9));
  }
  return views;
}

}  // namespace

TEST_CASE("features of a square equal those counted pixel by pixel, in any part of an image") {
  test::on_each_target([] {
    Random random(test::seed(31));
    for (int round = 0; round < test::rounds(40); ++round) {
      const int width = random.in(20, 90), height = random.in(20, 70);
      const std::vector<uint8_t> pixels = random.image(width, height);
      const ImageView<const uint8_t> image(pixels.data(), width, height, 3);
      LayoutSums sums(width, height);
      const int part_width = random.in(8, width), part_height = random.in(8, height);
      const int x0 = random.in(0, width - part_width), y0 = random.in(0, height - part_height);
      sums.take(image, x0, y0, part_width, part_height);
      for (int k = 0; k < 4; ++k) {
        Placement at;
        at.side = random.in(kLayoutCells, std::min(part_width, part_height));
        at.x = x0 + random.in(0, part_width - at.side);
        at.y = y0 + random.in(0, part_height - at.side);
        LayoutFeatures features;
        sums.features(at, features);
        REQUIRE(features == layout_reference(image, at));
      }
    }
  });
}

TEST_CASE("the best square around a window equals trying each by itself, at the image's border too") {
  Random random(test::seed(43));
  size_t inside = 0, moved = 0;
  for (int round = 0; round < test::rounds(6); ++round) {
    constexpr int kWidth = 120, kHeight = 90, kView = 20, kWindow = 28;
    const std::vector<uint8_t> pixels = random.image(kWidth, kHeight);
    const ImageView<const uint8_t> image(pixels.data(), kWidth, kHeight, 3);
    const SearchGrid grid = make_search_grid(kWidth, kHeight, kView, kWindow);
    const std::vector<LayoutObject> objects{{templates(random), 0.5}, {templates(random), 1.0}};
    LayoutStage stage(grid, kView, objects);
    for (int k = 0; k < 6; ++k) {
      const auto window = static_cast<size_t>(k == 0 ? 0 : random.in(0, grid.windows() - 1));
      const auto squares = stage.placements(window);
      for (const Placement& at : squares)
        REQUIRE((at.x >= 0 && at.y >= 0 && at.x + at.side <= kWidth && at.y + at.side <= kHeight));
      for (size_t object = 0; object < objects.size(); ++object) {
        const LayoutStage::Fit fast = stage.best(image, window, object),
                               slow = layout_fit_reference(image, squares, objects[object].views);
        REQUIRE(fast.error == slow.error);
        REQUIRE(fast.at.x == slow.at.x);
        REQUIRE(fast.at.y == slow.at.y);
        REQUIRE(fast.at.side == slow.at.side);
        CHECK(stage.passes(object, fast) == (slow.error < objects[object].threshold));
        const Placement middle = grid.window(window);
        ++(fast.at.x + fast.at.side / 2 == middle.x + kWindow / 2 ? inside : moved);
      }
    }
  }
  CHECK(inside >= test::at_scale(1));
  CHECK(moved >= test::at_scale(1));
}
