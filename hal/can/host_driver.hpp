// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "hal/can/node_guard.hpp"
#include "hal/can/station.hpp"
#include "hal/device.hpp"

namespace takt::can {

/// What the host's drivers of all nodes share: the life cycle on the bus, heartbeats, and the newest readings that the
/// node's messages made. A driver of `Interface` says what its node's messages mean.
template <class Interface, class Reading>
class HostDriver : public Interface {
 public:
  static constexpr int64_t kStale_ns = 50'000'000;  ///< older than this a reading is no news (D-4.3)
  /// Every message of head and base at once, 17 frames of 0.27 ms (D-4.1).
  static constexpr int64_t kBusDelay_ns = 4'600'000;

  DeviceResult open() override {
    if (open_) return {};
    if (const int error = station_.open(); error != 0) {
      return device_failure(id_, station_.interface() + ": " + std::strerror(error),
                            advice(station_.interface(), error));
    }
    open_ = true;
    return {};
  }
  void close() override {
    station_.close();
    open_ = started_ = false;
  }
  DeviceResult start(int64_t epoch_ns) override {
    if (!open_) return device_error(id_, "start before open", "call open() first");
    forget_all();
    guard_.tend(station_, epoch_ns);
    started_ = true;
    return {};
  }
  void stop() override {
    if (!std::exchange(started_, false)) return;
    rest();
    guard_.end(station_);
  }
  bool restart(int64_t now_ns) override {
    if (!open_) return false;
    if (station_.link() == Link::gone) {
      station_.close();
      if (station_.open() != 0) return false;
      forget_all();
    }
    started_ = true;
    take_all();
    guard_.tend(station_, now_ns);  // tells a link that is up again
    if (faulted()) reset_fault();
    return station_.link() == Link::up && !faulted();
  }
  /// Stamps are those of the arrival: a cycle of the message that makes readings, and what other frames may delay it.
  StampLaw stamp_law(const JobTimes&) const override { return {0, cycle_ns_ + kBusDelay_ns, 0, {}}; }
  DeclaredCalls declared_calls() const override {
    return {bit(JobCall::socket) | bit(JobCall::file), "frames are taken from and given to a socket that never waits"};
  }
  SourceCounts counts() const override {
    const StationCounters& c = station_.counters();
    return {c.accepted, c.damaged, 0, c.gaps + c.out_of_order + station_.overflows(), c.unsent};
  }
  const char* trouble() const override {
    if (started_ && faulted()) return "the device says that it is in a fault";
    switch (station_.link()) {
      case Link::up: return guard_.operational(clock_.now_ns()) ? "" : "no heartbeat of a device at work";
      case Link::down: return "the interface is down";
      case Link::bus_off:
        return station_.restless() ? "the controller was off the bus again and again" : "the controller is off the bus";
      case Link::gone: return "the interface, or who listens there, is gone";
    }
    return "";
  }
  const Station& station() const { return station_; }

 protected:
  HostDriver(std::string id, std::string interface, const Clock& clock, std::span<const Message> table,
             const NodePlaces& places, int64_t cycle_ns)
      : id_(std::move(id)),
        cycle_ns_(cycle_ns),
        clock_(clock),
        station_(std::move(interface), clock, table, Sender::host),
        guard_(places),
        heartbeat_(places.heartbeat) {}

  /// One message of the node, its heartbeat excepted.
  virtual void take(const Incoming& incoming) = 0;
  /// The node has booted, or was away: what was learnt of it holds no more.
  virtual void forget() = 0;
  /// Asks the node to rest: the host goes.
  virtual void rest() = 0;
  virtual bool faulted() const = 0;
  virtual void reset_fault() = 0;

  bool started() const { return started_; }
  Station& bus() { return station_; }
  void keep(const Reading& reading) { history_[readings_++ % history_.size()] = reading; }

  /// In a read: takes what has arrived, and sends the heartbeat if it is due.
  void attend() {
    take_all();
    guard_.tend(station_, clock_.now_ns());
  }
  /// After attend(), what the read finds. ok: the newest reading at or before then, of the last 50 ms; partial: only
  /// damaged frames came; disconnected: the bus is down or away, or the node in a fault, which a restart resets.
  Reading newest(int64_t wanted_ns) {
    Reading reading;
    const uint64_t damaged = station_.counters().damaged;
    if (std::exchange(damaged_before_, damaged) != damaged) reading.status = ReadStatus::partial;
    if (station_.link() != Link::up || faulted()) reading.status = ReadStatus::disconnected;
    if (reading.status == ReadStatus::disconnected || !guard_.operational(clock_.now_ns())) return reading;
    for (size_t back = 1; back <= std::min(readings_, history_.size()); ++back) {
      const Reading& kept = history_[(readings_ - back) % history_.size()];
      if (kept.stamp_ns > wanted_ns) continue;
      return wanted_ns - kept.stamp_ns < kStale_ns ? kept : reading;
    }
    return reading;
  }

 private:
  void forget_all() {
    guard_.begin();
    readings_ = 0;
    forget();
  }
  void take_all() {
    while (const auto incoming = station_.next()) {
      if (incoming->message != heartbeat_) take(*incoming);
      else if (guard_.hear(static_cast<NodeState>(incoming->values[0]), incoming->stamp_ns)) forget_all();
    }
  }

  std::string id_;
  int64_t cycle_ns_;  ///< of the message that makes readings
  const Clock& clock_;
  Station station_;
  NodeGuard guard_;
  size_t heartbeat_;
  std::array<Reading, 16> history_{};  ///< the newest readings, a ring
  size_t readings_ = 0;
  uint64_t damaged_before_ = 0;
  bool open_ = false, started_ = false;
};

}  // namespace takt::can
