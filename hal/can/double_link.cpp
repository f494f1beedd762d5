// SPDX-License-Identifier: Apache-2.0
#include "hal/can/double_link.hpp"

#include <linux/can/error.h>

#include <algorithm>
#include <cstring>

namespace takt::can {
namespace {

constexpr std::array kKnown{Misbehaviour::none,         Misbehaviour::silent,     Misbehaviour::unplugged,
                            Misbehaviour::garbage,      Misbehaviour::frozen,     Misbehaviour::repeated,
                            Misbehaviour::wrong_crc,    Misbehaviour::masquerade, Misbehaviour::lost_frames,
                            Misbehaviour::no_heartbeat, Misbehaviour::bus_off};

Frame error_frame(uint32_t kind) { return {kErrorFlag | kind, CAN_ERR_DLC, {}}; }

}  // namespace

void DoubleLink::misbehave(Misbehaviour how) {
  if (how == how_) return;
  if (how_ == Misbehaviour::bus_off) station_.send(error_frame(CAN_ERR_RESTARTED));
  if (how_ == Misbehaviour::unplugged) station_.open();
  if (how == Misbehaviour::bus_off) station_.send(error_frame(CAN_ERR_BUSOFF));
  if (how == Misbehaviour::unplugged) station_.close();
  how_ = how;
}

void DoubleLink::boot(int64_t now_ns) {
  booted_ns_ = host_ns_ = now_ns;
  state_ = NodeState::pre_operational;
  send(places_.heartbeat, std::array{static_cast<double>(NodeState::boot_up)});
}

void DoubleLink::beat(int64_t now_ns) {
  if (due(now_ns, kHeartbeatPeriod_ns)) send(places_.heartbeat, std::array{static_cast<double>(state_)});
}

std::optional<Incoming> DoubleLink::next(int64_t now_ns) {
  while (const auto incoming = station_.next()) {
    const auto& values = incoming->values;
    if (incoming->message == places_.host_heartbeat) {
      host_ns_ = now_ns;
    } else if (incoming->message != places_.command) {
      if (operational()) return incoming;
    } else if (values[1] == places_.node || values[1] == 0) {
      switch (static_cast<NodeCommand>(values[0])) {
        case NodeCommand::start:
          state_ = NodeState::operational;
          host_ns_ = now_ns;
          break;
        case NodeCommand::stop: state_ = NodeState::stopped; break;
        case NodeCommand::pre_operational: state_ = NodeState::pre_operational; break;
        case NodeCommand::reset_node:
        case NodeCommand::reset_comm: reset_ = true; break;
      }
    }
  }
  return std::nullopt;
}

/// xorshift64*: the same bytes for the same seed.
uint64_t DoubleLink::random() {
  random_ ^= random_ >> 12;
  random_ ^= random_ << 25;
  random_ ^= random_ >> 27;
  return random_ * 0x2545F4914F6CDD1Du;
}

void DoubleLink::send(size_t message, std::span<const double> values) {
  const Message& row = table_[message];
  switch (how_) {
    case Misbehaviour::silent:
    case Misbehaviour::unplugged:
    case Misbehaviour::bus_off: return;
    case Misbehaviour::no_heartbeat:
      if (message == places_.heartbeat) return;
      break;
    case Misbehaviour::lost_frames: station_.skip(message, EndToEndReceiver::kMostDelta); break;
    case Misbehaviour::repeated:
      if (newest_[message].length != 0) return static_cast<void>(station_.send(newest_[message]));
      break;
    case Misbehaviour::frozen:
      if (newest_[message].length != 0 && message != places_.heartbeat) values = newest_values_[message];
      break;
    default: break;
  }
  Frame frame = station_.make(message, values);
  auto& kept = newest_values_[message];
  if (values.data() != kept.data()) std::copy_n(values.begin(), row.signals.size(), kept.begin());
  newest_[message] = frame;
  if (how_ == Misbehaviour::wrong_crc && row.is_protected) frame.data[0] ^= 0x10;
  if (how_ == Misbehaviour::masquerade && row.is_protected)
    frame.data[0] = end_to_end_crc(static_cast<uint16_t>(row.data_id() ^ 0x100), frame);
  if (how_ == Misbehaviour::garbage) {
    frame.length = static_cast<uint8_t>(random() % 9);
    frame.data = {};
    for (size_t i = 0; i < frame.length; ++i) frame.data[i] = static_cast<uint8_t>(random());
  }
  station_.send(frame);
}

DeviceResult NodeDouble::plug_in() {
  link_.close();
  if (const int error = link_.open(); error != 0) {
    const std::string& interface = station().interface();
    return device_failure(interface, std::strerror(error), advice(interface, error));
  }
  now_ns_ = clock_.now_ns();
  reboot();
  return {};
}

void NodeDouble::reboot() {
  forget();
  link_.boot(now_ns_);
}

void NodeDouble::run_to(int64_t now_ns) {
  for (; now_ns_ + kStep_ns <= now_ns; step()) {
    const bool operational = link_.operational();
    while (const auto incoming = link_.next(now_ns_)) take(*incoming);
    if (link_.operational() && !operational) started();
    if (link_.take_reset()) reboot();
    now_ns_ += kStep_ns;
  }
}

std::span<const Misbehaviour> NodeDouble::known() const { return kKnown; }

}  // namespace takt::can
