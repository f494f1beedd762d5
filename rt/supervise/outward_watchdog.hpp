// SPDX-License-Identifier: Apache-2.0
// Tells those outside the run that it is well, and nothing once it is not: systemd, or a watchdog of the machine, then
// starts it anew.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rt/sched/run_board.hpp"

namespace takt {

/// Somebody outside who acts when he hears nothing for a while. One thread at a time; no call waits.
class WatchdogSink {
 public:
  virtual ~WatchdogSink() = default;
  /// He acts after so long without a feed, ns; 0: never, he only listens.
  virtual int64_t timeout_ns() const = 0;
  virtual void ready() = 0;  ///< the run has begun
  virtual void feed() = 0;
  virtual void status(const std::string& text) = 0;  ///< one line for a person
  /// The run ends in order, on purpose: he must not act any more. Without this word he will.
  virtual void end() = 0;
};

/// What is known of one high-criticality task.
struct FedTask {
  bool runs = true;     ///< the mode lets it
  uint64_t misses = 0;  ///< of deadlines, since the last feed
  int64_t idle_ns = 0;  ///< since it was last seen to have got further
  int64_t patience_ns =
      0;  ///< it must get further within that; 0: it need not (released by messages that may not come)
};

/// The first task that forbids to feed: the mode lets it run, and it has missed a deadline or got no further. Nothing:
/// all is well.
std::optional<size_t> forbids_feeding(std::span<const FedTask> tasks);

/// Feeds all sinks at half of the shortest timeout while every high-criticality task is well: its deadlines were met
/// since the last feed, and it got further within two periods and a deadline. A miss is not forgiven: without a feed
/// the count since the last one stays. Before the epoch there is nothing to judge: it is fed. After the end of the
/// run the judgement stays as it was. Ticked by one thread; the instants are its own (CLOCK_MONOTONIC, injected).
class OutwardWatchdog {
 public:
  /// Plan, board and sinks outlive it.
  OutwardWatchdog(const Plan& plan, RunBoard& board, std::vector<WatchdogSink*> sinks);

  /// Several times in interval_ns().
  void tick(int64_t now_ns);
  /// The run is over as it should be.
  void end();
  /// Between feeds; 0: nobody asks for any.
  int64_t interval_ns() const { return interval_ns_; }

 private:
  struct Watched {
    size_t task = 0;
    int64_t patience_ns = 0;
    uint64_t jobs = 0;  ///< when it was last seen to have got further
    int64_t progress_ns = 0;
    uint64_t misses = 0, misses_at_feed = 0;
  };
  void look(int64_t now_ns);
  void feed(int64_t now_ns);
  void tell_status(int64_t now_ns);

  const Plan& plan_;
  RunBoard& board_;
  const std::vector<WatchdogSink*> sinks_;
  int64_t interval_ns_ = 0;
  std::vector<Watched> watched_;
  std::vector<FedTask> seen_;       ///< by watched task
  std::optional<size_t> at_fault_;  ///< of them
  std::optional<int64_t> fed_ns_;
  bool ready_ = false;
  std::string status_;
};

}  // namespace takt
