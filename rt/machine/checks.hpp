// SPDX-License-Identifier: Apache-2.0
// The checks of the machine, one function each: what was found, what it means for Takt, how to change it. Pure: a
// finding depends on the facts and trials that are handed in, and on nothing else.
#pragma once
#include <string>
#include <vector>

#include "rt/machine/facts.hpp"
#include "rt/machine/finding.hpp"
#include "rt/machine/trials.hpp"

namespace takt::machine {

// policy_checks.cpp. Sources: sched(7), the kernel's sched-deadline.rst and sched-rt-group.rst.
Finding check_sched_deadline(const Facts& facts, const PolicyTrial& trial);
Finding check_deadline_bandwidth(const BandwidthTrial& trial);
Finding check_sched_fifo(const Facts& facts, const PolicyTrial& trial);
Finding check_rt_runtime(const Facts& facts);
Finding check_cgroup_rt(const Facts& facts);
Finding check_fair_server(const Facts& facts);

// rights_checks.cpp. Sources: capabilities(7), the kernel's watchdog-api.rst.
/// Which capabilities the program has, and whether other users of the machine have them through it.
Finding check_rights(const Facts& facts, const RightsTrial& trial);
/// Who resets the machine if nobody feeds its watchdog.
Finding check_watchdog(const WatchdogTrial& trial);

// memory_checks.cpp. Sources: mlock(2), tmpfs(5), the kernel's transhuge.rst.
Finding check_mlockall(const Facts& facts, const LockTrial& trial);
Finding check_dev_shm(const SharedMemoryTrial& trial);
Finding check_transparent_hugepage(const Facts& facts);
Finding check_swap(const Facts& facts);

// timing_checks.cpp. Sources: the kernel's pm_qos_interface.rst, cpufreq.rst, kernel-parameters.txt.
/// none | voluntary | lazy | full | rt, and who says so; "": not known.
struct Preemption {
  std::string model, source;
  /// False if it is known that a real-time thread waits for the end of another thread's system call.
  bool preempts() const { return model != "none" && model != "voluntary"; }
};
Preemption preemption_of(const Facts& facts);
Finding check_cpu_dma_latency(const Facts& facts, const LatencyTrial& trial);
Finding check_timer_slack(const SlackTrial& trial);
Finding check_tick(const Facts& facts, const TickTrial& trial);
Finding check_preemption(const Facts& facts);
Finding check_clocksource(const Facts& facts);
Finding check_governor(const Facts& facts);

// core_checks.cpp. Sources: cpuset(7), the kernel's cgroup-v2.rst and IRQ-affinity.rst, proc(5).
Finding check_cpusets(const Facts& facts);
Finding check_irq_affinity(const Facts& facts);
Finding check_host_stall(const Facts& facts);

// transport_checks.cpp.
Finding check_iceoryx(const DaemonTrial& trial);

/// All of them, in the order in which they are shown.
std::vector<Finding> examine(const Facts& facts, const Trials& trials);

/// Those that a run cannot do without: status lacks, and needed by every run, by a run under `policy` or, with
/// `iceoryx`, by a run over iceoryx.
std::vector<Finding> lacking(const std::vector<Finding>& findings, Policy policy, bool iceoryx);

}  // namespace takt::machine
