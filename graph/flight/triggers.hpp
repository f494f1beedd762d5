// SPDX-License-Identifier: Apache-2.0
// What freezes the ring.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "graph/language/message_field.hpp"
#include "rt/record/recorded_event.hpp"
#include "rt/record/recorded_job.hpp"
#include "rt/sched/outage_log.hpp"
#include "rt/sched/plan.hpp"
#include "rt/shm/transport.hpp"

namespace takt::flight {

/// Why the ring was frozen.
struct Cause {
  std::string kind;     ///< miss, age, mode, outage, mark, condition
  std::string subject;  ///< node, chain, mode, process; causes of one kind and subject that come together are one
  std::string what;     ///< "obstacle_stop missed the deadline of job 81 by 14.2 ms"
  int64_t at_ns = 0;
  uint32_t job = 0;  ///< of a miss
};

/// Finds causes in what is recorded. Jobs, events and outages on any thread, messages on one.
class Triggers {
 public:
  /// The plan outlives this.
  Triggers(const graph::GraphSpec& graph, const Plan& plan);
  /// A job of a node of high criticality that was late.
  std::optional<Cause> of(const record::RecordedJob& job) const;
  /// A message at the end of a chain that is older than its bound, or the first one that passes a condition of
  /// `freeze` after one that did not.
  std::optional<Cause> of(size_t port, const Held& held);
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
  struct Condition {
    graph::ConditionSpec spec;
    std::optional<graph::MessageField> field;  ///< none: it counts messages
    std::string text;
    double messages = 0;
    bool passed = false;
  };
  std::optional<Cause> look(Condition& condition, const Held& held) const;
  std::map<size_t, std::vector<Condition>> conditions_;  ///< by port
};

}  // namespace takt::flight
