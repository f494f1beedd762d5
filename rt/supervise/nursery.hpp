// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <functional>

namespace takt {

/// A process that has no thread but its first, so that it can still fork when its maker, which has many by then, can
/// not: after a fork only the calling thread lives on, and a lock that another one had is never opened again. What it
/// forks become children of its maker. Made before the maker has threads; one thread at a time.
class Nursery {
 public:
  using Body = std::function<int(size_t child)>;

  /// `body` runs in the children, with what the maker's memory held when the nursery was made. Throws
  /// std::runtime_error.
  explicit Nursery(Body body);
  /// Ends it; its children stay.
  ~Nursery();
  Nursery(const Nursery&) = delete;
  Nursery& operator=(const Nursery&) = delete;

  /// A new process that runs body(child) and exits with its result; 0 if there can be none, or the nursery is dead.
  pid_t fork_child(size_t child);
  pid_t pid() const { return pid_; }

 private:
  [[noreturn]] void serve();
  /// In a process of its own, which ends at once: leaves the child's number in `pid`.
  [[noreturn]] void fork_once(size_t child, volatile pid_t& pid) const;

  const Body body_;
  const pid_t maker_;
  pid_t pid_ = 0;
  int asks_ = -1;     ///< the maker's end of a socket pair
  int answers_ = -1;  ///< the nursery's
};

}  // namespace takt
