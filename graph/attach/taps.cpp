// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/taps.hpp"

#include <cstring>

namespace takt::attach {

Tapped::Tapped(const PortPlan& port, const Held& held)
    : sequence(held.sequence),
      stamp_ns(held.stamp_ns),
      level(held.header->level),
      type_(*port.type),
      memory_(aligned_bytes(port.message_bytes())) {
  std::memcpy(memory_.get(), held.message(), port.message_bytes());
}

const std::optional<std::string>& Tapped::drawn(Draw draw) const {
  const std::lock_guard lock(drawing_);
  auto made = drawn_.find(draw);
  if (made == drawn_.end()) made = drawn_.emplace(draw, draw(type_, message())).first;
  return made->second;
}

std::shared_ptr<const Tapped> Tap::newer_than(uint64_t seen, int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  Candidate newest;
  const bool listed = reader_->list(now_ns, {&newest, 1}) == 1;
  if (listed && (newest_ == nullptr || newest.sequence > newest_->sequence)) {
    if (Held held = reader_->take(newest.sequence)) {
      const auto let_go = [this](Held* message) { reader_->release(*message); };
      const std::unique_ptr<Held, decltype(let_go)> holding(&held, let_go);  // whatever the copy throws
      newest_ = std::make_shared<const Tapped>(port_, held);
    }
  }
  return newest_ != nullptr && newest_->sequence > seen ? newest_ : nullptr;
}

std::shared_ptr<Tap> Taps::at(size_t port) {
  const std::lock_guard lock(mutex_);
  Shared& shared = taps_[port];
  if (shared.holders == 0) shared.tap = std::make_unique<Tap>(transport_, ports_, port);
  ++shared.holders;
  return {shared.tap.get(), [this, port](Tap*) { let_go(port); }};
}

void Taps::let_go(size_t port) {
  const std::lock_guard lock(mutex_);
  if (--taps_[port].holders == 0) taps_.erase(port);
}

}  // namespace takt::attach
