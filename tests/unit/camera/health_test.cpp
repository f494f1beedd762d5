// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/health.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "rt/msg/image.hpp"
#include "rt/msg/image_view.hpp"

using namespace takt;

namespace {

constexpr int kWidth = 64, kHeight = 48;

struct Frame {
  std::vector<uint8_t> bytes = std::vector<uint8_t>(kWidth * kHeight * 3);
  ImageView<uint8_t> view{bytes.data(), kWidth, kHeight, 3};
  template <class F>
  explicit Frame(F level) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int c = 0; c < 3; ++c) view.at(x, y, c) = static_cast<uint8_t>(level(x, y));
      }
    }
  }
  HealthReading judge(std::vector<uint8_t>& previous, bool has_previous, int step = 4) {
    HealthThresholds t;
    t.step_px = step;
    previous.resize(static_cast<size_t>(health_samples(kWidth, kHeight, step)));
    return assess_health(view, t, previous, has_previous);
  }
};

int texture(int x, int y) { return 60 + (x * 37 + y * 91) % 130; }

}  // namespace

TEST_CASE("a textured frame is healthy, and its repetition is not") {
  std::vector<uint8_t> previous;
  Frame frame(texture);
  CHECK(frame.judge(previous, false).flags == 0);
  CHECK(frame.judge(previous, true).flags == image_health::unchanging);
  Frame other([](int x, int y) { return texture(x + 1, y); });
  CHECK(other.judge(previous, true).flags == 0);
}

TEST_CASE("each fault sets its own bit") {
  std::vector<uint8_t> previous;
  Frame bright([](int x, int y) { return y < kHeight / 4 ? 255 : texture(x, y); });
  CHECK(bright.judge(previous, false).flags == image_health::saturated);
  Frame dark([](int x, int y) { return texture(x, y) / 12; });
  CHECK((dark.judge(previous, false).flags & image_health::dark) != 0);
  Frame flat([](int, int y) { return 100 + y; });
  CHECK(flat.judge(previous, false).flags == image_health::blurred);
}

TEST_CASE("the thresholds are exact") {
  std::vector<uint8_t> previous;
  Frame half([](int x, int) { return x % 2 == 0 ? 0 : 40; });
  // With step 1 all columns but the outermost are sampled: 31 of 62 are 40, and every central difference is zero.
  const HealthReading reading = half.judge(previous, false, 1);
  CHECK(reading.mean_level == doctest::Approx(20.0));
  CHECK(reading.mean_gradient == 0.0);
  CHECK((reading.flags & image_health::dark) == 0);
}

TEST_CASE("sampling agrees with the number of samples that was announced") {
  for (int width = 1; width < 40; ++width) {
    for (int step = 1; step < 9; ++step) {
      int count = 0;
      for (int y = 0; y < 7; y += step) {
        for (int x = 1; x < width - 1; x += step) ++count;
      }
      CHECK(health_samples(width, 7, step) == count);
    }
  }
}
