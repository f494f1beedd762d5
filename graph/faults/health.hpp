// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "rt/sched/run_board.hpp"

namespace takt::graph {

/// At that look a node was found not to do its work as planned since the look before.
struct Unwell {
  std::string node;
  int64_t at_ns = 0;  ///< since the epoch
};

/// Looks at a run again and again and notes who is not well: a node that has fallen behind its rate, skipped or reused
/// a job, had no result, or a stale input whose producer is not resting because nobody asks it to run. A missed deadline
/// alone is none: it has an expectation of its own. One thread.
class HealthWatch {
 public:
  /// From one look to the next.
  static constexpr int64_t kPeriod_ns = 50'000'000;

  /// Plan and board outlive this.
  HealthWatch(const Plan& plan, const RunBoard& board);
  /// Looks if a period has passed since the last look; `now_ns` and `epoch_ns` (0: not known yet) of one clock.
  void look(int64_t now_ns, int64_t epoch_ns);
  const std::vector<Unwell>& unwell() const { return unwell_; }

 private:
  struct Seen {
    uint64_t troubles = 0;             ///< skipped, reused and fruitless jobs
    std::vector<uint64_t> stale = {};  ///< by edge
    int64_t due_ns = 0;                ///< jobs released before were looked for
    uint64_t paused = 0;               ///< releases that were found to be paused
    uint64_t jobs = 0, pauses = 0;     ///< at the last look
    bool rests = false;                ///< what was last seen of it is a paused release
  };
  static uint64_t troubles(const TaskStatistics& statistics);
  void see_whether_it_rests(size_t task);
  bool stale_beyond_rest(size_t task);
  /// Jobs that should have ended since the last look and have not.
  uint64_t missing(size_t task, Seen& seen, int64_t now_ns, int64_t epoch_ns) const;

  const Plan& plan_;
  const RunBoard& board_;
  std::vector<Seen> seen_;
  const PortProducers producers_;
  std::vector<Unwell> unwell_;
  int64_t next_ns_ = 0;
};

}  // namespace takt::graph
