// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/histogram.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

using namespace takt;
using namespace takt::object_detection;

namespace {

constexpr ColourBins kBoth[] = {ColourBins::hsv_64x32x2, ColourBins::hsv_64x64x1};

/// A row of single-colour pixels.
struct Row {
  std::vector<uint8_t> bytes;
  void add(int count, uint8_t b, uint8_t g, uint8_t r) {
    for (int i = 0; i < count; ++i)
      for (const uint8_t value : {b, g, r}) bytes.push_back(value);
  }
  Histogram histogram(ColourBins bins = ColourBins::hsv_64x64x1) const {
    return colour_histogram({bytes.data(), static_cast<int>(bytes.size() / 3), 1, 3}, bins);
  }
};

}  // namespace

TEST_CASE("colour bins of colours whose hue, saturation and value are plain") {
  struct Known {
    uint8_t b, g, r;
    double hue_sixths, saturation;
    int value;
  };
  for (const ColourBins bins : kBoth) {
    const BinSplit n = split_of(bins);
    CHECK(n.hue * n.saturation * n.value == kColourBins);
    for (const Known& k : {Known{0, 0, 255, 0, 1, 255},
                           {0, 255, 255, 1, 1, 255},
                           {0, 255, 0, 2, 1, 255},
                           {255, 255, 0, 3, 1, 255},
                           {255, 0, 0, 4, 1, 255},
                           {255, 0, 255, 5, 1, 255},
                           {0, 0, 0, 0, 0, 0},
                           {127, 127, 127, 0, 0, 127},
                           {128, 128, 128, 0, 0, 128},
                           {50, 50, 100, 0, 0.5, 100},
                           {51, 50, 100, 5.98, 0.5, 100},
                           {100, 50, 50, 4, 0.5, 100}}) {
      const int h = static_cast<int>(n.hue * k.hue_sixths / 6),
                s = std::min(n.saturation - 1, static_cast<int>(n.saturation * k.saturation)),
                v = k.value * n.value / 256;
      CHECK(colour_bin(k.b, k.g, k.r, bins) == (h * n.saturation + s) * n.value + v);
    }
  }
}

TEST_CASE("light alone moves a colour only along value") {
  const BinSplit n = split_of(ColourBins::hsv_64x32x2);
  const uint16_t bright = colour_bin(40, 80, 240, ColourBins::hsv_64x32x2),
                 dark = colour_bin(20, 40, 120, ColourBins::hsv_64x32x2);
  CHECK(bright != dark);
  CHECK(bright / n.value == dark / n.value);
  CHECK(colour_bin(40, 80, 240, ColourBins::hsv_64x64x1) == colour_bin(20, 40, 120, ColourBins::hsv_64x64x1));
}

TEST_CASE("a reference's background is not counted, a black object pixel stored as (1, 1, 1) is") {
  Row row;
  row.add(5, 0, 0, 0);
  row.add(3, 1, 1, 1);
  row.add(2, 0, 0, 200);
  const Histogram h = row.histogram();
  CHECK(h.mass == 5);
  CHECK(h.count[colour_bin(1, 1, 1, ColourBins::hsv_64x64x1)] == 3);
  CHECK(h.count[colour_bin(0, 0, 200, ColourBins::hsv_64x64x1)] == 2);
}

TEST_CASE("oracle 11: the error of a histogram with itself is 0, with an empty window the mass, normalised 1") {
  Row row;
  row.add(30, 0, 0, 200);
  row.add(12, 0, 180, 10);
  const Histogram h = row.histogram();
  const Histogram empty{std::vector<uint32_t>(kColourBins), 0};
  CHECK(missing_mass(h.count, h.count) == 0);
  CHECK(intersection_error(h, h) == 0);
  CHECK(missing_mass(empty.count, h.count) == 42);
  CHECK(intersection_error(empty, h) == 1);
}

TEST_CASE("clutter in the window costs nothing; what lacks counts as a share of the reference") {
  Row reference, window;
  reference.add(40, 0, 0, 200);
  reference.add(10, 200, 0, 0);
  window.add(30, 0, 0, 200);
  window.add(500, 90, 130, 60);
  CHECK(missing_mass(window.histogram().count, reference.histogram().count) == 20);
  CHECK(intersection_error(window.histogram(), reference.histogram()) == doctest::Approx(0.4));
}

TEST_CASE("automatic threshold: 1.25 times the 90 % quantile over all pairs, the tolerance on top, capped") {
  // Views with k blue pixels and 100 - k red ones: the error of view i against view k is |k_i - k_k| / 100.
  const auto views = [](std::initializer_list<int> blue) {
    std::vector<Histogram> out;
    for (const int k : blue) {
      Row row;
      row.add(k, 200, 0, 0);
      row.add(100 - k, 0, 0, 200);
      out.push_back(row.histogram());
    }
    return out;
  };
  CHECK(automatic_threshold(views({10, 20, 40}), 0, 0.75) == doctest::Approx(1.25 * 0.30));  // 6 pairs: rank 6 of 6
  CHECK(automatic_threshold(views({10, 10, 10}), 0, 0.75) == 0);
  CHECK(automatic_threshold(views({10, 10, 10}), 0.36, 0.75) == doctest::Approx(0.36));
  CHECK(automatic_threshold(views({0, 90}), 0, 0.75) == 0.75);
  CHECK(automatic_threshold(views({10, 20, 40}), 0.6, 0.75) == 0.75);
  CHECK(automatic_threshold(views({10}), 0, 0.75) == 0.75);
  // 5 views, 20 pairs: the rank is 18; only the two largest errors, of the pair 0 and 50, lie above it.
  CHECK(automatic_threshold(views({0, 2, 4, 6, 50}), 0, 0.75) == doctest::Approx(1.25 * 0.48));
}

