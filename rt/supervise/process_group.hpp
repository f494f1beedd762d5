// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rt/supervise/nursery.hpp"

namespace takt {

/// The processes of one run, children of the supervisor. Made before the supervisor has any thread, because only the
/// calling thread survives a fork; restarted at any time. One thread at a time.
class ProcessGroup {
 public:
  /// How a process ended: with an exit code, or by a signal (then the code is -1).
  struct End {
    size_t process = 0;
    pid_t pid = 0;
    int code = -1, signal = 0;
    int64_t cpu_ns = 0;  ///< that it has used
  };

  ProcessGroup() = default;
  ProcessGroup(const ProcessGroup&) = delete;
  ProcessGroup& operator=(const ProcessGroup&) = delete;
  /// Kills and buries whatever still lives.
  ~ProcessGroup();

  /// Forks a process that runs `body` and exits with its result. It ignores SIGINT, SIGHUP and SIGTERM, which terminals
  /// and service managers send to the whole group: the supervisor says when it ends. It dies with the supervisor.
  /// Throws std::runtime_error if there can be no more processes.
  void start(const std::string& name, const std::function<int()>& body);
  /// After the last start and before the first thread: makes restart() possible. Throws std::runtime_error.
  void prepare_restarts();
  /// Runs the body of an ended process again, with what this process's memory held at prepare_restarts(). False if
  /// there can be no more processes now.
  bool restart(size_t process);
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
  /// The processes that make restarts possible, and how many of them were lost and replaced.
  std::vector<pid_t> nurseries() const { return nursery_ ? nursery_->pids() : std::vector<pid_t>{}; }
  size_t lost_nurseries() const { return nursery_ ? nursery_->lost() : 0; }

 private:
  static constexpr size_t kLooksBetween = 4;  ///< of reap() for one at who is ending, which costs some microseconds
  struct Member {
    std::string name;
    pid_t pid = 0;
    std::function<int()> body;
    bool ending = false;  ///< as seen at the last look
  };
  void hasten_ends();

  std::vector<Member> members_;
  size_t looks_ = 0;
  std::unique_ptr<Nursery> nursery_;
};

}  // namespace takt
