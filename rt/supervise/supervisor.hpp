// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "rt/memory/sanitized.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/shm/transport.hpp"
#include "rt/supervise/process_group.hpp"
#include "rt/supervise/restart_policy.hpp"
#include "rt/supervise/silence.hpp"
#include "rt/time/clock.hpp"

namespace takt {

/// Keeps the processes of a run alive. One that dies, or that hangs and is killed for it, is started again as its
/// restart policy says, and joins the others, which go on meanwhile: nobody holds a lock that another one could wait
/// for. A process hangs if one of its jobs does (see Watchdog), or if it gives no sign of life for `silence`.
///
/// A process that comes too often is given up: its tasks stay away, and if one of them is of high criticality the run
/// goes into safe_stop. One thread at a time: that of the process group.
class Supervisor {
 public:
  struct Options {
    RestartPolicy::Limits restarts;
    int64_t silence_ns = kSlowdown * 750'000'000LL;
    /// For a restarted process that is at work to come back to its first jobs; one that stands still has `silence`.
    int64_t start_patience_ns = kSlowdown * 5'000'000'000LL;
    /// After a process has ended by a signal, before its place is taken; may be empty.
    std::function<void(pid_t)> clean_up = {};
    /// One line for the person in front of the terminal; may be empty.
    std::function<void(const std::string&)> say = {};
  };

  /// `tasks_of`: by process, indexes into plan.tasks.
  Supervisor(const Plan& plan, RunBoard& board, ProcessGroup& group, Transport& transport, const Clock& clock,
             std::vector<std::vector<size_t>> tasks_of, Options options);

  /// Sees who has ended, hangs or is back, and does what is due. Every few milliseconds from the start of the run on.
  void look();
  /// Everybody was lost together with the supervisor before this one, and was started again with it.
  void all_were_lost(const GroupSigns::Loss& loss);
  /// From now on ends are in order, and nobody is started again.
  void let_end() { ending_ = true; }
  /// A process was given up.
  bool gave_up() const { return gave_up_; }
  /// CPU time of processes that have died, ns.
  int64_t lost_cpu_ns() const { return lost_cpu_ns_; }

 private:
  static constexpr size_t kNoOutage = SIZE_MAX;
  struct Member {
    std::vector<size_t> tasks;
    RestartPolicy policy;
    size_t outage = kNoOutage;              ///< under way
    std::vector<uint64_t> releases_before;  ///< of each task, when it was started again
    Silence silence;
    std::string killed_for;     ///< why it was killed by us
    int64_t away_since_ns = 0;  ///< ... and since when it had not been there
  };

  void note_end(const ProcessGroup::End& end, int64_t now_ns);
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
