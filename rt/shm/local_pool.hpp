// SPDX-License-Identifier: Apache-2.0
// The memory of the local transport. A port is an array of chunks and a ring of slots, one per kept message; both lie
// in one shared-memory file, so that several processes can map it.
//
// Who holds a chunk is one bit of the chunk's mask: one for the writer that has loaned it, one for the ring that keeps
// it, one for each reader. A mask of 0 is a free chunk. So there is no free list to corrupt and nothing to lock, and
// when a process has been killed, at whatever instant, its bits say all that must be taken back from it: see reclaim().
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "rt/shm/transport.hpp"

namespace takt {

/// One kept message of a port.
struct PoolSlot {
  std::atomic<uint64_t> sequence{0};  ///< 0 while empty or being changed
  std::atomic<uint32_t> chunk{0};
  std::atomic<uint32_t> commit{0};  ///< of the job that announced it; 0: settled
  std::atomic<int64_t> stamp_ns{0};
  std::atomic<int64_t> visible_at_ns{0};  ///< once it is settled
  std::atomic<int64_t> delay_ns{0};       ///< before: how long after its commit
};

/// One per port.
struct alignas(64) PoolState {
  static constexpr uint32_t kHolders = 64;
  static constexpr uint32_t kWriter = 0, kRing = 1, kFirstReader = 2;
  std::atomic<uint64_t> newest{0};  ///< sequence of the newest message
  std::atomic<uint64_t> pool_empty{0};
  std::atomic<uint32_t> peak_in_use{0};
  std::atomic<uint32_t> writer{0};  ///< the process that made the last writer
  /// By bit: the process whose reader has it; 0: nobody.
  std::array<std::atomic<uint32_t>, kHolders> readers{};
};

/// A port as one process sees it.
class LocalPool {
 public:
  static constexpr uint64_t bit(uint32_t holder) { return uint64_t{1} << holder; }

  LocalPool(const PortPlan& plan, size_t index);

  /// Where a port lies in the file: first what all ports are managed by, then their chunks. `place` is called with the
  /// bytes of each part and answers where it is.
  template <class Place>
  void lay_out_control(Place&& place) {
    state_ = reinterpret_cast<PoolState*>(place(sizeof(PoolState)));
    holders_ = reinterpret_cast<std::atomic<uint64_t>*>(place(sizeof(std::atomic<uint64_t>) * chunks_));
    ring_ = reinterpret_cast<PoolSlot*>(place(sizeof(PoolSlot) * plan_.history));
  }
  template <class Place>
  void lay_out_chunks(Place&& place) {
    base_ = place(bytes());
  }
  /// In fresh memory, once.
  void construct();

  const PortPlan& plan() const { return plan_; }
  size_t index() const { return index_; }
  uint32_t chunks() const { return chunks_; }
  uint32_t slots() const { return plan_.history; }
  uint64_t chunk_bytes() const { return chunk_bytes_; }
  uint64_t bytes() const { return chunk_bytes_ * chunks_; }
  PoolState& state() const { return *state_; }
  MessageHeader* header(uint32_t chunk) const { return reinterpret_cast<MessageHeader*>(base_ + chunk * chunk_bytes_); }
  uint64_t offset(const MessageHeader* header) const {
    return static_cast<uint64_t>(reinterpret_cast<const std::byte*>(header) - base_);
  }
  PoolSlot& slot(uint64_t sequence) const { return ring_[sequence % plan_.history]; }

  /// Takes a free chunk for the writer; false if it is not free.
  bool loan(uint32_t chunk) const {
    uint64_t free = 0;
    return holders_[chunk].compare_exchange_strong(free, bit(PoolState::kWriter), std::memory_order_acq_rel);
  }
  /// A further holder of a chunk; false if nobody has it any more.
  bool hold(uint32_t chunk, uint32_t holder) const {
    uint64_t holders = holders_[chunk].load();
    do {
      if (holders == 0) return false;
    } while (!holders_[chunk].compare_exchange_weak(holders, holders | bit(holder)));
    return true;
  }
  void drop(uint32_t chunk, uint32_t holder) const {
    holders_[chunk].fetch_and(~bit(holder), std::memory_order_acq_rel);
  }
  uint32_t in_use() const;

  /// Publishes a chunk that the writer holds, as the next message; under a commit it only announces it, see PoolSlot.
  /// The writer holds it no longer afterwards.
  void announce(uint32_t chunk, int64_t stamp_ns, int64_t visible_at_ns, uint32_t commit, int64_t delay_ns) const;
  /// Number of the oldest message that is not settled: one more than the newest if there is none.
  uint64_t first_announced() const;
  /// Takes back the messages from that one on: none of them has been visible.
  void withdraw(uint64_t first) const;
  /// Empties a slot.
  void evict(PoolSlot& slot) const;

  /// A bit for a reader of that process. Throws std::runtime_error if there is none left.
  uint32_t claim_reader(uint32_t process) const;
  void return_reader(uint32_t holder) const;
  /// Takes back what a process held that has ended without returning it: chunks on loan or half published, held
  /// messages, bits of readers. What it had published stays. Once the process is certain to be dead; others may go on
  /// reading meanwhile. The number of chunks that are free now and were not before.
  uint32_t reclaim(uint32_t process) const;

 private:
  bool in_ring(uint32_t chunk) const;

  PortPlan plan_;
  size_t index_;
  uint64_t chunk_bytes_;
  uint32_t chunks_;
  PoolState* state_ = nullptr;
  std::atomic<uint64_t>* holders_ = nullptr;
  PoolSlot* ring_ = nullptr;
  std::byte* base_ = nullptr;
};

}  // namespace takt
