// SPDX-License-Identifier: Apache-2.0
#include "hal/ros2/ros2_laser.hpp"

#include <pthread.h>

#include <algorithm>
#include <stdexcept>

namespace takt::ros2 {
namespace {

constexpr int64_t kPatience_ns = 100'000'000;
constexpr int64_t kDiscovery_ns = 5'000'000'000;  ///< until two participants know each other, at most
constexpr int64_t kPeriodsOfSilence = 10;

}  // namespace

DeviceResult Ros2Laser::open() {
  if (open_) return {};
  newest_.for_each([&](Scan& slot) { slot.range_m.assign(parts_.rule.beams, 0.0f); });
  open_ = true;
  return {};
}

void Ros2Laser::close() {
  stop();
  open_ = false;
}

DeviceResult Ros2Laser::start(int64_t) {
  if (!open_) return device_error(parts_.id, "start before open", "call open() first");
  if (started_) return {};
  try {
    source_ = parts_.listen();
  } catch (const std::runtime_error& problem) {
    return device_failure(parts_.id, problem.what(), "correct `address` or `domain`, or install what is missing");
  }
  heard_ns_ = clock_.now_ns() + starts_within_ns();
  started_ = true;
  if (clock_.is_virtual()) return {};
  quit_.store(false);
  thread_ = std::thread([this] {
    pthread_setname_np(pthread_self(), ("ros2:" + parts_.id).substr(0, 15).c_str());
    while (!quit_.load()) {
      priority_.keep(clock_);
      step(kPatience_ns);
    }
  });
  return {};
}

void Ros2Laser::stop() {
  if (!started_) return;
  started_ = false;
  quit_.store(true);
  if (thread_.joinable()) thread_.join();
  source_.reset();
}

/// The participant stays: only the other side can come back.
bool Ros2Laser::restart(int64_t now_ns) {
  heard_ns_ = now_ns;
  return started_;
}

int64_t Ros2Laser::starts_within_ns() const { return kDiscovery_ns; }

ScanFormat Ros2Laser::format() const {
  ScanFormat format;
  format.beams = parts_.rule.beams;
  format.first_angle_rad = parts_.rule.first_angle_rad;
  format.step_rad = parts_.rule.step_rad;
  format.max_range_m = parts_.rule.max_range_m;
  format.rate_hz = parts_.rate_hz;
  format.sensor_in_robot = parts_.sensor_in_robot;
  const auto period_ns = static_cast<int64_t>(1e9 / parts_.rate_hz);
  format.stamps = parts_.stamps.latency_ns > 0
                      ? StampLaw{parts_.stamps.latency_ns, period_ns, 0}
                      : StampLaw::none("`latency` is not given: how far the clock of ROS 2 is off is not known");
  return format;
}

ScanReading Ros2Laser::read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) {
  ScanReading reading;
  if (!started_ || wanted_ns > deadline_ns) return reading;
  if (clock_.is_virtual()) step(0);
  else priority_.follow();
  if (const Scan* scan = newest_.take()) {
    std::copy_n(scan->range_m.begin(), std::min(scan->range_m.size(), range_m.size()), range_m.begin());
    heard_ns_ = std::max(heard_ns_, clock_.now_ns());
    return {range_m.size() < scan->range_m.size() ? ReadStatus::partial : ReadStatus::ok, scan->stamp_ns, scan->number,
            false};
  }
  const auto silence_ns = static_cast<double>(clock_.now_ns() - heard_ns_);
  if (silence_ns > kPeriodsOfSilence * 1e9 / parts_.rate_hz) reading.status = ReadStatus::disconnected;
  return reading;
}

void Ros2Laser::step(int64_t patience_ns) {
  source_->take(patience_ns, [this](std::span<const std::byte> cdr) { take(cdr); });
}

void Ros2Laser::take(std::span<const std::byte> cdr) {
  Scan& draft = newest_.draft();
  int64_t ros_ns = 0;
  if (const char* why = read_scan(cdr, parts_.rule, draft.range_m, ros_ns)) return refuse(why);
  const auto stamp_ns = parts_.stamps.stamp(ros_ns, parts_.wall_ns(), clock_.now_ns());
  if (!stamp_ns) return refuse("a scan is of the future, or older than `latency`");
  draft.stamp_ns = *stamp_ns;
  draft.number = ++number_;
  received_.fetch_add(1);
  trouble_.store("", std::memory_order_relaxed);
  newest_.publish();
}

void Ros2Laser::refuse(const char* why) {
  damaged_.fetch_add(1);
  trouble_.store(why, std::memory_order_relaxed);
}

}  // namespace takt::ros2
