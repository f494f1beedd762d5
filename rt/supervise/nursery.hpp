// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "rt/memory/sanitized.hpp"

namespace takt {

/// Processes that have no threads, made while their maker had none either, and fork for it whenever it asks: a fork of
/// a process with threads is unsafe, since only the calling thread lives on, and a lock that another one had is never
/// opened again. What they fork become children of the maker. One works, a spare waits: if the one dies, or does not
/// answer in time, the spare takes its place and forks a new spare of itself. Made before the maker has threads; one
/// thread at a time.
class Nursery {
 public:
  using Body = std::function<int(size_t child)>;
  static constexpr int64_t kPatience_ns = kSlowdown * 500'000'000LL;  ///< for an answer

  /// `body` runs in the children, with what the maker's memory held when the nursery was made. `priority`: SCHED_FIFO
  /// of the nursery, which the children begin with; 0, or without the right to it: none. Throws std::runtime_error.
  explicit Nursery(Body body, int priority = 0);
  /// Ends it; its children stay.
  ~Nursery();
  Nursery(const Nursery&) = delete;
  Nursery& operator=(const Nursery&) = delete;

  /// A new process that runs body(child) and exits with its result; 0 if there can be none now. Waits for kPatience_ns
  /// at most for each of the two that does not answer.
  pid_t fork_child(size_t child);
  /// Sees who of the two has died, and has a new spare made. Every now and then.
  void look();
  /// The one that works, and the spare; fewer if there are none.
  std::vector<pid_t> pids() const;
  /// How many have died or were ended because they did not answer.
  size_t lost() const { return lost_; }

 private:
  static constexpr size_t kItself = SIZE_MAX;  ///< in place of a child: a spare
  static constexpr size_t kOrders = 64;
  struct Ask {
    size_t child = 0, order = 0;
  };
  /// In memory that all of them share. An order that was given up must not be carried out later, by one that had only
  /// been held up: the maker would not know that child.
  struct Order {
    std::atomic<pid_t> forked{0};
    std::atomic<bool> withdrawn{false};
  };
  struct Hand {
    pid_t pid = 0;  ///< 0: none
    int socket = -1;
  };

  Hand fork_first();
  [[noreturn]] void serve(int answers);
  /// In a process of its own, which ends at once.
  [[noreturn]] void fork_once(const Ask& ask, int answers, int passed);
  /// The process that the one that works has forked (0: it could not); nothing if it does not answer.
  std::optional<pid_t> ask(size_t child, int passed = -1);
  void bury(Hand& hand);
  void let_spare_work();

  const Body body_;
  const int priority_;
  const pid_t maker_;
  Order* orders_ = nullptr;
  size_t asked_ = 0, lost_ = 0;
  std::array<Hand, 2> hands_{};  ///< the first one works
};

}  // namespace takt
