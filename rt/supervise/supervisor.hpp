// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "rt/memory/sanitized.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/sched/watchdog.hpp"
#include "rt/shm/transport.hpp"
#include "rt/supervise/process_group.hpp"
#include "rt/supervise/restart_policy.hpp"
#include "rt/supervise/silence.hpp"
#include "rt/time/clock.hpp"

namespace takt {

/// What the spares of one process cost and did.
struct SpareUse {
  bool wanted = false;
  bool ready = false;           ///< one waits
  uint32_t takeovers = 0;       ///< places that they took
  uint32_t not_ready = 0;       ///< ends of the process for which none was ready
  uint32_t lost = 0;            ///< that ended while they waited
  int64_t ready_within_ns = 0;  ///< longest that one took from its fork until it waited
  int64_t cpu_ns = 0;           ///< that they used before they took over
  double memory_mb = 0;         ///< of the one that was ready last
};

/// Keeps the processes of a run alive. One that dies, or that hangs and is killed for it, is started again as its
/// restart policy says, and joins the others, which go on meanwhile: nobody holds a lock that another one could wait
/// for. A process hangs if one of its jobs does (see Watchdog), or if it gives no sign of life for `silence`.
///
/// One that ends on a message (by a signal that nobody sent, or by a job that hangs), and again on the same one within
/// `silence` and `poison` of its return, does not get that message a third time; if it ends on the next one as well,
/// the run goes into safe_stop.
///
/// A process that comes too often is given up: its tasks stay away, and if one of them is of high criticality the run
/// goes into safe_stop. One thread at a time: that of the process group.
class Supervisor {
 public:
  struct Options {
    RestartPolicy::Limits restarts;
    int64_t silence_ns = Watchdog::patience_ns(Policy::deadline);
    /// For a restarted process that is at work to come back to its first jobs; one that stands still has `silence`.
    int64_t start_patience_ns = kSlowdown * 5'000'000'000LL;
    /// After a process has ended by a signal, before its place is taken; may be empty.
    std::function<void(pid_t)> clean_up = {};
    /// One line for the person in front of the terminal; may be empty.
    std::function<void(const std::string&)> say = {};
    int64_t poison_ns = kSlowdown * 250'000'000LL;  ///< beyond the silence, which a job that hangs lasts
    std::vector<bool> spares = {};                  ///< by process: it has one; empty: none has
    /// Of a process that has just become ready as a spare; may be empty.
    std::function<double(pid_t)> memory_mb = {};
    /// Between the begin of the run, or the return of a process, and the fork of its spare: it must not stand in the
    /// way of what begins then.
    int64_t spare_delay_ns = 200'000'000;
    int64_t spare_patience_ns = kSlowdown * 30'000'000'000LL;  ///< for it to become ready
  };

  /// `tasks_of`: by process, indexes into plan.tasks.
  Supervisor(const Plan& plan, RunBoard& board, ProcessGroup& group, Transport& transport, const Clock& clock,
             std::vector<std::vector<size_t>> tasks_of, Options options);

  /// Sees who has ended, hangs or is back, and does what is due. Every few milliseconds from the start of the run on.
  void look();
  /// Everybody was lost together with the supervisor before this one, and was started again with it.
  void all_were_lost(const GroupSigns::Loss& loss);
  /// From now on ends are in order, nobody is started again, and spares end.
  void let_end();
  /// Of process `process`.
  SpareUse spare_use(size_t process) const;
  /// A process was given up.
  bool gave_up() const { return gave_up_; }
  /// CPU time of processes that have died, and of spares that were not needed, ns.
  int64_t lost_cpu_ns() const { return lost_cpu_ns_; }

 private:
  static constexpr size_t kNoOutage = SIZE_MAX;
  /// Messages that were new to a job which did not live to its end.
  struct Suspect {
    size_t task = 0, edge = 0;
    uint64_t from = 0, to = 0;
  };
  struct Member {
    std::vector<size_t> tasks;
    RestartPolicy policy;
    size_t outage = kNoOutage;              ///< under way
    std::vector<uint64_t> releases_before;  ///< of each task, when it was started again
    Silence silence;
    std::string killed_for;     ///< why it was killed by us
    int64_t away_since_ns = 0;  ///< ... and since when it had not been there
    bool hung = false;          ///< ... for a job that did not return
    bool given_up = false;
    std::vector<Suspect> suspects;     ///< at its last crash
    std::vector<Suspect> passed_over;  ///< what its life after that one is spared
    struct Spare {
      SpareUse use;
      RestartPolicy policy;
      int64_t next_ns = 0;     ///< not forked before that
      int64_t started_ns = 0;  ///< the one that there is
    } spare;
  };

  void note_end(const ProcessGroup::End& end, int64_t now_ns);
  /// What to do about the messages that were in hand at the crash of a process.
  void judge_crash(size_t process, int64_t ended_ns, int64_t now_ns);
  std::vector<Suspect> in_hand(const Member& member);
  void pass_over(size_t process, const Suspect& messages, int64_t now_ns);
  void note_cleared(const ProcessGroup::End& end);
  void note_spare_end(const ProcessGroup::End& end, int64_t now_ns);
  /// Has one forked where it is time, and sees whether it is ready.
  void watch_spare(size_t process, int64_t now_ns);
  bool spare_is_ready(size_t process);
  /// The spare of a process goes to work in its place; false if none is ready.
  bool take_over(size_t process);
  /// When it is started again, or that it never is.
  void plan_start(size_t process, int64_t now_ns, const std::string& cause);
  void start_again(size_t process, int64_t now_ns);
  void give_up(size_t process, int64_t now_ns, const std::string& cause);
  void watch_return(size_t process, int64_t now_ns);
  void watch_life(size_t process, int64_t now_ns);
  void end(size_t process, int64_t since_ns, const std::string& why);
  bool all_ran(const Member& member) const;
  /// At which the task ran a job, or would have, had requests let it.
  uint64_t releases_seen(size_t task) const;

  const Plan& plan_;
  RunBoard& board_;
  ProcessGroup& group_;
  Transport& transport_;
  const Clock& clock_;
  const Options options_;
  std::vector<Member> members_;
  OutageLog& outages_;  ///< on the board
  int64_t lost_cpu_ns_ = 0;
  size_t lost_nurseries_ = 0;
  bool ending_ = false, gave_up_ = false;
};

}  // namespace takt
