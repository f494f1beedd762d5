// SPDX-License-Identifier: Apache-2.0
// What freezes the ring.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "rt/record/recorded_event.hpp"
#include "rt/record/recorded_job.hpp"
#include "rt/sched/outage_log.hpp"
#include "rt/sched/plan.hpp"
#include "rt/shm/transport.hpp"

namespace takt::flight {

/// Why the ring was frozen.
struct Cause {
  std::string kind;     ///< miss, age, mode, outage, mark
  std::string subject;  ///< node, chain, mode, process; causes of one kind and subject that come together are one
  std::string what;     ///< "obstacle_stop missed the deadline of job 81 by 14.2 ms"
  int64_t at_ns = 0;
};

/// Finds causes in what is recorded. Const: any thread.
class Triggers {
 public:
  /// The plan outlives this.
  Triggers(const graph::GraphSpec& graph, const Plan& plan);
  /// A job of a node of high criticality that was late.
  std::optional<Cause> of(const record::RecordedJob& job) const;
  /// A message at the end of a chain that is older than its bound.
  std::optional<Cause> of(size_t port, const Held& held) const;
  /// A change of mode, a mark.
  std::optional<Cause> of(const record::RecordedEvent& event) const;
  Cause of(const Outage& outage, const std::string& process) const;

 private:
  const Plan& plan_;
  struct Chain {
    std::string name;
    int64_t most_ns;
  };
  std::map<size_t, std::vector<Chain>> chains_;  ///< by port
};

}  // namespace takt::flight
