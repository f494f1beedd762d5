// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "rt/machine/checks.hpp"

namespace takt::machine {

std::string_view to_string(Status status) {
  switch (status) {
    case Status::ok: return "ok";
    case Status::warn: return "warn";
    case Status::lacks: return "lacks";
    case Status::unknown: return "unknown";
  }
  return "";
}

std::vector<Finding> examine(const Facts& facts, const Trials& trials) {
  return {check_sched_deadline(facts, trials.deadline),
          check_deadline_bandwidth(trials.bandwidth),
          check_sched_fifo(facts, trials.fixed),
          check_rt_runtime(facts),
          check_cgroup_rt(facts),
          check_fair_server(facts),
          check_rights(facts, trials.rights),
          check_mlockall(facts, trials.lock),
          check_dev_shm(trials.shared_memory),
          check_transparent_hugepage(facts),
          check_swap(facts),
          check_cpu_dma_latency(facts, trials.latency),
          check_timer_slack(trials.slack),
          check_tick(facts, trials.tick),
          check_preemption(facts),
          check_clocksource(facts),
          check_governor(facts),
          check_cpusets(facts),
          check_irq_affinity(facts),
          check_host_stall(facts),
          check_watchdog(trials.watchdog),
          check_iceoryx(trials.daemon)};
}

std::vector<Finding> lacking(const std::vector<Finding>& findings, Policy policy, bool iceoryx) {
  std::vector<Finding> wanted;
  std::copy_if(findings.begin(), findings.end(), std::back_inserter(wanted), [&](const Finding& finding) {
    if (finding.status != Status::lacks) return false;
    switch (finding.need) {
      case Need::every_run: return true;
      case Need::deadline: return policy == Policy::deadline;
      case Need::fixed: return policy == Policy::fixed;
      case Need::iceoryx: return iceoryx;
      case Need::advice: return false;
    }
    return false;
  });
  return wanted;
}

}  // namespace takt::machine
