// SPDX-License-Identifier: Apache-2.0
// Faults of one node's jobs: slower, hanging, or not taking place because their process is gone.
#pragma once
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "rt/faults/message_fault.hpp"
#include "rt/sched/plan.hpp"
#include "rt/time/clock.hpp"

namespace takt::faults {

enum class NodeFaultKind : uint8_t {
  slow,    ///< each job that starts in the window takes `by_ns` longer: CPU time
  hang,    ///< the first job that starts in the window does not return for `by_ns` (kForever: never), spinning
  absent,  ///< no job released in the window takes place
};

struct NodeFault {
  NodeFaultKind kind = NodeFaultKind::slow;
  size_t task = 0;                        ///< index into Plan::tasks
  int64_t from_ns = 0, to_ns = kForever;  ///< [from, to), since the epoch
  int64_t by_ns = 0;
  bool covers(int64_t since_epoch_ns) const { return since_epoch_ns >= from_ns && since_epoch_ns < to_ns; }
};

/// The faults of one node. In real time a job really takes that long; in virtual time extra_ns() says what it is to be
/// taken to need more, and nothing is waited for.
class NodeFaults final : public Disturbance {
 public:
  /// `struck` has one entry per fault. Clock, epoch (0: not known yet) and counts outlive this.
  NodeFaults(std::vector<NodeFault> faults, const Clock& clock, const std::atomic<int64_t>& epoch_ns,
             std::vector<std::atomic<uint64_t>*> struck);
  bool admits(int64_t release_ns) override;
  void before_run(const Job& job) override;
  /// What a job that starts now is taken to need more, at most kLongest_ns. Before its before_run().
  int64_t extra_ns() const;

  /// In virtual time, for a job that never returns: longer than any run.
  static constexpr int64_t kLongest_ns = 1'000'000'000LL * 86'400 * 30;

 private:
  bool covers(size_t fault, int64_t now_ns) const;
  void spend(const NodeFault& fault) const;

  const std::vector<NodeFault> faults_;
  const Clock& clock_;
  const std::atomic<int64_t>& epoch_ns_;
  const std::vector<std::atomic<uint64_t>*> struck_;
};

}  // namespace takt::faults
