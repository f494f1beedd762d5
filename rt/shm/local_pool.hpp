// SPDX-License-Identifier: Apache-2.0
// The memory of the local transport. A port is an array of chunks and a ring of slots, one per kept message; they lie
// in one shared-memory file, which several processes map. Each word of it has one process that writes it: the state,
// the ring and the chunks of a port that of its writer; the flags of readers that of the readers.
//
// A chunk is free if no slot names it, the writer has not loaned it, and no reader flags it. There is no free list to
// corrupt and nothing to lock, and when a process has been killed, at whatever instant, its pages say all that must be
// taken back from it: see reclaim_readers() and reclaim_writer().
//
// Why no reader ever holds a chunk that the writer fills (hazard pointers: Michael, 2004; the order is Dekker's):
//   reader  F: sets its flag of the chunk      C: looks whether the slot still has the sequence, else drops the flag
//   writer  E: empties the slot (evict)        S: looks at all flags (mark_used), once a loan, then chooses a chunk
// All four are sequentially consistent, so they have one order. F before S: the writer sees the flag and leaves the
// chunk alone. S before F: then E, S, F, C, and C finds the slot empty or with another sequence. A sequence comes twice
// only where its first message was withdrawn, which no reader can have listed.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "rt/hot.hpp"
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
  std::atomic<uint64_t> newest{0};  ///< sequence of the newest message
  std::atomic<uint64_t> pool_empty{0};
  std::atomic<uint32_t> peak_in_use{0};
  std::atomic<uint32_t> loaned{0};  ///< 1 + the chunk that the writer has on loan; 0: none
  std::atomic<uint32_t> writer{0};  ///< the process that made the last writer
};

/// A port as one process sees it.
class LocalPool {
 public:
  using Word = std::atomic<uint64_t>;

  /// Processes have the numbers 1 to `processes`.
  LocalPool(const PortPlan& plan, size_t index, uint32_t processes);

  /// What lies in pages of the port's writer, and of each process that may read. Zeros mean that all is empty.
  uint64_t control_bytes() const { return sizeof(PoolState) + sizeof(PoolSlot) * plan_.history; }
  uint64_t bytes() const { return chunk_bytes_ * chunks_; }
  uint64_t flag_bytes() const { return sizeof(Word) * (1 + uint64_t{rows_} * words_); }
  void lay_out_control(std::byte* at);
  void lay_out_chunks(std::byte* at) { base_ = at; }
  void lay_out_flags(uint32_t process, std::byte* at);

  const PortPlan& plan() const { return plan_; }
  size_t index() const { return index_; }
  uint32_t chunks() const { return chunks_; }
  uint32_t slots() const { return plan_.history; }
  uint64_t chunk_bytes() const { return chunk_bytes_; }
  /// Words of a set of chunks, one bit each.
  uint32_t words() const { return words_; }
  PoolState& state() const { return *state_; }
  MessageHeader* header(uint32_t chunk) const { return reinterpret_cast<MessageHeader*>(base_ + chunk * chunk_bytes_); }
  /// Marks the end of a chunk before its message is written, and looks whether the mark, the header and the structure
  /// of the message are what they were.
  void mark_end(uint32_t chunk) const;
  bool intact(uint32_t chunk) const;
  /// Asks for what a message begins and ends with.
  void prefetch_ends(uint32_t chunk) const {
    prefetch(header(chunk), sizeof(MessageHeader) + kCacheLine);
    prefetch(&canary(chunk), sizeof(Canary));
  }
  uint64_t offset(const MessageHeader* header) const {
    return static_cast<uint64_t>(reinterpret_cast<const std::byte*>(header) - base_);
  }
  PoolSlot& slot(uint64_t sequence) const { return ring_[sequence % plan_.history]; }

  /// Sets exactly the bits of the chunks that are not free; returns how many they are.
  uint32_t mark_used(std::span<uint64_t> used) const { return mark(used, kTrustAll); }
  /// The same for a process that finds none free, though there is one for whatever readers may hold: as if another one
  /// that flags more chunks than all readers together may hold flagged none. It has written over its flags.
  uint32_t mark_plausible(std::span<uint64_t> used, uint32_t process) const { return mark(used, process); }
  uint32_t in_use() const;

  /// Publishes a chunk, on loan or in the ring already, as the next message; under a commit it only announces it, see
  /// PoolSlot. Nothing is on loan afterwards.
  void announce(uint32_t chunk, int64_t stamp_ns, int64_t visible_at_ns, uint32_t commit, int64_t delay_ns) const;
  /// Number of the oldest message that is not settled: one more than the newest if there is none.
  uint64_t first_announced() const;
  /// Takes back the messages from that one on: none of them has been visible.
  void withdraw(uint64_t first) const;
  /// Empties a slot.
  void evict(PoolSlot& slot) const { slot.sequence.exchange(0); }

  /// A row of flags, words() long and empty, for a reader of that process. Throws std::runtime_error if there is none
  /// left.
  Word* claim_row(uint32_t process) const;
  void return_row(uint32_t process, Word* row) const;
  /// Drops what the readers of a process held that has ended without returning it. Once it is certainly dead.
  void reclaim_readers(uint32_t process) const;
  /// Brings a port in order whose writer has ended within a publication or with a chunk on loan. What it had published
  /// stays. Once it is certainly dead; others may go on reading meanwhile.
  void reclaim_writer() const;

 private:
  using Canary = std::array<uint64_t, 8>;
  static constexpr uint64_t kCanary = 0x5af0'c3e7'1b96'd8a2;  // no text, no number of any size that a node would write
  Canary& canary(uint32_t chunk) const {
    return *reinterpret_cast<Canary*>(base_ + (chunk + 1) * chunk_bytes_ - sizeof(Canary));
  }
  struct ProcessFlags {
    Word* claimed = nullptr;  ///< one bit a row
    Word* rows = nullptr;
  };
  static constexpr uint32_t kTrustAll = 0;
  uint32_t mark(std::span<uint64_t> used, uint32_t trusted) const;
  void clear(Word* row) const;

  PortPlan plan_;
  size_t index_;
  uint64_t chunk_bytes_;
  uint32_t chunks_, words_, rows_;
  PoolState* state_ = nullptr;
  PoolSlot* ring_ = nullptr;
  std::byte* base_ = nullptr;
  std::vector<ProcessFlags> flags_;  ///< by process
};

}  // namespace takt
