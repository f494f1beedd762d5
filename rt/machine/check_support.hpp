// SPDX-License-Identifier: Apache-2.0
// Internal to the checks: what several of them say alike.
#pragma once
#include <string>
#include <vector>

#include "rt/machine/facts.hpp"
#include "rt/machine/finding.hpp"

namespace takt::machine {

/// The kernel's configuration, from /proc/config.gz or /boot; "" if neither can be read.
std::string kernel_config(const Facts& facts);
/// Release of the running kernel.
std::string kernel_release(const Facts& facts);
/// All CPUs that are online.
std::vector<int> online_cpus(const Facts& facts);

/// What the kernel gives ordinary threads of a CPU in each period at the latest, whatever SCHED_FIFO wants: its fair
/// server from Linux 6.12 on, else what is throttled (sched_rt_runtime_us of sched_rt_period_us).
struct OrdinaryShare {
  int64_t runtime_ns = 0, period_ns = 0;  ///< runtime 0: nothing
  bool known = true;                      ///< false: the kernel's default, since its figures cannot be read
};
OrdinaryShare ordinary_share(const Facts& facts, int cpu);

/// The right to real-time policies and locked memory for this program: as a file that only its group may run, or as a
/// unit of systemd.
std::vector<Fix> grant_rights(const Facts& facts);
/// Lines for a file of /etc/security/limits.d; "USER" stands for root, who needs none.
Fix limits_line(const Facts& facts, const std::string& item);
Fix boot(const std::string& options);
Fix shell(const std::string& command);

/// What a trial that gave no answer finds.
void not_answered(Finding& finding);

}  // namespace takt::machine
