// SPDX-License-Identifier: Apache-2.0
// Where threads note their events. A thread without a ring notes nothing: one comparison of a thread-local pointer.
#pragma once
#include <string_view>

#include "rt/trace/ring.hpp"

namespace takt::trace {

/// The rings of a run in one shared mapping, made before its processes are; a killed process leaves its events behind.
/// Every thread claims one of its own and keeps it.
class Rings {
 public:
  /// Throws std::runtime_error if there is no memory.
  explicit Rings(size_t count);
  ~Rings();
  Rings(const Rings&) = delete;
  Rings& operator=(const Rings&) = delete;

  /// A ring for the calling thread, or for one that is only imagined, under a number of its own (virtual time); null if
  /// all are taken (counted). Who takes the place of a thread of the same name that died with its process goes on with
  /// its ring. Not in a job.
  Ring* claim(std::string_view name, int32_t imagined = 0);
  size_t claimed() const;
  Ring& ring(size_t i) { return rings_[i]; }
  /// Threads that came when every ring was taken: their events are not in the trace.
  size_t refused() const;

 private:
  struct alignas(Ring) Shared {
    std::atomic<size_t> next{0};
  };
  size_t count_, bytes_;
  Shared* shared_ = nullptr;
  Ring* rings_ = nullptr;
};

namespace detail {
inline constinit thread_local Ring* thread_ring = nullptr;
}

/// True if the calling thread is traced.
inline bool on() { return detail::thread_ring != nullptr; }

/// Events that the calling thread found no room for.
inline uint64_t lost() { return on() ? detail::thread_ring->lost() : 0; }

/// Notes an event if the calling thread is traced. No lock, no allocation, no system call.
inline void record(const Event& event) {
  if (Ring* ring = detail::thread_ring) ring->push(event);
}

/// The calling thread is traced into a ring of `rings` while this lives; null: it is not.
class Thread {
 public:
  Thread(Rings* rings, std::string_view name) {
    if (rings != nullptr) detail::thread_ring = rings->claim(name);
  }
  ~Thread() { detail::thread_ring = nullptr; }
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;
};

/// The calling thread notes into `ring` while this lives, as if it were another thread.
class As {
 public:
  explicit As(Ring* ring) { detail::thread_ring = ring; }
  ~As() { detail::thread_ring = nullptr; }
  As(const As&) = delete;
  As& operator=(const As&) = delete;
};

/// A node does less, or more again, from that job on.
inline void level_change(uint16_t task, uint32_t job, int level, int64_t now_ns) {
  record({now_ns, level, 0, job, task, Kind::level, 0});
}

}  // namespace takt::trace
