// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "rt/sched/run_board.hpp"

namespace takt {

class InputPort;

/// The latch rule: per input the newest messages with visible_at <= release, or the newest set with equal stamps of a
/// join. Belongs to one task; one thread at a time.
class Latch {
 public:
  /// Counts into the board's edges of task `task`.
  Latch(const TaskPlan& plan, Transport& transport, RunBoard& board, size_t task, const Clock& clock);
  /// Fills only the input `control`, where there is one: what decides whether a job takes place at all.
  void acquire_requests(int64_t release_ns, int64_t now_ns);
  /// Fills the node's other inputs for a job released at `release_ns` that starts at `now_ns`; returns how many are
  /// stale.
  size_t acquire(int64_t release_ns, int64_t now_ns);
  /// Lists what acquire() would choose from, and chooses nothing.
  void rehearse(int64_t release_ns) const;
  /// Empties all of them again.
  void release();
  /// Counts what was latched since the last call: apart, so that counting stands in no job's way.
  void count();
  const EdgeStatistics& statistics(size_t edge) const { return *edges_[edge].statistics; }

 private:
  static constexpr int64_t kNoAge = INT64_MIN;
  struct EdgeCounts {
    uint64_t received = 0, dropped = 0, stale = 0;
  };
  struct Edge {
    EdgePlan plan;
    InputPort* input = nullptr;
    std::unique_ptr<Reader> reader;
    uint64_t last_seen = 0, damaged = 0;
    uint64_t pass_over_from = 0, pass_over_to = 0;  ///< EdgeStatistics
    bool passes_over(uint64_t sequence) const { return sequence <= pass_over_to && sequence >= pass_over_from; }
    bool joined = false, requests = false;
    EdgeCounts fresh;         ///< not yet in the statistics
    int64_t age_ns = kNoAge;  ///< the same
    int64_t latched_ns = 0;   ///< when it had that age
    EdgeStatistics* statistics = nullptr;
  };

  void acquire_newest(Edge& edge, int64_t release_ns, int64_t now_ns);
  void acquire_join(const std::vector<size_t>& group, int64_t release_ns, int64_t now_ns);
  bool take_set(const std::vector<size_t>& group, int64_t stamp_ns, int64_t release_ns, int64_t now_ns);
  void account(Edge& edge, size_t count, bool stale, int64_t now_ns);

  void tell_damage(Edge& edge);

  ExcessLog& excesses_;
  FaultLog& faults_;
  const uint32_t task_;
  const std::string name_;  ///< of the task
  std::vector<Edge> edges_;
  std::vector<std::vector<size_t>> joins_;  ///< indexes into edges_
  size_t stale_count_ = 0;
};

}  // namespace takt
