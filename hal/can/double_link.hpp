// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <utility>

#include "hal/can/node_guard.hpp"
#include "hal/can/station.hpp"
#include "hal/device_double.hpp"

namespace takt::can {

/// What a double lives on: a Station that misbehaves when told to, heartbeats and network management.
class DoubleLink {
 public:
  DoubleLink(std::string interface, const Clock& clock, std::span<const Message> table, const NodePlaces& places,
             uint64_t seed)
      : station_(std::move(interface), clock, table, Sender::device), table_(table), places_(places), random_(seed) {}

  int open() { return station_.open(); }
  void close() { station_.close(); }
  void misbehave(Misbehaviour how);
  /// Says boot-up, then waits for a start.
  void boot(int64_t now_ns);
  /// The next message for the node that is not network management. A node that is not operational hears nothing else.
  std::optional<Incoming> next(int64_t now_ns);
  /// True once after the host has ordered a reset.
  bool take_reset() { return std::exchange(reset_, false); }
  void send(size_t message, std::span<const double> values);
  void beat(int64_t now_ns);

  bool operational() const { return state_ == NodeState::operational; }
  bool deserted(int64_t now_ns) const { return now_ns - host_ns_ > kHeartbeatLost_ns; }
  int64_t uptime_ns(int64_t now_ns) const { return now_ns - booted_ns_; }
  bool due(int64_t now_ns, int64_t period_ns) const { return uptime_ns(now_ns) % period_ns == 0; }
  const Station& station() const { return station_; }

 private:
  uint64_t random();

  Station station_;
  std::span<const Message> table_;
  NodePlaces places_;
  NodeState state_ = NodeState::pre_operational;
  int64_t booted_ns_ = 0, host_ns_ = 0;
  bool reset_ = false;
  uint64_t random_;
  Misbehaviour how_ = Misbehaviour::none;
  std::array<Frame, Station::kMostMessages> newest_{};
  std::array<std::array<double, kMostSignals>, Station::kMostMessages> newest_values_{};
};

/// The double of a node. It lives in steps of 10 ms of the given clock's time; nobody waits for anything.
class NodeDouble : public DeviceDouble {
 public:
  static constexpr int64_t kStep_ns = 10'000'000;

  /// Powered: says boot-up and then waits for a start.
  DeviceResult plug_in() final;
  void run_to(int64_t now_ns) final;
  int64_t step_ns() const final { return kStep_ns; }
  std::span<const Misbehaviour> known() const final;
  void misbehave(Misbehaviour how) final { link_.misbehave(how); }
  /// Power off and on: all that it was told is forgotten.
  void reboot();
  const Station& station() const { return link_.station(); }

 protected:
  NodeDouble(std::string interface, const Clock& clock, std::span<const Message> table, const NodePlaces& places,
             uint64_t seed)
      : clock_(clock), link_(std::move(interface), clock, table, places, seed) {}

  virtual void forget() = 0;
  virtual void take(const Incoming& incoming) = 0;
  /// The host has just made it operational.
  virtual void started() {}
  virtual void step() = 0;
  DoubleLink& link() { return link_; }
  int64_t now_ns() const { return now_ns_; }

 private:
  const Clock& clock_;
  DoubleLink link_;
  int64_t now_ns_ = 0;
};

}  // namespace takt::can
