// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "nodes/object_detection/colour_stage.hpp"
#include "nodes/object_detection/reference.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property/object_detection/random_images.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::object_detection;
using takt::test::on_each_target;
using takt::test::Random;

namespace {

constexpr ColourBins kBoth[] = {ColourBins::hsv_64x32x2, ColourBins::hsv_64x64x1};

/// References cut out of the image itself and, so that some bins are found nowhere, out of another one.
std::vector<std::vector<Histogram>> references(Random& random, const std::vector<uint8_t>& image, int width, int height,
                                               int side, ColourBins bins) {
  std::vector<std::vector<Histogram>> objects(static_cast<size_t>(random.in(1, 4)));
  const std::vector<uint8_t> other = random.image(width, height);
  for (auto& views : objects)
    for (int k = random.in(1, 5); k > 0; --k) {
      const ImageView<const uint8_t> from(random.in(0, 2) ? image.data() : other.data(), width, height, 3);
      const int x = random.in(0, width - side), y = random.in(0, height - side);
      Histogram view = colour_histogram({&from.at(x, y), side, side, 3, from.stride}, bins);
      if (view.mass == 0) view.count[5] = view.mass = 1;
      views.push_back(std::move(view));
    }
  return objects;
}

}  // namespace

TEST_CASE("all 16.7 million colours get the same bin from the vectorised form, with each SIMD target") {
  std::vector<uint8_t> colours(3 * 65536);
  std::vector<uint16_t> fast(65536);
  for (const ColourBins bins : kBoth) {
    for (int blue = 0; blue < 256; ++blue) {
      for (size_t i = 0; i < 65536; ++i) {
        colours[3 * i] = static_cast<uint8_t>(blue);
        colours[3 * i + 1] = static_cast<uint8_t>(i >> 8);
        colours[3 * i + 2] = static_cast<uint8_t>(i);
      }
      std::vector<uint16_t> slow;
      for (size_t i = 0; i < 65536; ++i)
        slow.push_back(colour_bin(colours[3 * i], colours[3 * i + 1], colours[3 * i + 2], bins));
      on_each_target([&] {
        colour_bins(colours.data(), 65535, bins, fast.data());  // an odd length: the rest is done one by one
        fast[65535] = slow[65535];
        REQUIRE(fast == slow);
      });
    }
  }
}

TEST_CASE("fewer bins are neighbours of the many taken together") {
  Random random(test::seed(7));
  std::vector<uint8_t> colours(3 * 20000);
  for (uint8_t& value : colours) value = random.byte();
  std::vector<uint16_t> many(20000), few(20000);
  colour_bins(colours.data(), many.size(), ColourBins::hsv_64x64x1, many.data());
  for (const ColourBins bins : {ColourBins::hsv_32x32x1, ColourBins::hsv_16x16x1, ColourBins::hsv_8x4x1}) {
    const BinSplit split = split_of(bins);
    const int hues = 64 / split.hue, saturations = 64 / split.saturation;
    on_each_target([&] {
      colour_bins(colours.data(), few.size(), bins, few.data());
      for (size_t i = 0; i < few.size(); ++i)
        REQUIRE(few[i] == many[i] / 64 / hues * split.saturation + many[i] % 64 / saturations);
    });
  }
}

TEST_CASE("the colour stage equals counting and comparing everything, for any grid, with each SIMD target") {
  Random random(test::seed(11));
  for (int round = 0; round < test::rounds(60); ++round) {
    const int window = random.in(5, 70), reference = random.in(std::max(1, window / 3), window - 1);
    const int width = random.in(window, 150), height = random.in(window, 130);
    const ColourBins bins = kBoth[round % 2];
    CAPTURE(width);
    CAPTURE(height);
    CAPTURE(window);
    CAPTURE(reference);
    const SearchGrid grid = make_search_grid(width, height, reference, window);
    if (grid.windows() > 2500) continue;  // the slow form would take minutes
    const std::vector<uint8_t> first = random.image(width, height), second = random.image(width, height);
    const auto objects = references(random, first, width, height, reference, bins);
    ColourStage stage(grid, bins, objects);
    for (const auto* image : {&first, &second}) {  // the second run must not remember the first
      const ImageView<const uint8_t> view(image->data(), width, height, 3);
      const auto slow = colour_stage_reference(grid, bins, objects, view);
      on_each_target([&] {
        stage.run(view);
        REQUIRE(std::equal(slow.begin(), slow.end(), stage.missing().begin(), stage.missing().end()));
      });
    }
  }
}

TEST_CASE("in portions: the searched rows of windows equal the reference, from any row on, the others say so") {
  Random random(test::seed(23));
  for (int round = 0; round < test::rounds(40); ++round) {
    const int window = random.in(5, 40), reference = random.in(std::max(1, window / 3), window - 1);
    const int width = random.in(window, 120), height = random.in(window, 120);
    const SearchGrid grid = make_search_grid(width, height, reference, window);
    if (grid.windows() > 1500) continue;
    const std::vector<uint8_t> image = random.image(width, height);
    const ImageView<const uint8_t> view(image.data(), width, height, 3);
    const ColourBins bins = kBoth[round % 2];
    const auto objects = references(random, image, width, height, reference, bins);
    ColourStage stage(grid, bins, objects);
    const auto slow = colour_stage_reference(grid, bins, objects, view);
    const int first = random.in(0, grid.rows - 1), searched = random.in(0, grid.rows);
    stage.begin(view, first);
    for (int i = 0; i < searched; ++i) stage.search_row();
    const size_t row_size = static_cast<size_t>(grid.columns) * stage.references();
    for (int row = 0; row < grid.rows; ++row) {
      const bool done = (row - first + grid.rows) % grid.rows < searched;
      for (size_t i = 0; i < row_size; ++i) {
        const size_t at = static_cast<size_t>(row) * row_size + i;
        REQUIRE(stage.missing()[at] == (done ? slow[at] : ColourStage::kNotSearched));
      }
    }
  }
}

TEST_CASE("the same at the size of the camera: 37 x 27 windows of 64 px over 640 x 480") {
  Random random(test::seed(5));
  const SearchGrid grid = make_search_grid(640, 480, 48, 64);
  const std::vector<uint8_t> image = random.image(640, 480);
  const ImageView<const uint8_t> view(image.data(), 640, 480, 3);
  for (const ColourBins bins : kBoth) {
    const auto objects = references(random, image, 640, 480, 48, bins);
    ColourStage stage(grid, bins, objects);
    stage.run(view);
    const auto slow = colour_stage_reference(grid, bins, objects, view);
    CHECK(slow.size() == 999 * stage.references());
    CHECK(std::equal(slow.begin(), slow.end(), stage.missing().begin(), stage.missing().end()));
  }
}
