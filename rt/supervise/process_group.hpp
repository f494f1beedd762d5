// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rt/sched/grant.hpp"
#include "rt/supervise/nursery.hpp"

namespace takt {

/// SCHED_FIFO priority of those who start others again: behind all lanes, and before whoever is on his way back.
inline constexpr int kSupervisorPriority = kLowestPriority + 1;

/// The processes of one run, children of the supervisor. Made before the supervisor has any thread, because only the
/// calling thread survives a fork; restarted at any time. One thread at a time.
class ProcessGroup {
 public:
  /// How a process ended: with an exit code, or by a signal (then the code is -1).
  struct End {
    enum Of : uint8_t {
      member,
      cleared,  ///< early_end() told of it; now the kernel has cleared it up
      spare,
    };
    size_t process = 0;
    pid_t pid = 0;
    int code = -1, signal = 0;
    int64_t cpu_ns = 0;  ///< that it has used
    Of of = member;
  };

  ProcessGroup() = default;
  ProcessGroup(const ProcessGroup&) = delete;
  ProcessGroup& operator=(const ProcessGroup&) = delete;
  /// Kills and buries whatever still lives.
  ~ProcessGroup();

  /// Forks a process that runs `body` and exits with its result. It ignores SIGINT, SIGHUP and SIGTERM, which terminals
  /// and service managers send to the whole group: the supervisor says when it ends. It dies with the supervisor.
  /// Throws std::runtime_error if there can be no more processes. `spare`: what a spare of it runs, see start_spare();
  /// empty: it has none.
  void start(const std::string& name, const std::function<int()>& body, const std::function<int()>& spare = {});
  /// After the last start and before the first thread: makes restart() possible. `real_time`: at kSupervisorPriority,
  /// and what is restarted comes back at kLowestPriority, before ordinary load; without the right to that as others.
  /// Its first thread keeps that priority, those that it makes do not have it. Spares have none. Throws
  /// std::runtime_error.
  void prepare_restarts(bool real_time = false);
  /// Runs the body of an ended process again, with what this process's memory held at prepare_restarts(). False if
  /// there can be no more processes now.
  bool restart(size_t process);
  /// Forks a process that is to take the place of that one when it dies, and runs its `spare` until then and from then
  /// on. The kernel knows it as NAME-spare. One at a time for each process. False if there can be none now.
  bool start_spare(size_t process);
  /// The process that waits in vain so far; 0: there is none.
  pid_t spare(size_t process) const { return members_[process].spare; }
  /// The spare of an ended process is that process from now on. False if there is no spare.
  bool take_over(size_t process);
  /// How a process ended by a signal, as soon as none of its threads will run any more of its program: its place is
  /// free from then on. It may take the kernel much longer to clear it up; reap() tells of that as `cleared`.
  std::optional<End> early_end(size_t process);
  void end_spare(size_t process) const;
  /// The end of one of them that was not told yet, without waiting. Hastens those that are ending, and looks after what
  /// makes restarts possible, too.
  std::optional<End> reap();
  void kill_all();
  size_t alive() const;
  size_t size() const { return members_.size(); }
  const std::string& name(size_t process) const { return members_[process].name; }
  pid_t pid(size_t process) const { return members_[process].pid; }  ///< 0: ended
  /// CPU time that it has used so far; 0 if it has ended.
  int64_t cpu_ns(size_t process) const;
  int64_t spare_cpu_ns(size_t process) const;
  /// The processes that make restarts possible, and how many of them were lost and replaced.
  std::vector<pid_t> nurseries() const { return nursery_ ? nursery_->pids() : std::vector<pid_t>{}; }
  size_t lost_nurseries() const { return nursery_ ? nursery_->lost() : 0; }

 private:
  static constexpr size_t kLooksBetween = 4;  ///< of reap() for one at who is ending, which costs some microseconds
  struct Member {
    std::string name;
    pid_t pid = 0;
    std::function<int()> body, spare_body;
    pid_t spare = 0;
  };
  /// One that is dead, and not cleared up yet.
  struct Dead {
    size_t process = 0;
    pid_t pid = 0;
  };
  void hasten_ends();
  static std::optional<End> reap(pid_t pid);

  std::vector<Member> members_;
  std::vector<Dead> dead_;
  size_t looks_ = 0;
  std::unique_ptr<Nursery> nursery_;
};

}  // namespace takt
