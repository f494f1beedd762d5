// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>

#include "rt/own_thread.hpp"
#include "rt/sched/grant.hpp"
#include "rt/time/clock.hpp"

namespace takt {

/// A thread that looks, sleeps until the instant at which it is to look again, and so on until it is destroyed.
///
///     Lookout lookout("takt-watchdog", reservation, clock, [&](int64_t now_ns) { return now_ns + 1'000'000; });
class Lookout {
 public:
  /// `look` gets the present instant and returns the next one; kNever: not before wake().
  Lookout(const std::string& name, const Reservation& wanted, const Clock& clock, std::function<int64_t(int64_t)> look);
  ~Lookout();
  Lookout(const Lookout&) = delete;
  Lookout& operator=(const Lookout&) = delete;

  /// It looks at once. Any thread.
  void wake();

  static constexpr int64_t kNever = INT64_MAX;

 private:
  void work();

  const std::string name_;
  const Reservation wanted_;
  const Clock& clock_;
  const std::function<int64_t(int64_t)> look_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool woken_ = false, end_ = false;
  OwnThread thread_;  // the last: it uses the others
};

}  // namespace takt
