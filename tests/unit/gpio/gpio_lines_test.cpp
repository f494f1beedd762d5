// SPDX-License-Identifier: Apache-2.0
// The driver of GPIO lines against a double of the chip, call by call, in virtual time.
#include <doctest/doctest.h>

#include <random>

#include "tests/unit/gpio/bench.hpp"

using namespace takt;
using namespace takt::gpio;

using test::kMs;

TEST_CASE("gpio lines: a stop counts at once, its release only when it lasts") {
  Bench bench;
  bench.start();
  CHECK((bench.read(1).levels & 1) == 1);
  bench.chip.set(kStop, false);
  const int64_t pressed_ns = bench.clock.now_ns();
  const LinesReading pressed = bench.read(3);
  CHECK((pressed.levels & 1) == 0);
  CHECK(pressed.changed == 1);
  CHECK(pressed.edge_ns == pressed_ns);  // the kernel's, not the read's
  bench.chip.set(kStop, true);
  CHECK((bench.read(4).levels & 1) == 0);
  bench.chip.set(kStop, false);  // bounces
  bench.chip.set(kStop, true);
  CHECK((bench.read(4).levels & 1) == 0);
  const LinesReading released = bench.read(1);
  CHECK((released.levels & 1) == 1);
  CHECK(released.changed == 1);
}

TEST_CASE("gpio lines: a pulse between two reads is kept, however many edges the kernel lost") {
  Bench bench;
  bench.start();
  bench.read(10);
  bench.chip.set(kStop, false);
  bench.clock.advance_to(bench.clock.now_ns() + kMs);
  bench.chip.set(kStop, true);
  const LinesReading shortly = bench.read(20);
  CHECK(shortly.changed == 1);
  CHECK((shortly.levels & 1) == 1);
  for (int k = 0; k < 1001; ++k) bench.chip.set(kStop, k % 2 == 1);
  const LinesReading after = bench.read(20);
  CHECK(after.changed == 1);
  CHECK((after.levels & 1) == 0);
}

TEST_CASE("gpio lines: outputs, power from start to stop, one trigger pulse per read") {
  Bench bench;
  CHECK_FALSE(bench.driver.write(2, true, 0));  // not open
  bench.start();
  CHECK(bench.driver.count() == 5);
  CHECK(bench.chip.level(kLids));
  CHECK_FALSE(bench.chip.level(kLamp));
  CHECK(bench.driver.write(2, true, 0));
  CHECK(bench.chip.level(kLamp));
  CHECK_FALSE(bench.driver.write(0, true, 0));   // an input
  CHECK_FALSE(bench.driver.write(3, false, 0));  // the device's own
  CHECK_FALSE(bench.driver.write(9, true, 0));
  for (int k = 0; k < 3; ++k) CHECK(bench.read(66).levels == 0b01101u);  // stop free, lamp, eyelid power
  CHECK(bench.chip.rises(kTrigger) == 3);
  CHECK_FALSE(bench.chip.level(kTrigger));
  CHECK(bench.driver.pulses() == 3);
  CHECK(bench.driver.pulse_stamp_ns() == bench.clock.now_ns());
  bench.driver.stop();
  CHECK_FALSE(bench.chip.level(kLids));
  CHECK_FALSE(bench.chip.level(kLamp));
}

TEST_CASE("gpio lines: a chip that goes is a loss, and comes back with its lines") {
  Bench bench;
  bench.start();
  bench.chip.misbehave(Misbehaviour::unplugged);
  CHECK(bench.read(10).status == ReadStatus::disconnected);
  CHECK_FALSE(bench.driver.restart(bench.clock.now_ns()));
  bench.chip.misbehave(Misbehaviour::none);
  bench.chip.set(kStop, false);
  CHECK(bench.driver.restart(bench.clock.now_ns()));
  CHECK(bench.chip.level(kLids));
  const LinesReading reading = bench.read(10);
  CHECK(reading.status == ReadStatus::ok);
  CHECK((reading.levels & 1) == 0);
}

