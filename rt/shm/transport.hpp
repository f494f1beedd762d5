// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/transport.hpp>: core, experimental.
// The transport interface: how a message gets from one output to its inputs without being copied. Two back ends: local
// (one run's own memory, no daemon; between processes see local_transport.hpp) and iceoryx.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "rt/msg/layout.hpp"

namespace takt {

class Clock;
class CommitRing;

/// In front of every message in its chunk; written by the runtime only.
struct alignas(64) MessageHeader {
  int64_t stamp_ns = 0;       ///< time of validity, set once by the device that captured the data
  int64_t published_ns = 0;   ///< instant of publication
  int64_t visible_at_ns = 0;  ///< consumers released before this instant must not see the message
  uint64_t sequence = 0;      ///< 1, 2, 3 ... per output
  uint64_t loan_offset = 0;   ///< where the chunk lay in shared memory when it was loaned; compared at each take
  int32_t level = 0;          ///< quality level of the job that made it
};

/// One listed but not yet held message of an edge.
struct Candidate {
  uint64_t sequence = 0;
  int64_t stamp_ns = 0;
  int64_t visible_at_ns = 0;
};

/// A message an input holds. `chunk` is the header's address; the message follows it.
struct Held {
  const MessageHeader* header = nullptr;
  uint64_t sequence = 0;
  int64_t stamp_ns = 0;
  int64_t visible_at_ns = 0;
  uint32_t chunk = 0;  ///< back end's own handle
  const void* message() const { return header + 1; }
  explicit operator bool() const { return header != nullptr; }
};

/// What an output or an edge has seen; read after the run or (approximately) during it.
struct WriterStatistics {
  uint64_t sent = 0, pool_empty = 0;
  uint32_t chunks = 0, peak_in_use = 0, in_use = 0;
  uint64_t bytes = 0;  ///< of the whole pool
};

/// Output side of a port. One thread at a time.
class Writer {
 public:
  virtual ~Writer() = default;
  /// A chunk to write into, placed and empty; null if none is free. At most one loan at a time.
  virtual MessageHeader* loan() = 0;
  /// Publishes the loaned chunk.
  virtual void publish(int64_t stamp_ns, int64_t published_ns, int64_t visible_at_ns) = 0;
  /// False if something was written past the end of the loaned message, or over its structure.
  virtual bool intact() const { return true; }
  /// Gives the loaned chunk back unpublished.
  virtual void discard() = 0;
  /// Publishes the previous message again, with its old stamp; false if there is none.
  virtual bool repeat(int64_t published_ns, int64_t visible_at_ns) = 0;

  /// Publication in two steps, so that all outputs of a job become visible together (commit_ring.hpp): each is
  /// announced under the job's commit, and settled once that is filled. False: this back end has no such steps, and
  /// publishes.
  virtual bool announces() const { return false; }
  /// The loaned chunk is complete. It becomes visible `delay_ns` after its commit.
  virtual void announce(int64_t stamp_ns, uint32_t commit, int64_t delay_ns) {
    static_cast<void>(stamp_ns), static_cast<void>(commit), static_cast<void>(delay_ns);
  }
  /// The same for the previous message, with its old stamp; false if there is none.
  virtual bool announce_again(uint32_t commit, int64_t delay_ns) {
    return static_cast<void>(commit), static_cast<void>(delay_ns), false;
  }
  /// What stands announced is published; with `visible_at_ns` CommitRing::kNever it is taken back, as if it had not
  /// been.
  virtual void settle(int64_t published_ns, int64_t visible_at_ns) {
    static_cast<void>(published_ns), static_cast<void>(visible_at_ns);
  }

  virtual WriterStatistics statistics() const = 0;
  /// Asks for the memory that the next loan and its publication will touch, without waiting for it.
  virtual void rehearse() const { static_cast<void>(statistics()); }
  /// Before the first publication: where an earlier writer of this output, which died, came to. `noted` is what others
  /// noted of that, for back ends that do not know better.
  virtual uint64_t go_on_after(uint64_t noted) { return noted; }
};

/// Input side of an edge. One thread at a time.
class Reader {
 public:
  virtual ~Reader() = default;
  /// Before list(), for a reader that belongs to a job: the commits of the job that makes this output, and the clock
  /// that its own releases are told by. Without them what is announced is not listed before it is settled.
  virtual void set_commits(CommitRing& commits, const Clock& clock) {
    static_cast<void>(commits), static_cast<void>(clock);
  }
  /// The messages with visible_at <= limit that can still be taken, newest first; returns how many were listed.
  virtual size_t list(int64_t limit_ns, std::span<Candidate> out) = 0;
  /// Holds one of them; an empty Held if it was overwritten meanwhile, or is damaged.
  virtual Held take(uint64_t sequence) = 0;
  /// Messages that take() found damaged: another process wrote where it should not. Counted once each.
  virtual uint64_t damaged() const { return 0; }
  virtual void release(Held& held) = 0;
};

/// One output with its edges, as the graph fixes it before start.
struct PortPlan {
  std::string node, port;
  const MessageType* type = nullptr;
  Capacity capacity;
  uint32_t history = 1;  ///< messages kept for consumers that start late
  uint32_t held = 0;     ///< sum over consumers of the messages each may hold at once
  uint32_t readers = 0;
  std::optional<ArrayCounts> counts = {};  ///< where the type is described: what the owner says; else its type knows
  uint32_t chunks() const { return history + held + 2; }  ///< + one loaned, + one being evicted
  uint64_t message_bytes() const { return counts ? bytes_of(*type, *counts) : type->bytes(capacity); }
  uint64_t chunk_bytes() const { return sizeof(MessageHeader) + message_bytes(); }
  bool intact(const void* message) const {
    return counts ? takt::intact(*type, message, *counts) : type->intact(message, capacity);
  }
};

/// Memory of all ports of one graph. Made before start, outlives all writers and readers.
class Transport {
 public:
  virtual ~Transport() = default;
  virtual std::unique_ptr<Writer> make_writer(size_t port) = 0;
  virtual std::unique_ptr<Reader> make_reader(size_t port) = 0;
  virtual uint64_t shared_memory_bytes() const = 0;
  /// "local" or "iceoryx".
  virtual const char* name() const = 0;
  /// Takes back what a dead process of that number held; the number of chunks that became free. A back end that does so
  /// by itself, or has one process only, answers 0.
  virtual uint32_t reclaim(uint32_t process) { return static_cast<void>(process), 0; }
  /// Asks the daemon that the transport depends on, and returns when it has answered: never if it hangs. At once where
  /// there is none. Not in a job.
  virtual void ask_daemon() {}
  /// Of all ports together, queues of readers included; 0 in a process that joined another one's memory.
  virtual uint32_t chunks_in_use() const { return 0; }
};

/// All pools in one anonymous shared-memory file, locked and prefaulted. Throws std::runtime_error with the fix if the
/// machine has not enough memory. Nothing is left behind at exit, however it comes.
std::unique_ptr<Transport> make_local_transport(std::span<const PortPlan> ports);

/// The same over iceoryx with the daemon embedded in this process. Throws TransportError (exit 3) if another daemon
/// holds the locks, naming its owner and the fix.
std::unique_ptr<Transport> make_iceoryx_transport(std::span<const PortPlan> ports);

}  // namespace takt
