// SPDX-License-Identifier: Apache-2.0
// The vectorised debayering and resampling against their definitions: equal bit for bit, for every colour filter, odd
// sizes, any table, on every SIMD target; and nothing but the image is written.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "nodes/stereo/remap.hpp"
#include "nodes/stereo/remap_reference.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::stereo;
using takt::test::on_each_target;

namespace {

constexpr uint8_t kUntouched = 0xA5;

class Dice {
 public:
  explicit Dice(uint64_t seed) : random_(seed) {}
  int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  uint8_t pixel() { return static_cast<uint8_t>(pick(0, 3) ? pick(0, 255) : 255 * pick(0, 1)); }
  uint8_t fraction() { return static_cast<uint8_t>(pick(0, 4) ? pick(0, 128) : 128 * pick(0, 1)); }

 private:
  std::mt19937 random_;
};

/// Rows with some bytes between them; none behind the last, so that sanitizers see an overrun.
struct PaddedPicture {
  int width, height, channels, stride;
  std::vector<uint8_t> bytes;
  PaddedPicture(int w, int h, int c, int gap)
      : width(w),
        height(h),
        channels(c),
        stride(w * c + gap),
        bytes(static_cast<size_t>(stride * (h - 1) + w * c), kUntouched) {}
  ImageView<uint8_t> view() { return {bytes.data(), width, height, channels, stride}; }
  void fill(Dice& dice) {
    for (int y = 0; y < height; ++y)
      for (int i = 0; i < width * channels; ++i) view().row(y)[i] = dice.pixel();
  }
};

/// Any four pixels from anywhere.
std::vector<RemapSource> wild_table(Dice& dice, int width, int height) {
  std::vector<RemapSource> table(static_cast<size_t>(width * height));
  for (RemapSource& s : table) {
    if (dice.pick(0, 9) == 0) continue;  // outside
    s = {static_cast<int16_t>(dice.pick(0, width - 2)), static_cast<int16_t>(dice.pick(0, height - 2)), dice.fraction(),
         dice.fraction()};
  }
  return table;
}

/// As a camera's: every row of the image is a slightly bent line in the source, which leaves it at the edges.
std::vector<RemapSource> smooth_table(Dice& dice, int width, int height) {
  const double slope = dice.pick(-60, 60) / 1000.0, bend = dice.pick(-40, 40) / 1e5, down = dice.pick(-9, 9) / 2.0;
  std::vector<RemapSource> table;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double u = x - width / 2.0, sx = x + bend * u * u - slope * y, sy = y + down + slope * u + bend * u * u;
      const int fx = static_cast<int>(std::lround(sx * 128)), fy = static_cast<int>(std::lround(sy * 128));
      const int x0 = fx >> 7, y0 = fy >> 7;
      if (x0 < 0 || y0 < 0 || x0 > width - 2 || y0 > height - 2) table.emplace_back();
      else
        table.push_back({static_cast<int16_t>(x0), static_cast<int16_t>(y0), static_cast<uint8_t>(fx - 128 * x0),
                         static_cast<uint8_t>(fy - 128 * y0)});
    }
  return table;
}

void expect_equal(PaddedPicture& in, BayerPattern pattern, const std::vector<RemapSource>& table, int gap) {
  const int channels = pattern == BayerPattern::none ? in.channels : 3;
  PaddedPicture colour(in.width, in.height, channels, 0), expected(in.width, in.height, channels, gap), made = expected;
  if (pattern == BayerPattern::none) colour = in;
  else reference::debayer(in.view(), pattern, colour.view());
  reference::remap(table, colour.view(), expected.view());
  const Remap remap(in.width, in.height, table);
  std::vector<int8_t> window(remap.window_bytes());
  for (int run = 0; run < 2; ++run) {  // the second finds used memory
    std::fill(made.bytes.begin(), made.bytes.end(), kUntouched);
    remap.run(in.view(), pattern, window, made.view());
    INFO(in.width, " x ", in.height, " x ", in.channels, " pattern ", static_cast<int>(pattern));
    REQUIRE(made.bytes == expected.bytes);
  }
}

constexpr BayerPattern kPatterns[] = {BayerPattern::rggb, BayerPattern::bggr, BayerPattern::grbg, BayerPattern::gbrg};

}  // namespace

TEST_CASE("grey and colour images: resampling equals the integer formula") {
  on_each_target([] {
    Dice dice(test::seed(3));
    for (int round = 0; round < test::rounds(150); ++round) {
      PaddedPicture in(dice.pick(2, 70), dice.pick(2, 40), dice.pick(0, 1) ? 3 : 1, dice.pick(0, 5));
      in.fill(dice);
      const auto table = round % 2 ? wild_table(dice, in.width, in.height) : smooth_table(dice, in.width, in.height);
      expect_equal(in, BayerPattern::none, table, dice.pick(0, 70));
    }
  });
}

TEST_CASE("mosaics: debayering and resampling in one equal one after the other, for every colour filter") {
  on_each_target([] {
    Dice dice(test::seed(4));
    for (const BayerPattern pattern : kPatterns)
      for (int round = 0; round < test::rounds(60); ++round) {
        PaddedPicture in(dice.pick(2, round % 3 ? 30 : 200), dice.pick(2, 30), 1, dice.pick(0, 5));
        in.fill(dice);
        const auto table = round % 2 ? wild_table(dice, in.width, in.height) : smooth_table(dice, in.width, in.height);
        expect_equal(in, pattern, table, dice.pick(0, 70));
      }
  });
}

TEST_CASE("a tall image passes through a window of few rows many times") {
  on_each_target([] {
    Dice dice(test::seed(5));
    for (int round = 0; round < test::rounds(8); ++round) {
      PaddedPicture in(dice.pick(60, 90), 300, 1, 0);
      in.fill(dice);
      const auto table = smooth_table(dice, in.width, in.height);
      CHECK(Remap(in.width, in.height, table).window_bytes() < static_cast<size_t>(4 * in.width * 40));
      expect_equal(in, kPatterns[round % 4], table, 0);
    }
  });
}

TEST_CASE("a table without any source gives black") {
  PaddedPicture in(20, 4, 3, 0);
  Dice dice(test::seed(6));
  in.fill(dice);
  expect_equal(in, BayerPattern::none, std::vector<RemapSource>(80), 3);
}