TEST_CASE("gpio lines: a source's pulse is seen with its own stamp; frozen lines stay") {
  VirtualClock clock(1'000'000'000);
  const auto pressed = [](int64_t at_ns) { return at_ns / kMs >= 1050 && at_ns / kMs < 1053; };
  ChipDouble chip({"estop", "button"}, clock, [&](int64_t at_ns) { return pressed(at_ns) ? 0b10u : 0b11u; });
  GpioLines driver("lines", {.chip = "double", .inputs = {"estop", "button"}}, chip.chip(), clock);
  REQUIRE(driver.open().has_value());
  REQUIRE(driver.start(clock.now_ns()).has_value());
  const auto read = [&] {
    clock.advance_to(clock.now_ns() + 100 * kMs);
    return driver.read(clock.now_ns());
  };
  const LinesReading pulse = read();
  CHECK(pulse.levels == 0b11u);
  CHECK(pulse.changed == 0b01u);
  CHECK(pulse.edge_ns == 1'053 * kMs);
  CHECK(read().changed == 0);

  ChipDouble other({"estop"}, clock, [&](int64_t at_ns) { return at_ns / kMs < 1250 ? 1u : 0u; });
  GpioLines stuck("lines", {.chip = "double", .inputs = {"estop"}}, other.chip(), clock);
  REQUIRE(stuck.open().has_value());
  REQUIRE(stuck.start(clock.now_ns()).has_value());
  other.misbehave(Misbehaviour::frozen);
  clock.advance_to(clock.now_ns() + 100 * kMs);
  CHECK(stuck.read(clock.now_ns()).levels == 1);
  other.misbehave(Misbehaviour::none);
  clock.advance_to(clock.now_ns() + 100 * kMs);
  CHECK(stuck.read(clock.now_ns()).levels == 0);
}

TEST_CASE("gpio lines: errors name chip and line, and what to do") {
  VirtualClock clock;
  ChipDouble chip({"a", "b"}, clock);
  const auto error = [&](std::vector<std::string> inputs) {
    GpioLines driver("lines", {.chip = "/dev/gpiochip9", .inputs = std::move(inputs)}, chip.chip(), clock);
    CHECK_FALSE(driver.start(0).has_value());
    CHECK_FALSE(driver.restart(0));
    const auto opened = driver.open();
    return opened ? std::string() : opened.error().text();
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  CHECK(error({"a", "1"}).empty());
  CHECK(has(error({"estop"}), "line `estop`"));
  CHECK(has(error({"7"}), "line `7`"));
  CHECK(has(error({"a", "0"}), "gpioinfo names it"));  // the same twice
  CHECK(has(error({}), "0 lines"));
  chip.misbehave(Misbehaviour::unplugged);
  CHECK(has(error({"a"}), "gpiodetect"));
  GpioLines absent("lines", {.chip = "/dev/no-chip", .inputs = {"a"}}, std::make_unique<KernelLineChip>(), clock);
  const auto opened = absent.open();
  REQUIRE_FALSE(opened.has_value());
  CHECK_FALSE(opened.error().bad_input);
}

TEST_CASE("debounce: against its definition, edge by edge") {
  std::mt19937 random(3);
  for (int round = 0; round < 200; ++round) {
    const int64_t hold = static_cast<int64_t>(random() % 5);
    Debounce debounce(hold);
    std::vector<std::pair<int64_t, bool>> levels;  // from when on
    int64_t at = 0;
    bool counts = false;
    for (int k = 0; k < 60; ++k) {
      const bool level = random() % 2 == 0;
      levels.emplace_back(at, level);
      debounce.observe(level, at);
      // High counts if it was so at the first look and since, or without a break for `hold`.
      size_t first_high = levels.size();
      while (first_high > 0 && levels[first_high - 1].second) --first_high;
      const bool high = first_high < levels.size();
      counts = high && (first_high == 0 || at - levels[first_high].first >= hold || (counts && level));
      CHECK(debounce.level() == counts);
      at += static_cast<int64_t>(random() % 4);
    }
  }
}
