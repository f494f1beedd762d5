// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/link_device.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "rt/record/packed_message.hpp"

namespace takt::semantic_link {

DeviceResult LinkDevice::start(int64_t) {
  // A port that is not there now is opened by the thread, once it can be.
  const DeviceResult opened = runner_->open();
  if (!started_) runner_->start();
  started_ = true;
  heard_ = exchange_.heard.load();
  bad_ = exchange_.bad.load();
  return opened;
}

void LinkDevice::stop() {
  if (started_) runner_->stop();
  started_ = false;
}

DeclaredCalls LinkDevice::declared_calls() const {
  if (!runner_->is_virtual()) return {bit(JobCall::file), "one write to an eventfd wakes the link's thread"};
  return {bit(JobCall::file) | bit(JobCall::socket) | bit(JobCall::wait) | bit(JobCall::malloc) | bit(JobCall::lock),
          "with a virtual clock the link is served by the job itself"};
}

void LinkDevice::give(Kind kind, const void* message, int64_t stamp_ns) {
  Newest<Parcel>& parcels = exchange_.parcels[index_of(kind)];
  Parcel& draft = parcels.draft();
  draft.bytes.clear();
  if (!write_message(info_of(kind), message, draft.bytes)) {
    exchange_.too_large.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  draft.stamp_ns = stamp_ns;
  parcels.publish();
}

bool LinkDevice::unpack(Kind kind, const Parcel& parcel, void* message) {
  return record::unpack(*info_of(kind).type, parcel.bytes, message).has_value();
}

ReadStatus LinkDevice::read() {
  if (!started_) return ReadStatus::no_data;
  runner_->poll();
  if (const LinkReport* newest = exchange_.report.take()) report_ = *newest;
  const uint64_t heard = exchange_.heard.load(std::memory_order_relaxed),
                 bad = exchange_.bad.load(std::memory_order_relaxed);
  const bool any = std::exchange(heard_, heard) != heard, damage = std::exchange(bad_, bad) != bad;
  if (!exchange_.connected.load(std::memory_order_acquire)) return ReadStatus::disconnected;
  return any ? ReadStatus::ok : damage ? ReadStatus::partial : ReadStatus::no_data;
}

size_t LinkDevice::describe(std::span<char> text) const {
  const LinkCounts& c = report_.counts;
  const auto ms = [](int64_t ns) { return static_cast<double>(ns) * 1e-6; };
  auto at = text.begin();
  const auto say = [&]<class... T>(fmt::format_string<T...> form, T&&... values) {
    const auto room = static_cast<size_t>(text.end() - at);
    at += static_cast<ptrdiff_t>(std::min(room, fmt::format_to_n(at, room, form, std::forward<T>(values)...).size));
  };
  if (report_.attached)
    say("attached; other clock {:+.3f} ms +- {:.3f}, round trip {:.3f} ms", -ms(report_.to_own_ns),
        ms(report_.bound_ns), ms(report_.round_trip_ns));
  else say("not attached: {}", std::string_view(report_.trouble));
  say("; sent {} received {} lost {} late {} replayed {} foreign {} malformed {} damaged {} incomplete {} "
      "refused {} too large {}",
      c.sent, c.received, c.lost, c.late + exchange_.too_old.load(std::memory_order_relaxed), c.replayed, c.foreign,
      c.malformed, c.damaged, c.incomplete, c.refused, exchange_.too_large.load(std::memory_order_relaxed));
  return static_cast<size_t>(at - text.begin());
}

}  // namespace takt::semantic_link
