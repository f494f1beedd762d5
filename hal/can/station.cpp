// SPDX-License-Identifier: Apache-2.0
#include "hal/can/station.hpp"

#include <algorithm>
#include <stdexcept>

namespace takt::can {

Station::Station(std::string interface, const Clock& clock, std::span<const Message> table, Sender self)
    : clock_(clock),
      port_(std::move(interface), clock, self == Sender::host ? Port::End::host : Port::End::device),
      table_(table),
      self_(self) {
  const bool fits = table.size() <= kMostMessages && std::all_of(table.begin(), table.end(), [](const Message& m) {
                      return m.signals.size() <= kMostSignals;
                    });
  if (!fits) throw std::logic_error("a table of CAN messages is larger than can::Station holds");
}

int Station::open() {
  std::array<uint32_t, kMostMessages> ids;
  size_t count = 0;
  for (const Message& message : table_) {
    if (message.sender != self_) ids[count++] = message.id;
  }
  const int error = port_.open(std::span(ids.data(), count));
  link_ = error == 0 ? Link::up : Link::gone;
  bus_.state = BusState::active;
  receivers_ = {};
  looked_at_ = 0;
  return error;
}

std::optional<Incoming> Station::next() {
  for (; looked_at_ < kMostFrames; ++looked_at_) {
    const Reception reception = port_.receive();
    if (reception.status == PortStatus::nothing) break;
    if (reception.status == PortStatus::gone) {
      link_ = Link::gone;
      port_.close();
      break;
    }
    if (reception.status == PortStatus::down) {
      link_ = Link::down;
      bus_.state = BusState::active;  // as it will be when the interface is up again
      continue;
    }
    link_ = Link::up;
    if (reception.status == PortStatus::malformed) {
      ++counters_.damaged;
      continue;
    }
    const Frame& frame = reception.frame;
    if ((frame.id & kErrorFlag) != 0) {
      observe(frame);
      continue;
    }
    if (bus_.state == BusState::off) bus_.state = BusState::active;  // who hears frames is on the bus
    const auto found = std::find_if(table_.begin(), table_.end(),
                                    [&](const Message& m) { return m.id == frame.id && m.sender != self_; });
    if (found == table_.end()) {
      ++counters_.foreign;
      continue;
    }
    const auto message = static_cast<size_t>(found - table_.begin());
    if (!accept(message, frame)) continue;
    ++counters_.accepted;
    ++looked_at_;
    return Incoming{message, std::span(values_[message].data(), found->signals.size()), reception.stamp_ns};
  }
  looked_at_ = 0;
  return std::nullopt;
}

void Station::observe(const Frame& error) {
  constexpr int64_t kMinute_ns = 60'000'000'000;
  const uint64_t before = bus_.restarts;
  bus_.observe(error);
  if (bus_.restarts == before) return;
  int64_t& oldest_ns = restarted_ns_[before % kMostRestarts];
  const int64_t now_ns = clock_.now_ns();
  if (before >= kMostRestarts && now_ns - oldest_ns < kMinute_ns) restless_until_ns_ = now_ns + kMinute_ns;
  oldest_ns = now_ns;
}

bool Station::accept(size_t message, const Frame& frame) {
  const Message& row = table_[message];
  if (row.is_protected) {
    const EndToEndStatus status = receivers_[message].check(row, frame);
    const bool changed = status == EndToEndStatus::wrong_crc || status == EndToEndStatus::invalid;
    if (changed) ++counters_.damaged;
    else if (!usable(status) && status != EndToEndStatus::initial) ++counters_.out_of_order;
    if (!usable(status)) return false;
    if (status == EndToEndStatus::ok_some_lost) ++counters_.gaps;
  }
  if (decode(row, frame, values_[message])) return true;
  ++counters_.damaged;
  return false;
}

Frame Station::make(size_t message, std::span<const double> values) {
  Frame frame = encode(table_[message], values);
  if (table_[message].is_protected) senders_[message].protect(table_[message], frame);
  return frame;
}

bool Station::send(size_t message, std::span<const double> values) { return send(make(message, values)); }

bool Station::send(const Frame& frame) {
  const PortStatus status = port_.send(frame);
  switch (status) {
    case PortStatus::ok:
      if (link_ == Link::down) link_ = Link::up;
      return true;
    case PortStatus::down: link_ = Link::down; break;
    case PortStatus::gone:
      link_ = Link::gone;
      port_.close();
      break;
    default: break;
  }
  ++counters_.unsent;
  return false;
}

}  // namespace takt::can
