// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "rt/memory/sanitized.hpp"
#include "rt/sched/job_watch.hpp"
#include "rt/sched/lookout.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/sched/stolen_time.hpp"
#include "rt/sched/watch_rules.hpp"
#include "rt/time/clock.hpp"

namespace takt {

/// Looks after the running jobs of one process. The kernel charges budgets at its tick (4 ms at 250 Hz); a watchdog
/// sleeps on a timer until the earliest instant at which a job can have used up its budget, and reads the job's own CPU
/// clock then.
///
/// - Under `fixed` each lane with a job that is minded has a thread of its own, on the lane's core and just above it
///   (kLaneStep). So it runs only when the lane could: a look at a preempted job costs its preemptors nothing. A job of
///   low criticality that has used its budget goes on with what real-time threads leave (demote_thread) until it ends;
///   counted `demoted`. One of high criticality keeps its priority.
/// - One thread more, above all workers under `fixed`, heeds what goes by the clock, and everything under the other
///   policies.
/// - Under `fixed` a job that hangs is demoted as well, whatever its criticality. Where a high node can no longer run,
/// and
///   nobody outside restarts this process, safe_stop is asked for.
/// - Under `deadline` a job that is late because its reservation pays for time that the host took (see judge_clock())
/// goes
///   on under SCHED_FIFO, as its node's next ones, until the kernel has forgotten that debt; counted `lifted`. One that
///   uses more than that goes on as an ordinary thread.
/// - Under `deadline` a worker that has used up its reservation goes on beside it before it is late (judge_reserve()):
///   one with a task of high criticality before all workers of SCHED_FIFO, any other behind them and, once it has used
///   half a budget more, as an ordinary thread; counted `lifted` as well.
/// - A worker of a restarted process that found no bandwidth free goes on beside its reservation in the same way, until
///   the kernel grants it (JobWatch::bind_beside()). What takes longer than the return of its predecessor's bandwidth
///   is told as a fault, with the number of refusals.
/// - `safe_stop` is asked for the moment a budget or a deadline has passed, not when the job ends.
/// - A job that has not returned `patience` after its deadline hangs: told once, by name. Under `cooperative` that ends
///   the run, unless somebody looks after this process.
///
/// Cost under `fixed`: most_looks() per job of a lane with a thread of its own. The other thread looks once per
/// patience, heartbeat and deadline that leads to safe_stop. The analysis charges both (lane_tasks()). Under `deadline`
/// one wake-up a job, and one every 50 ms, 5 ms while the host takes time: behind all reservations.
class Watchdog {
 public:
  /// How long a job may be late, or a process give no sign of life, until it counts as hung: 0.75 s, and 3 s where what
  /// runs are ordinary threads, which a busy machine keeps waiting.
  static constexpr int64_t patience_ns(Policy granted) {
    return kSlowdown * (granted == Policy::cooperative ? 3'000'000'000LL : 750'000'000LL);
  }
  struct Worker {
    JobWatch* watch = nullptr;
    std::vector<size_t> tasks;  ///< members of its lane: indexes into Plan::tasks
    Reservation has = {};       ///< of its thread; without a priority the lane gets no watchdog of its own
  };
  struct Options {
    Policy granted = Policy::cooperative;
    int64_t patience_ns = Watchdog::patience_ns(Policy::deadline);
    int priority = 0;                         ///< SCHED_FIFO; 0: none
    std::function<int64_t()> stolen_ns = {};  ///< see StolenTime
    /// Where somebody outside looks after this process: at least every `heartbeat_period` the instant of a look is left
    /// there, and a hang is for him to end. Null: nobody does.
    LifeSigns* life = nullptr;
    int64_t heartbeat_period_ns = kHeartbeat_ns;
  };

  Watchdog(const Plan& plan, RunBoard& board, const Clock& clock, std::vector<Worker> workers, const Options& options);
  /// After the workers have ended.
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// True while that worker is in a job that hangs. Any thread.
  bool hangs(size_t worker) const;

 private:
  struct Watched {
    Worker worker;
    std::vector<WatchRules> rules;  ///< by member
    bool low = true;                ///< all of them are of low criticality
    bool own_lookout = false;       ///< its budgets are looked at by a thread of its own
    int64_t least_budget_ns = 0;    ///< of the members whose overruns are minded; 0: there are none
    int64_t seen_cpu_ns = -1;       ///< CPU clock at the last look at a budget
    int64_t overdrawn_cpu_ns = 0;   ///< CPU clock at the last look, if the reservation was used up then
    int64_t stood_cpu_ns = -1;      ///< CPU clock at the last look at a reservation
    int64_t stood_at_ns = 0;        ///< when that was
    int64_t stood_ns = 0;           ///< for how long it has shown the same
    bool loss_told = false;         ///< of its reservation
    bool beside = false;            ///< it came without a reservation, and has none yet
    int64_t beside_since_ns = 0;
    bool beside_told = false;
    uint64_t miss_told = 0;              ///< serial of the last job it was told of; 0: none
    std::atomic<uint64_t> hang_told{0};  ///< the same
  };
  static WatchSight sight_of(const JobWatch& watch, const JobWatch::Running& job, int64_t now_ns);
  int64_t look(int64_t now_ns);
  int64_t look_at(Watched& watched, int64_t now_ns);
  /// The look of a lane's own watchdog.
  int64_t look_at_budget(Watched& watched, int64_t now_ns);
  int64_t look_at_reserve(Watched& watched, int64_t now_ns);
  void rescue(Watched& watched, size_t task, int64_t now_ns);
  /// Of a worker that came back without its reservation.
  void look_for_return(Watched& watched, int64_t now_ns);
  /// The job may have ended since it was seen: nothing is done to one that has.
  void overrun(Watched& watched, const JobWatch::Running& job, int64_t now_ns);
  void act(Watched& watched, const JobWatch::Running& job, const WatchVerdict& verdict, int64_t now_ns);
  void safe_stop(size_t task, uint64_t job, const char* why, int64_t now_ns);
  /// `task` is the one that is late, or would be.
  void lift(Watched& watched, size_t task, int64_t owed_ns, int64_t now_ns, bool behind);
  void tell_bandwidth(size_t task, int64_t now_ns, const char* what);
  void hang(Watched& watched, const JobWatch::Running& job, int64_t now_ns);
  Fault tell_hang(size_t task, const JobWatch::Running& job, int64_t now_ns, const char* consequence);

  const Plan& plan_;
  RunBoard& board_;
  const Clock& clock_;
  const Options options_;
  const std::string loss_;  ///< what is told of bandwidth that may be lost, and the command that ends that
  std::vector<Watched> watched_;
  StolenTime stolen_;
  std::vector<std::unique_ptr<Lookout>> lookouts_;  ///< last: they use all of the above
};

}  // namespace takt
