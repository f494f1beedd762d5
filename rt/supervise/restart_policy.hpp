// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <deque>
#include <optional>

namespace takt {

/// When a process that has ended is started again. At once after a long life; the sooner it dies again, the longer the
/// wait, so that one that cannot live does not take the machine from the others; never again after too many in a short
/// time. Time is given. One thread at a time.
class RestartPolicy {
 public:
  struct Limits {
    int64_t first_wait_ns = 0;
    int64_t step_ns = 50'000'000;     ///< wait after the second end within `calm`; doubled by each further one
    int64_t most_ns = 1'000'000'000;  ///< longest wait
    int64_t calm_ns = 5'000'000'000;  ///< who has lived that long starts with a clean sheet
    size_t most_in_window = 12;       ///< ends within `window` after which it is given up
    int64_t window_ns = 30'000'000'000;
  };

  RestartPolicy() = default;
  explicit RestartPolicy(const Limits& limits) : limits_(limits) {}

  /// It was started then.
  void started(int64_t now_ns) { started_ns_ = now_ns; }
  /// It has ended now: the instant of its next start, or nothing if it is given up.
  std::optional<int64_t> ended(int64_t now_ns);

 private:
  Limits limits_{};
  std::deque<int64_t> ends_;  ///< within the window
  int64_t started_ns_ = 0, wait_ns_ = 0;
};

}  // namespace takt
