// SPDX-License-Identifier: Apache-2.0
// The monitor on pairs whose rows are known to differ: a texture of waves, which can be sampled anywhere exactly.
#include "nodes/stereo/rectification_monitor.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

using namespace takt;
using namespace takt::stereo;

namespace {

constexpr int kWidth = 400, kHeight = 300;

class Texture {
 public:
  explicit Texture(uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> angle(0, 2 * M_PI), length_px(5, 30);
    for (Wave& wave : waves_) {
      const double direction = angle(random), frequency = 2 * M_PI / length_px(random);
      wave = {frequency * std::cos(direction), frequency * std::sin(direction), angle(random)};
    }
  }
  double at(double x, double y) const {
    double sum = 0;
    for (const Wave& wave : waves_) sum += std::sin(wave.x * x + wave.y * y + wave.phase);
    return 128 + 22 * sum;
  }

 private:
  struct Wave {
    double x, y, phase;
  };
  Wave waves_[16];
};

/// Where the point at left (x, y) stands in the right image: `down` px lower, and turned about the centre.
struct Misalignment {
  double down_px = 0, turn_rad = 0;
  double row(double x, double y) const { return y + down_px + turn_rad * (x - kWidth / 2.0); }
};

struct Pair {
  std::vector<uint8_t> left, right;
  std::vector<int16_t> disparity;
};

/// `noise`: standard deviation of the sensor, grey levels. The surface is slanted, disparities are not whole.
Pair make_pair(const Misalignment& wrong, double noise, uint32_t seed, int channels = 1) {
  const Texture texture(seed);
  std::mt19937 random(seed);
  std::normal_distribution<double> sensor(0, noise);
  const auto pixel = [&](double x, double y) {
    return static_cast<uint8_t>(std::clamp(std::lround(texture.at(x, y) + sensor(random)), 0L, 255L));
  };
  Pair pair;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double d = 18.3 + 0.02 * y;
      pair.disparity.push_back(static_cast<int16_t>(std::lround(d)));
      pair.left.insert(pair.left.end(), static_cast<size_t>(channels), pixel(x, y));
      // Left (u, v) stands at right (u - d, row(u, v)): solved for the left point of this right pixel.
      const double u = x + d, v = y - (wrong.row(u, y) - y);
      pair.right.insert(pair.right.end(), static_cast<size_t>(channels), pixel(u, v));
    }
  return pair;
}

/// Of the columns that both images have, with some around them.
double median_of_truth(const Misalignment& wrong) {
  std::vector<double> errors;
  for (int x = 30; x < kWidth - 8; ++x) errors.push_back(std::abs(wrong.row(x, 0)));
  const auto middle = errors.begin() + static_cast<ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

/// What the monitor finds after some pairs.
std::optional<double> measure(const Pair& pair, int pairs = 6, int channels = 1) {
  RectificationMonitor monitor(kWidth, kHeight, 48);
  for (int i = 0; i < pairs; ++i)
    monitor.observe({pair.left.data(), kWidth, kHeight, channels}, {pair.right.data(), kWidth, kHeight, channels},
                    {pair.disparity.data(), kWidth, kHeight});
  return monitor.row_error_px();
}

}  // namespace

TEST_CASE("a shift of the rows is found to a tenth of a pixel, with and without noise") {
  for (const double noise : {0.0, 3.0})
    for (const double down : {0.0, 0.4, 0.7, 1.5, -0.7}) {
      const auto error = measure(make_pair({down, 0}, noise, 1));
      REQUIRE(error);
      INFO("shift ", down, " px, noise ", noise, ": found ", *error);
      CHECK(std::abs(*error - std::abs(down)) < 0.1);
    }
}

TEST_CASE("a camera turned about its axis is found, alone and with a shift") {
  for (const Misalignment wrong : {Misalignment{0, 0.004}, Misalignment{0, -0.008}, Misalignment{0.7, 0.003}}) {
    const auto error = measure(make_pair(wrong, 2, 2));
    REQUIRE(error);
    INFO("found ", *error, ", true ", median_of_truth(wrong));
    CHECK(std::abs(*error - median_of_truth(wrong)) < 0.1);
  }
}

TEST_CASE("colour images give the same answer as grey ones") {
  const auto grey = measure(make_pair({0.7, 0}, 0, 3)), colour = measure(make_pair({0.7, 0}, 0, 3, 3), 6, 3);
  REQUIRE(grey);
  CHECK(grey == colour);
}

