// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <vector>

#include "hal/device_health.hpp"
#include "tests/nanoseconds.hpp"

namespace {

using namespace takt;
using test::kMs;

/// One read every 50 ms; lost after 300 ms, back after 500 ms.
struct Reads {
  DeviceHealth health;
  int64_t now_ms = 0;

  explicit Reads(bool judges_frozen = true, int64_t starts_within_ns = 0)
      : health({300 * kMs, starts_within_ns, 500 * kMs, judges_frozen}) {}
  std::optional<SourceState> read(ReadStatus status, int times = 1, bool repeated = false) {
    for (int i = 0; i < times; ++i, now_ms += 50) health.observe(now_ms * kMs, status, repeated);
    return health.state();
  }
  /// How many more such reads until the state is that; -1: not within 100.
  int until(SourceState state, ReadStatus status, bool repeated = false) {
    for (int i = 1; i <= 100; ++i)
      if (read(status, 1, repeated) == state) return i;
    return -1;
  }
};

}  // namespace

TEST_CASE("silent_after is three periods, at least 300 ms") {
  CHECK(default_silent_after_ns(66 * kMs) == 300 * kMs);
  CHECK(default_silent_after_ns(200 * kMs) == 600 * kMs);
  CHECK(default_silent_after_ns(0) == 300 * kMs);
}

TEST_CASE("nothing is said until the device has shown that it works, or that it does not") {
  Reads works;
  CHECK_FALSE(works.read(ReadStatus::ok, 10).has_value());  // 0 .. 450 ms
  CHECK(works.read(ReadStatus::ok) == SourceState::ok);
  Reads never;
  CHECK_FALSE(never.read(ReadStatus::no_data, 6).has_value());
  CHECK(never.read(ReadStatus::no_data) == SourceState::silent);
}

TEST_CASE("before its first good data a device may take as long as it says, after them no longer than any") {
  struct Case {
    int64_t starts_within_ms;
    int bad_reads;  ///< without a verdict
  };
  for (const Case& c : {Case{0, 6}, Case{200, 6}, Case{1000, 20}}) {
    INFO(c.starts_within_ms, " ms");
    for (const ReadStatus status : {ReadStatus::no_data, ReadStatus::partial}) {
      Reads never{true, c.starts_within_ms * kMs};
      CHECK_FALSE(never.read(status, c.bad_reads).has_value());
      CHECK(never.read(status).has_value());
    }
    Reads gone{true, c.starts_within_ms * kMs};
    CHECK(gone.read(ReadStatus::disconnected) == SourceState::disconnected);
    Reads stops{true, c.starts_within_ms * kMs};
    stops.read(ReadStatus::no_data, 5);
    stops.read(ReadStatus::ok);
    CHECK_FALSE(stops.read(ReadStatus::no_data, 5).has_value());
    CHECK(stops.read(ReadStatus::no_data) == SourceState::silent);
  }
}

TEST_CASE("each kind of loss after its time: 300 ms after the last good read, disconnected at once") {
  struct Case {
    ReadStatus status;
    bool repeated;
    SourceState state;
    int reads;
  };
  for (const Case& c :
       {Case{ReadStatus::no_data, false, SourceState::silent, 6},
        Case{ReadStatus::partial, false, SourceState::garbage, 6}, Case{ReadStatus::ok, true, SourceState::frozen, 6},
        Case{ReadStatus::disconnected, false, SourceState::disconnected, 1}}) {
    Reads device;
    device.read(ReadStatus::ok, 20);
    CHECK(device.until(c.state, c.status, c.repeated) == c.reads);
    CHECK(device.until(SourceState::ok, ReadStatus::ok) == 11);  // 500 ms from the first good one
  }
}

TEST_CASE("a mixture of bad reads is no good data: silent") {
  Reads device;
  device.read(ReadStatus::ok, 20);
  device.read(ReadStatus::partial, 3);
  CHECK(device.until(SourceState::silent, ReadStatus::no_data) == 3);
}

TEST_CASE("repetitions are good where they are not judged") {
  Reads device(false);
  CHECK(device.read(ReadStatus::ok, 40, true) == SourceState::ok);
}

TEST_CASE("a break starts the wait anew: a loose plug stays lost") {
  Reads device;
  device.read(ReadStatus::ok, 20);
  CHECK(device.read(ReadStatus::disconnected) == SourceState::disconnected);
  for (int i = 0; i < 10; ++i) {
    CHECK(device.read(ReadStatus::ok, 10) == SourceState::disconnected);  // 450 ms
    CHECK(device.read(ReadStatus::disconnected) == SourceState::disconnected);
  }
  CHECK(device.until(SourceState::ok, ReadStatus::ok) == 11);
}

TEST_CASE("one bad read is a break for a device that comes back, and so are jobs that were paused") {
  for (const ReadStatus bad : {ReadStatus::partial, ReadStatus::ok}) {
    Reads device;
    device.read(ReadStatus::disconnected);
    device.read(ReadStatus::ok, 8);
    device.read(bad, 1, true);
    CHECK(device.until(SourceState::ok, ReadStatus::ok) == 11);
  }
  Reads paused;
  paused.read(ReadStatus::disconnected);
  paused.read(ReadStatus::ok, 8);
  paused.now_ms += 300;
  CHECK(paused.until(SourceState::ok, ReadStatus::ok) == 11);
}

TEST_CASE("a device slower than its jobs is well, and comes back: a read without data is no break") {
  Reads device;
  for (int i = 0; i < 20; ++i) {
    device.read(ReadStatus::no_data, 3);
    device.read(ReadStatus::ok);
  }
  CHECK(device.health.state() == SourceState::ok);
  device.read(ReadStatus::disconnected);
  for (int i = 0; i < 4; ++i) {
    device.read(ReadStatus::ok);
    device.read(ReadStatus::no_data, 3);
  }
  CHECK(device.read(ReadStatus::ok) == SourceState::ok);
  CHECK(device.read(ReadStatus::no_data, 6) == SourceState::silent);
}

TEST_CASE("what is connected again but gives nothing is silent, and the end of a recording is no reading") {
  Reads device;
  device.read(ReadStatus::disconnected, 4);
  CHECK(device.read(ReadStatus::no_data, 5) == SourceState::disconnected);
  CHECK(device.read(ReadStatus::no_data) == SourceState::silent);
  CHECK(device.read(ReadStatus::end_of_data, 50) == SourceState::silent);
}

TEST_CASE("tries come after 100, 200, 400 ms ... and never more than 1 s apart, until it works") {
  RetryDelay retry;
  std::vector<int64_t> tries_ms;
  for (int64_t now_ms = 0; now_ms < 12'000; now_ms += 10) {
    if (!retry.due(now_ms * kMs)) continue;
    retry.failed(now_ms * kMs);
    tries_ms.push_back(now_ms);
  }
  CHECK(tries_ms ==
        std::vector<int64_t>{0, 100, 300, 700, 1500, 2500, 3500, 4500, 5500, 6500, 7500, 8500, 9500, 10500, 11500});
  retry.works();
  CHECK(retry.due(0));
}
