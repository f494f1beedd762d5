// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/compose/composition.hpp"
#include "graph/language/registry.hpp"
#include "graph/run/machine.hpp"
#include "graph/run/proof_report.hpp"
#include "hal/settings/json.hpp"
#include "rt/sched/executor.hpp"

namespace takt::command {

/// What the run used of the machine, over all its processes.
struct MachineUse {
  int64_t cpu_ns = 0;
  int64_t simulator_cpu_ns = 0, simulator_in_jobs_ns = 0;  ///< the latter is part of the devices' jobs as well
  int64_t steal_ms = 0;
  double rss_mb = 0;
};

/// Everything a finished run can be reported from.
struct RunFacts {
  const Registry& registry;
  const graph::GraphSpec& graph;
  const Plan& plan;
  const RunBoard& board;
  const RunResult& result;
  const Transport& transport;
  MachineUse use;
  std::string clock, policy_asked, isolation;
  std::vector<std::string> processes;  ///< names, where there are several
  std::vector<std::string> adjusted;
  const graph::Proofs& proofs;  ///< of the policy asked for
  const StallLog& stalls;
};

/// The report of design section 6: times in the unit the key says, null where there are no samples.
nlohmann::ordered_json make_report(const RunFacts& facts);

/// {p50, p99, p999, max} in a unit of so many ns; null without samples, p999 also below 1,000 of them.
nlohmann::ordered_json distribution(const Histogram& h, double ns_per_unit);
/// The mode over time: [{name, from_s, to_s, reason}], the first being that of the start; seconds since the epoch.
nlohmann::ordered_json modes_json(const RunFacts& facts);
/// What nodes did and should not have done: [{what, kind, node, job, at_s}].
nlohmann::ordered_json faults_json(const RunFacts& facts);
/// Each device, whether it was lost, and what was lost of its data: [{name, state, losses, lost_s, reopen_tries,
/// received, damaged, resyncs, missing, unsent, trouble}].
nlohmann::ordered_json devices_json(const RunFacts& facts);
/// {call: count} of what jobs called and should not have; null if this program cannot see it.
nlohmann::ordered_json violations_json(const TaskStatistics& statistics);
/// True if a job did not return.
bool hung(const RunBoard& board);
/// Lines of the summary: changes of mode, devices that were lost, who overran, faults.
std::string events_text(const nlohmann::ordered_json& report);

/// One screen of text from the report: what ran, what was granted, what was missed.
std::string summary_text(const nlohmann::ordered_json& report);

}  // namespace takt::command
