// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>

#include "rt/memory/sanitized.hpp"
#include "rt/sched/outage_log.hpp"
#include "rt/supervise/restart_policy.hpp"
#include "rt/supervise/silence.hpp"
#include "rt/time/clock.hpp"

namespace takt {

/// Keeps a whole group alive where its members depend on something that none of them survives: the daemon of iceoryx,
/// which lives in the process of the supervisor. If that process dies, or gives no sign that the daemon answers, all of
/// the group is ended and started anew; the memory of the board lives on. Called before there are threads.
class GroupKeeper {
 public:
  struct Options {
    /// Without a sign, while one is expected; three times as long where nothing has a real-time policy.
    int64_t silence_ns = kSlowdown * 1'000'000'000LL;
    RestartPolicy::Limits restarts{.most_in_window = 6};
    std::function<bool()> stop_asked = {};     ///< then the group is asked to end, too; may be empty
    std::function<void(pid_t)> clean_up = {};  ///< after the group's first process has ended by a signal; may be empty
    std::function<void(const std::string&)> say = {};
  };

  GroupKeeper(GroupSigns& signs, const Clock& clock, Options options);
  /// Runs `group` in a process of its own, again after each loss; its exit code. Nothing if it had to be given up.
  /// Throws std::runtime_error if there can be no process.
  std::optional<int> keep(const std::function<int()>& group);

 private:
  /// Starts a group and waits for its end: its exit code, or nothing if it was lost, which is then noted.
  std::optional<int> watch(const std::function<int()>& group);

  GroupSigns& signs_;
  const Clock& clock_;
  const Options options_;
};

}  // namespace takt
