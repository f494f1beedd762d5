// SPDX-License-Identifier: Apache-2.0
#include "rt/shm/local_pool.hpp"

#include <algorithm>
#include <new>
#include <stdexcept>

#include "rt/shm/kill_order.hpp"

namespace takt {
namespace {

// What another process finds in the mapping must mean the same there: no pointers, and no lock behind an atomic.
static_assert(std::atomic<uint64_t>::is_always_lock_free && std::atomic<uint32_t>::is_always_lock_free);

constexpr uint64_t round_up(uint64_t bytes, uint64_t to) { return (bytes + to - 1) / to * to; }

}  // namespace

LocalPool::LocalPool(const PortPlan& plan, size_t index)
    : plan_(plan), index_(index), chunk_bytes_(round_up(plan.chunk_bytes(), 64)), chunks_(plan.chunks()) {}

void LocalPool::construct() {
  ::new (state_) PoolState;
  for (uint32_t i = 0; i < chunks_; ++i) ::new (holders_ + i) std::atomic<uint64_t>(0);
  for (uint32_t i = 0; i < plan_.history; ++i) ::new (ring_ + i) PoolSlot;
}

uint32_t LocalPool::in_use() const {
  uint32_t count = 0;
  for (uint32_t i = 0; i < chunks_; ++i) count += holders_[i].load(std::memory_order_relaxed) != 0;
  return count;
}

bool LocalPool::in_ring(uint32_t chunk) const {
  return std::any_of(ring_, ring_ + plan_.history,
                     [&](const PoolSlot& slot) { return slot.sequence.load() != 0 && slot.chunk.load() == chunk; });
}

void LocalPool::evict(PoolSlot& slot) const {
  if (slot.sequence.exchange(0) == 0) return;
  const uint32_t chunk = slot.chunk.load();
  if (!in_ring(chunk)) drop(chunk, PoolState::kRing);  // else a repeated message, which another slot still names
}

void LocalPool::announce(uint32_t chunk, int64_t stamp_ns, int64_t visible_at_ns, uint32_t commit,
                         int64_t delay_ns) const {
  const uint64_t sequence = state_->newest.load(std::memory_order_relaxed) + 1;
  PoolSlot& place = slot(sequence);
  evict(place);
  reached(MessageStep::inside_publish, index_);
  place.chunk.store(chunk);
  place.commit.store(commit);
  place.delay_ns.store(delay_ns);
  place.stamp_ns.store(stamp_ns);
  place.visible_at_ns.store(visible_at_ns);
  hold(chunk, PoolState::kRing);
  reached(MessageStep::inside_publish, index_);
  place.sequence.store(sequence);
  reached(MessageStep::inside_publish, index_);
  state_->newest.store(sequence);
  drop(chunk, PoolState::kWriter);
  reached(MessageStep::after_publish, index_);
}

uint64_t LocalPool::first_announced() const {
  uint64_t first = state_->newest.load(std::memory_order_relaxed) + 1;
  while (first > 1 && slot(first - 1).sequence.load() == first - 1 && slot(first - 1).commit.load() != 0) --first;
  return first;
}

void LocalPool::withdraw(uint64_t first) const {
  const uint64_t newest = state_->newest.load(std::memory_order_relaxed);
  state_->newest.store(first - 1);  // before the slots: reclaim() finds what is left of them
  for (uint64_t s = newest; s >= first; --s)
    if (slot(s).sequence.load() == s) evict(slot(s));
}

uint32_t LocalPool::claim_reader(uint32_t process) const {
  for (uint32_t holder = PoolState::kFirstReader; holder < PoolState::kHolders; ++holder) {
    uint32_t nobody = 0;
    if (state_->readers[holder].compare_exchange_strong(nobody, process)) return holder;
  }
  throw std::runtime_error("output " + plan_.node + "." + plan_.port + " has more than " +
                           std::to_string(PoolState::kHolders - PoolState::kFirstReader) + " readers");
}

void LocalPool::return_reader(uint32_t holder) const { state_->readers[holder].store(0); }

uint32_t LocalPool::reclaim(uint32_t process) const {
  const uint32_t before = in_use();
  for (uint32_t holder = PoolState::kFirstReader; holder < PoolState::kHolders; ++holder) {
    if (state_->readers[holder].load() != process) continue;
    for (uint32_t chunk = 0; chunk < chunks_; ++chunk) drop(chunk, holder);
    return_reader(holder);
  }
  if (state_->writer.load() == process) {
    for (uint32_t i = 0; i < plan_.history; ++i)  // a message that had its number is out
      if (const uint64_t sequence = ring_[i].sequence.load(); sequence > state_->newest.load())
        state_->newest.store(sequence);
    for (uint32_t chunk = 0; chunk < chunks_; ++chunk) {
      if (!in_ring(chunk)) drop(chunk, PoolState::kRing);
      drop(chunk, PoolState::kWriter);
    }
  }
  const uint32_t after = in_use();
  return before > after ? before - after : 0;  // others loan and release meanwhile
}

}  // namespace takt
