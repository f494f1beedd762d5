// SPDX-License-Identifier: Apache-2.0
// A driver of GPIO lines and the double of its chip, in virtual time.
#pragma once
#include <doctest/doctest.h>

#include "hal/gpio/chip_double.hpp"
#include "hal/gpio/gpio_lines.hpp"
#include "tests/nanoseconds.hpp"

namespace takt::gpio {

using test::kMs;
enum Offset : uint32_t { kFree, kStop, kButton, kLamp, kLids, kTrigger };

struct Bench {
  VirtualClock clock{1'000'000'000};
  ChipDouble chip{{"free", "estop", "button", "lamp", "eyelid_power", "camera_trigger"}, clock};
  GpioLines driver;

  explicit Bench(int64_t debounce_ns = 5 * kMs)
      : driver("lines",
               {.chip = "/dev/gpiochip9",
                .inputs = {"estop", "2"},
                .outputs = {"lamp"},
                .powered = {"eyelid_power"},
                .trigger = "camera_trigger",
                .debounce_ns = debounce_ns},
               chip.chip(), clock) {
    chip.set(kStop, true);
  }
  void start() {
    REQUIRE(driver.open().has_value());
    REQUIRE(driver.start(clock.now_ns()).has_value());
  }
  LinesReading read(int64_t after_ms) {
    clock.advance_to(clock.now_ns() + after_ms * kMs);
    return driver.read(clock.now_ns());
  }
};

}  // namespace takt::gpio