TEST_CASE("oracle 9: a vertical step edge has one orientation, a horizontal one another, and so have the diagonals") {
  constexpr int kSide = 16;
  const OrientationBins bins(360);
  const auto orientations = [&](auto is_bright) {
    std::vector<uint8_t> pixels;
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) pixels.insert(pixels.end(), 3, is_bright(x, y) ? uint8_t{200} : uint8_t{50});
    return orientation_histogram({pixels.data(), kSide, kSide, 3}, bins);
  };
  const auto only = [](const Histogram& h, size_t bin) { return h.mass > 0 && h.count[bin] == h.mass; };
  CHECK(only(orientations([](int x, int) { return x >= 8; }), 0));
  CHECK(only(orientations([](int x, int) { return x < 8; }), 180));
  CHECK(only(orientations([](int, int y) { return y >= 8; }), 90));
  CHECK(only(orientations([](int, int y) { return y < 8; }), 270));
  CHECK(only(orientations([](int x, int y) { return x + y >= 16; }), 45));
  CHECK(orientations([](int x, int) { return x >= 8; }).mass == 2 * (kSide - 2));
  CHECK(orientations([](int, int) { return true; }).mass == 0);
}

TEST_CASE("the edge between an object and its background is none of the object's") {
  std::vector<uint8_t> pixels(3 * 16 * 16);
  for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = i / 3 % 16 < 8 ? 0 : 200;
  CHECK(orientation_histogram({pixels.data(), 16, 16, 3}, OrientationBins(360)).mass == 0);
}

TEST_CASE("oracle 10: neighbours in a uniform square, and the sizes of the rings") {
  constexpr int kSide = 64;
  const std::vector<uint8_t> pixels(3 * kSide * kSide, 90);
  const Histogram h = cooccurrence_histogram({pixels.data(), kSide, kSide, 3}, {});
  const size_t first = pair_bin(1, 1, 1, 20, 25);  // dark grey with itself
  const int w = kSide;
  CHECK(2 * h.count[first] == static_cast<uint32_t>(2 * (2 * w * w - w - w) + 4 * (w - 1) * (w - 1)));
  // A single pixel of another colour in the middle has each ring of a wide enough square to itself.
  std::vector<uint8_t> dotted = pixels;
  for (size_t c = 0; c < 3; ++c) dotted[3 * (32 * kSide + 32) + c] = 255;
  const Histogram one = cooccurrence_histogram({dotted.data(), kSide, kSide, 3}, {});
  constexpr uint32_t kRings[] = {8,  12, 16,  32,  28,  40,  40,  48,  68,  56,  72,  68, 88,
                                 88, 84, 112, 112, 112, 116, 112, 144, 140, 144, 144, 168};
  for (int k = 1; k <= 25; ++k) CHECK(one.count[pair_bin(1, 3, k, 20, 25)] == kRings[k - 1]);
}

TEST_CASE("background takes part in no pair") {
  std::vector<uint8_t> pixels(3 * 8 * 8);
  const auto mass = [&] { return cooccurrence_histogram({pixels.data(), 8, 8, 3}, {}).mass; };
  CHECK(mass() == 0);
  pixels[0] = 9;
  CHECK(mass() == 0);
  pixels[3] = 9;
  CHECK(mass() == 1);
}

TEST_CASE("the few colours: black, greys by brightness, hues") {
  CHECK(pair_colour(0, 0, 38, 20) == 0);
  CHECK(pair_colour(0, 0, 39, 20) == 4);
  CHECK(pair_colour(100, 100, 114, 20) == 1);
  CHECK(pair_colour(100, 100, 115, 20) == 2);
  CHECK(pair_colour(203, 203, 203, 20) == 2);
  CHECK(pair_colour(204, 204, 204, 20) == 3);
  CHECK(pair_colour(1, 0, 255, 20) == 19);
  CHECK(pair_colour(0, 0, 50, 5) == 0);
  CHECK(pair_colour(90, 90, 100, 5) == 1);
  CHECK(pair_colour(0, 200, 0, 5) == 3);
  CHECK(pair_colour(200, 0, 0, 5) == 4);
}

TEST_CASE("orientations that cannot be told apart evenly are refused") {
  CHECK_THROWS_AS(OrientationBins(10), std::invalid_argument);
  CHECK_THROWS_AS(OrientationBins(364), std::invalid_argument);
}