TEST_CASE("nothing is said without structure, without disparities, or where left and right show different things") {
  Pair pair = make_pair({0.7, 0}, 0, 4);
  Pair flat = pair;
  std::fill(flat.left.begin(), flat.left.end(), uint8_t{90});
  std::fill(flat.right.begin(), flat.right.end(), uint8_t{90});
  CHECK_FALSE(measure(flat));
  Pair columns = pair;  // changes along rows only
  for (size_t i = 0; i < columns.left.size(); ++i)
    columns.left[i] = columns.right[i] = static_cast<uint8_t>(128 + 90 * std::sin(static_cast<double>(i % kWidth)));
  CHECK_FALSE(measure(columns));
  Pair unmatched = pair;
  std::fill(unmatched.disparity.begin(), unmatched.disparity.end(), int16_t{-1});
  CHECK_FALSE(measure(unmatched));
  Pair strange = pair;
  strange.right = make_pair({0, 0}, 0, 5).right;
  CHECK_FALSE(measure(strange));
  std::mt19937 random(6);
  for (auto* image : {&strange.left, &strange.right})
    for (uint8_t& value : *image) value = static_cast<uint8_t>(random());
  CHECK_FALSE(measure(strange, 30));
}

TEST_CASE("places move through the image, and a new state replaces the old one") {
  const Pair good = make_pair({0, 0}, 2, 7), bad = make_pair({1.5, 0}, 2, 7);
  RectificationMonitor monitor(kWidth, kHeight, 48);
  const auto observe = [&](const Pair& pair) {
    monitor.observe({pair.left.data(), kWidth, kHeight}, {pair.right.data(), kWidth, kHeight},
                    {pair.disparity.data(), kWidth, kHeight});
    return monitor.points();
  };
  const size_t first = observe(good), second = observe(good) - first, third = observe(good) - first - second;
  CHECK((first != second || second != third));
  for (int i = 0; i < 20; ++i) observe(good);
  CHECK(monitor.points() == RectificationMonitor::kWindow);
  CHECK(*monitor.row_error_px() < 0.1);
  for (int i = 0; i < 20; ++i) observe(bad);
  CHECK(*monitor.row_error_px() == doctest::Approx(1.5).epsilon(0.07));
}

TEST_CASE("images too small for a single place are looked at in peace") {
  std::vector<uint8_t> pixels(12 * 8);
  std::vector<int16_t> disparity(12 * 8);
  RectificationMonitor monitor(12, 8, 4);
  for (int i = 0; i < 20; ++i)
    monitor.observe({pixels.data(), 12, 8}, {pixels.data(), 12, 8}, {disparity.data(), 12, 8});
  CHECK(monitor.points() == 0);
}

TEST_CASE("errors too large for matching are found as well: from the images alone, to a tenth of a pixel") {
  for (const double noise : {0.0, 3.0})
    for (const double down : {2.0, 4.0, 8.0, -8.0, 12.5}) {
      INFO("shift ", down, " px, noise ", noise);
      Pair pair = make_pair({down, 0}, noise, 8);
      const auto from_disparities = measure(pair, 40);
      REQUIRE(from_disparities);
      CHECK(std::abs(*from_disparities - std::abs(down)) < 0.1);
      std::mt19937 random(9);
      for (int16_t& d : pair.disparity) d = static_cast<int16_t>(random() % 48);  // as on rows that do not match
      const auto from_wrong_ones = measure(pair, 40);
      REQUIRE(from_wrong_ones);
      CHECK(std::abs(*from_wrong_ones - std::abs(down)) < 0.1);
      std::fill(pair.disparity.begin(), pair.disparity.end(), int16_t{-1});
      const auto from_none = measure(pair, 40);
      REQUIRE(from_none);
      CHECK(std::abs(*from_none - std::abs(down)) < 0.1);
    }
}

TEST_CASE("a camera that is knocked by many rows while the pair was good before: told within four seconds at 15 Hz") {
  const Pair good = make_pair({0, 0}, 2, 10);
  Pair bad = make_pair({8, 0}, 2, 10);
  std::fill(bad.disparity.begin(), bad.disparity.end(), int16_t{-1});
  RectificationMonitor monitor(kWidth, kHeight, 48);
  const auto observe = [&](const Pair& pair, int times) {
    for (int i = 0; i < times; ++i)
      monitor.observe({pair.left.data(), kWidth, kHeight}, {pair.right.data(), kWidth, kHeight},
                      {pair.disparity.data(), kWidth, kHeight});
    return *monitor.row_error_px();
  };
  CHECK(observe(good, 60) < 0.1);
  CHECK(observe(bad, 60) > RowErrorAlarm::kWrong);
}

TEST_CASE("each state is told once in an episode, which ends well below where it began") {
  RowErrorAlarm alarm;
  CHECK_FALSE(alarm.update(0.49));
  CHECK(alarm.update(0.51) == RowTrust::doubtful);
  CHECK_FALSE(alarm.update(0.6));
  CHECK_FALSE(alarm.update(0.45));  // not over yet
  CHECK_FALSE(alarm.update(0.55));
  CHECK(alarm.update(1.1) == RowTrust::wrong);
  CHECK_FALSE(alarm.update(0.7));
  CHECK_FALSE(alarm.update(1.2));
  CHECK_FALSE(alarm.update(0.39));
  CHECK(alarm.update(1.3) == RowTrust::wrong);
  CHECK_FALSE(alarm.update(0.7));  // it was told worse
}
