// SPDX-License-Identifier: Apache-2.0
#include "rt/shm/local_pool.hpp"

#include <algorithm>
#include <bit>
#include <stdexcept>

#include "rt/shm/kill_order.hpp"

namespace takt {
namespace {

// What another process finds in the mapping must mean the same there: no pointers, and no lock behind an atomic.
static_assert(std::atomic<uint64_t>::is_always_lock_free && std::atomic<uint32_t>::is_always_lock_free);

constexpr uint32_t kBits = 64;
/// Readers that a process may have of one port beyond those of the plan: who attaches, who takes over from the dead.
constexpr uint32_t kMoreReaders = 8;

constexpr uint64_t round_up(uint64_t bytes, uint64_t to) { return (bytes + to - 1) / to * to; }

uint64_t low_bits(uint32_t count) { return count >= kBits ? ~uint64_t{0} : (uint64_t{1} << count) - 1; }

}  // namespace

LocalPool::LocalPool(const PortPlan& plan, size_t index, uint32_t processes)
    : plan_(plan),
      index_(index),
      chunk_bytes_(round_up(plan.chunk_bytes(), 64) + sizeof(Canary)),
      chunks_(plan.chunks()),
      words_((chunks_ + kBits - 1) / kBits),
      rows_(std::min(plan.readers + kMoreReaders, kBits)),
      flags_(processes) {}

void LocalPool::lay_out_control(std::byte* at) {
  state_ = reinterpret_cast<PoolState*>(at);
  ring_ = reinterpret_cast<PoolSlot*>(at + sizeof(PoolState));
}

void LocalPool::lay_out_flags(uint32_t process, std::byte* at) {
  Word* words = reinterpret_cast<Word*>(at);
  flags_[process - 1] = {words, words + 1};
}

uint32_t LocalPool::mark(std::span<uint64_t> used, uint32_t trusted) const {
  std::fill(used.begin(), used.end(), 0);
  const auto add = [&](uint32_t chunk) {
    if (chunk < chunks_) used[chunk / kBits] |= uint64_t{1} << chunk % kBits;
  };
  const auto for_each_word = [&](const ProcessFlags& flags, const auto& visit) {
    for (uint64_t rows = flags.claimed->load() & low_bits(rows_); rows != 0; rows &= rows - 1) {
      const Word* row = flags.rows + static_cast<uint32_t>(std::countr_zero(rows)) * words_;
      for (uint32_t w = 0; w < words_; ++w) visit(w, row[w].load());
    }
  };
  for (uint32_t process = 1; process <= flags_.size(); ++process) {
    const ProcessFlags& flags = flags_[process - 1];
    uint32_t held = 0;
    if (trusted != kTrustAll && trusted != process)
      for_each_word(flags, [&](uint32_t, uint64_t word) { held += static_cast<uint32_t>(std::popcount(word)); });
    if (held <= plan_.held) for_each_word(flags, [&](uint32_t w, uint64_t word) { used[w] |= word; });
  }
  used[words_ - 1] &= low_bits(chunks_ - (words_ - 1) * kBits);
  for (uint32_t i = 0; i < plan_.history; ++i)
    if (ring_[i].sequence.load(std::memory_order_relaxed) != 0) add(ring_[i].chunk.load(std::memory_order_relaxed));
  add(state_->loaned.load(std::memory_order_relaxed) - 1);
  uint32_t count = 0;
  for (const uint64_t word : used) count += static_cast<uint32_t>(std::popcount(word));
  return count;
}

void LocalPool::mark_end(uint32_t chunk) const { canary(chunk).fill(kCanary ^ chunk); }

bool LocalPool::intact(uint32_t chunk) const {
  const Canary& end = canary(chunk);
  return std::all_of(end.begin(), end.end(), [&](uint64_t word) { return word == (kCanary ^ chunk); }) &&
         header(chunk)->loan_offset == offset(header(chunk)) && plan_.intact(header(chunk) + 1);
}

uint32_t LocalPool::in_use() const {
  std::vector<uint64_t> used(words_);
  return mark_used(used);
}

void LocalPool::announce(uint32_t chunk, int64_t stamp_ns, int64_t visible_at_ns, uint32_t commit,
                         int64_t delay_ns) const {
  const uint64_t sequence = state_->newest.load(std::memory_order_relaxed) + 1;
  PoolSlot& place = slot(sequence);
  evict(place);
  reached(MessageStep::inside_publish, index_);
  // Released: whoever reads one of the new values also finds the slot emptied when it looks at the sequence again.
  place.chunk.store(chunk, std::memory_order_release);
  place.commit.store(commit, std::memory_order_release);
  place.delay_ns.store(delay_ns, std::memory_order_release);
  place.stamp_ns.store(stamp_ns, std::memory_order_release);
  place.visible_at_ns.store(visible_at_ns, std::memory_order_release);
  reached(MessageStep::inside_publish, index_);
  place.sequence.store(sequence, std::memory_order_release);
  reached(MessageStep::inside_publish, index_);
  state_->newest.store(sequence, std::memory_order_release);
  state_->loaned.store(0, std::memory_order_release);
  reached(MessageStep::after_publish, index_);
}

uint64_t LocalPool::first_announced() const {
  uint64_t first = state_->newest.load(std::memory_order_relaxed) + 1;
  while (first > 1 && slot(first - 1).sequence.load() == first - 1 && slot(first - 1).commit.load() != 0) --first;
  return first;
}

void LocalPool::withdraw(uint64_t first) const {
  const uint64_t newest = state_->newest.load(std::memory_order_relaxed);
  state_->newest.store(first - 1);  // before the slots: reclaim_writer() finds what is left of them
  for (uint64_t s = newest; s >= first; --s)
    if (slot(s).sequence.load() == s) evict(slot(s));
}

LocalPool::Word* LocalPool::claim_row(uint32_t process) const {
  const ProcessFlags& flags = flags_[process - 1];
  uint64_t claimed = flags.claimed->load();
  for (;;) {
    const uint64_t free = ~claimed & low_bits(rows_);
    if (free == 0) break;
    const auto row = static_cast<uint32_t>(std::countr_zero(free));
    if (flags.claimed->compare_exchange_weak(claimed, claimed | (uint64_t{1} << row)))
      return flags.rows + size_t{row} * words_;
  }
  throw std::runtime_error("output " + plan_.node + "." + plan_.port + " has more than " + std::to_string(rows_) +
                           " readers in one process");
}

void LocalPool::clear(Word* row) const {
  for (uint32_t w = 0; w < words_; ++w) row[w].store(0);
}

void LocalPool::return_row(uint32_t process, Word* row) const {
  clear(row);
  const ProcessFlags& flags = flags_[process - 1];
  flags.claimed->fetch_and(~(uint64_t{1} << static_cast<uint64_t>(row - flags.rows) / words_));
}

void LocalPool::reclaim_readers(uint32_t process) const {
  const ProcessFlags& flags = flags_[process - 1];
  for (uint32_t row = 0; row < rows_; ++row) clear(flags.rows + size_t{row} * words_);
  flags.claimed->store(0);
}

void LocalPool::reclaim_writer() const {
  constexpr uint64_t kMost = uint64_t{1} << 62;  // no port publishes that many: a stray store
  if (state_->newest.load() >= kMost) state_->newest.store(0);
  for (uint32_t i = 0; i < plan_.history; ++i) {
    const uint64_t sequence = ring_[i].sequence.load();
    if (sequence == 0) continue;
    // What the dead process wrote over in its last moments must not lead its successor out of the pool.
    if (sequence >= kMost || &slot(sequence) != &ring_[i] || ring_[i].chunk.load() >= chunks_) evict(ring_[i]);
    else if (sequence > state_->newest.load()) state_->newest.store(sequence);  // a message that had its number is out
  }
  state_->loaned.store(0);
}

}  // namespace takt
