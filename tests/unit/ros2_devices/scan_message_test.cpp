// SPDX-License-Identifier: Apache-2.0
#include "hal/ros2/scan_message.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "hal/ros2/cdr_reader.hpp"
#include "hal/ros2/ros2_laser.hpp"
#include "hal/ros2/stamp_rule.hpp"
#include "tests/unit/ros2_devices/scan_bytes.hpp"

using namespace takt;
using namespace takt::ros2;
using test::ScanBytes;

namespace {

const ScanRule kRule{.beams = 3, .first_angle_rad = -0.5, .step_rad = 0.5, .max_range_m = 20, .frame = "laser"};

/// Messages that a test puts there.
class Shelf final : public Source {
 public:
  explicit Shelf(std::vector<std::vector<std::byte>>& messages) : messages_(messages) {}
  void take(int64_t, const std::function<void(std::span<const std::byte>)>& each) override {
    for (const auto& message : std::exchange(messages_, {})) each(message);
  }

 private:
  std::vector<std::vector<std::byte>>& messages_;
};

}  // namespace

TEST_CASE("a scan is read: what is no return is 0") {
  constexpr float kInfinite = std::numeric_limits<float>::infinity(), kNone = std::numeric_limits<float>::quiet_NaN();
  for (const bool big : {false, true}) {
    std::vector<float> range(3);
    int64_t stamp_ns = 0;
    const auto read = [&](std::vector<float> ranges) {
      return read_scan(ScanBytes{.ranges = std::move(ranges)}.bytes(big), kRule, range, stamp_ns);
    };
    CHECK(read({1.5f, kInfinite, 2}) == nullptr);
    CHECK(range == std::vector<float>{1.5f, 0, 2});
    CHECK(stamp_ns == 12'000'000'034);
    CHECK(read({kNone, -1, 0.05f}) == nullptr);  // below range_min
    CHECK(range == std::vector<float>{0, 0, 0});
    CHECK(read({19, 25, -kInfinite}) == nullptr);  // beyond the rule
    CHECK(range == std::vector<float>{19, 0, 0});
  }
}

TEST_CASE("a scan that is not as the device has it is refused with the reason") {
  std::vector<float> range(3);
  int64_t stamp_ns = 0;
  const auto why = [&](const ScanBytes& scan) {
    const char* reason = read_scan(scan.bytes(), kRule, range, stamp_ns);
    return std::string(reason != nullptr ? reason : "");
  };
  CHECK(why({}) == "");
  CHECK(why({.ranges = {1, 2}}).find("fewer beams") != std::string::npos);
  CHECK(why({.ranges = {1, 2, 3, 4}}).find("more beams") != std::string::npos);
  CHECK(why({.first_rad = -0.2f}).find("`fov`") != std::string::npos);
  CHECK(why({.step_rad = std::numeric_limits<float>::quiet_NaN()}).find("`fov`") != std::string::npos);
  CHECK(why({.frame = "camera"}).find("frame") != std::string::npos);
  CHECK(why({.seconds = -1}).find("stamp") != std::string::npos);
  CHECK(why({.nanoseconds = 1'000'000'000}).find("stamp") != std::string::npos);
}

TEST_CASE("a scan that is cut off, or whose counts lie, is refused at every byte") {
  std::vector<float> range(3);
  int64_t stamp_ns = 0;
  const std::vector<std::byte> whole = ScanBytes{}.bytes();
  for (size_t size = 0; size < whole.size(); ++size)
    CHECK(read_scan({whole.data(), size}, kRule, range, stamp_ns) != nullptr);
  std::vector<std::byte> longer = whole;
  longer.resize(longer.size() + 8);
  CHECK(read_scan(longer, kRule, range, stamp_ns) != nullptr);

  std::minstd_rand random(7);
  for (int i = 0; i < 20'000; ++i) {  // whatever comes: it ends, and no range is outside the rule
    std::vector<std::byte> damaged = whole;
    for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = static_cast<std::byte>(random());
    if (read_scan(damaged, kRule, range, stamp_ns) != nullptr) continue;
    for (const float r : range) CHECK((r >= 0 && r <= 20));
  }
}

TEST_CASE("texts of CDR end with their 0, and sequences within their bounds") {
  const auto bytes = [](std::initializer_list<int> values) {
    std::vector<std::byte> all;
    for (const int value : values) all.push_back(static_cast<std::byte>(value));
    return all;
  };
  const auto text = bytes({0, 1, 0, 0, 3, 0, 0, 0, 'a', 'b', 0});
  CHECK(CdrReader(text).text(2) == "ab");
  CdrReader shorter(text);
  CHECK(shorter.text(1).empty());
  CHECK_FALSE(shorter.ok());
  const auto open_text = bytes({0, 1, 0, 0, 2, 0, 0, 0, 'a', 'b'});
  CHECK(CdrReader(open_text).text(9).empty());
  const auto claims_much = bytes({0, 1, 0, 0, 255, 255, 255, 255});
  CdrReader huge(claims_much);
  CHECK(huge.count(10) == 0);
  CHECK_FALSE(huge.ok());
  CHECK_FALSE(CdrReader(bytes({0, 7, 0, 0})).ok());  // XCDR 2
}

TEST_CASE("a stamp of ROS 2 becomes one of ours only where the clocks agree") {
  const StampRule unknown;
  CHECK(*unknown.stamp(1, 5'000'000'000, 700) == 700);  // it counts from its arrival
  const StampRule known{.latency_ns = 1'000};
  CHECK(*known.stamp(4'000, 4'600, 700) == 100);
  CHECK_FALSE(known.stamp(4'000, 5'001, 700));  // too old
  CHECK_FALSE(known.stamp(4'601, 4'600, 700));  // of the future
}

TEST_CASE("the device gives the newest good scan, counts the others and says why") {
  std::vector<std::vector<std::byte>> messages;
  VirtualClock clock(1'000'000'000);
  Ros2Laser laser({.id = "laser",
                   .rule = kRule,
                   .stamps = {},
                   .rate_hz = 10,
                   .sensor_in_robot = {},
                   .listen = [&] { return std::make_unique<Shelf>(messages); },
                   .wall_ns = [] { return int64_t{0}; }},
                  clock);
  std::vector<float> range(3);
  const auto read = [&] { return laser.read(range, clock.now_ns(), clock.now_ns() + 1); };
  REQUIRE(laser.open());
  REQUIRE(laser.start(0));
  CHECK_FALSE(laser.stamp_law({}).unknown.empty());
  CHECK(read().status == ReadStatus::no_data);
  messages = {ScanBytes{.ranges = {1, 1, 1}}.bytes(), ScanBytes{.ranges = {2, 2, 2}}.bytes(), {}};
  const ScanReading reading = read();
  CHECK(reading.status == ReadStatus::ok);
  CHECK(reading.scan_number == 2);
  CHECK(reading.stamp_ns == clock.now_ns());
  CHECK(range == std::vector<float>{2, 2, 2});
  CHECK(laser.counts().received == 2);
  CHECK(laser.counts().damaged == 1);
  CHECK(std::string(laser.trouble()).find("LaserScan") != std::string::npos);
  clock.advance_to(clock.now_ns() + 20'000'000'000);
  CHECK(read().status == ReadStatus::disconnected);
  messages = {ScanBytes{}.bytes()};
  CHECK(laser.restart(clock.now_ns()));
  CHECK(read().status == ReadStatus::ok);
}
