// SPDX-License-Identifier: Apache-2.0
// When the machine was away: the host of a virtual machine ran somebody else, or its kernel let no thread run. Two
// witnesses. The kernel's steal counter, in steps of its clock tick; and a probe on each core, which sees shorter
// absences, under `deadline` only while no job of the run is under way.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <vector>

#include "rt/own_thread.hpp"
#include "rt/sched/plan.hpp"

namespace takt {

class RunBoard;

/// The machine was away for `away_ns` of [from, to).
struct Stall {
  static constexpr int kAllCpus = -1;
  int64_t from_ns = 0, to_ns = 0, away_ns = 0;
  int cpu = kAllCpus;  ///< of a probe; the steal counter is the sum over all CPUs
};

/// Stalls of one run, in memory sized before the start. One thread at a time.
class StallLog {
 public:
  static constexpr size_t kMost = 8192;
  StallLog() { stalls_.reserve(kMost); }
  void add(const Stall& stall);
  const std::vector<Stall>& stalls() const { return stalls_; }
  /// Stalls that found no place.
  uint64_t lost() const { return lost_; }

 private:
  std::vector<Stall> stalls_;
  uint64_t lost_ = 0;
};

/// How long the machine was away within [from, to], by the witness that saw most of it.
int64_t away_ns(const std::vector<Stall>& stalls, int64_t from_ns, int64_t to_ns);

/// Reads a counter of stolen time now and then. The first reading is the beginning.
class StealReader {
 public:
  /// `read`: see StolenTime. The counter may lag behind by a tick of `tick_ns`.
  StealReader(std::function<int64_t()> read, int64_t tick_ns) : read_(std::move(read)), tick_ns_(tick_ns) {}
  void look(int64_t now_ns, StallLog& log);

 private:
  std::function<int64_t()> read_;
  int64_t tick_ns_ = 0, last_look_ns_ = 0, last_total_ns_ = 0;
};

/// What of [from, to] no job of a run was under way in, by the last jobs on the board. On which CPU does not matter: a
/// job of SCHED_DEADLINE may have had several.
int64_t idle_ns(const RunBoard& board, size_t tasks, int64_t from_ns, int64_t to_ns);

/// Looks from the constructor to end(). A probe is a thread of SCHED_FIFO above every lane and every watchdog that
/// wakes up every kProbe_ns: some 20 us each. Jobs of SCHED_DEADLINE go before it: where it wakes up late, the
/// time in which one was under way is no stall, as is known once they have ended (kSettled_ns later). Where the kernel
/// refuses the policy there is no probe.
class StallWatch {
 public:
  static constexpr int64_t kProbe_ns = 20'000'000, kSteal_ns = 50'000'000, kShortest_ns = 500'000;
  static constexpr int64_t kSettled_ns = 500'000'000;

  /// Probes on the cores of the plan; `stolen_ns`: see StolenTime, empty: not counted. The board outlives this.
  StallWatch(const Plan& plan, const RunBoard& board, std::function<int64_t()> stolen_ns);
  ~StallWatch() { end(); }
  StallWatch(const StallWatch&) = delete;
  StallWatch& operator=(const StallWatch&) = delete;

  /// Stops looking.
  const StallLog& end();

 private:
  void probe(int core);
  void read_steal();
  /// Those that have settled, or all: what is left of them without the jobs goes into the log.
  void settle(std::vector<Stall>& late, int64_t now_ns);

  const RunBoard& board_;
  const size_t tasks_;
  const bool jobs_go_before_;  ///< before a probe
  const std::function<int64_t()> stolen_ns_;
  std::atomic<bool> ended_{false};
  std::mutex mutex_;
  StallLog log_;
  std::vector<OwnThread> threads_;
};

}  // namespace takt
