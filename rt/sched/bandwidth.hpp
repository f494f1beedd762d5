// SPDX-License-Identifier: Apache-2.0
// What the kernel still gives SCHED_DEADLINE, and who has the rest.
//
//     if (const auto bandwidth = deadline_bandwidth()) puts(to_text(bandwidth->holders).c_str());
#pragma once
#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace takt {

/// The reservations of the living threads of one process.
struct DeadlineHolder {
  pid_t process = 0;
  std::string name;
  int threads = 0;
  double cores = 0;  ///< sum of runtime / period
};

/// Of all processes of this machine, the largest first. Some milliseconds; any thread.
std::vector<DeadlineHolder> deadline_holders();
double cores_of(const std::vector<DeadlineHolder>& holders);
/// "takt (pid 12, 9 threads) 0.750, stress (pid 7, 1 thread) 0.100 and 2 more processes"; "" of none.
std::string to_text(const std::vector<DeadlineHolder>& holders);

/// Cores that all reservations on these CPUs may add up to: sched_rt_runtime_us of sched_rt_period_us (no limit if
/// negative), less the share of the fair server (Linux 6.12 on). `server_share`: of a CPU.
double deadline_limit(double runtime_us, double period_us, int cpus, double server_share);

/// Cores that the kernel still grants to the calling process, found by reserving them for some milliseconds. Nothing if
/// it grants no reservation for another reason than that too much is held. Any thread.
std::optional<double> free_bandwidth();

struct DeadlineBandwidth {
  double limit = 0;  ///< of the CPUs that this process may use
  double free = 0;
  std::vector<DeadlineHolder> holders;

  /// Held by no living thread: the kernel has not given back what a thread left behind. Writing sched_rt_runtime_us
  /// makes it count again. 0 below 0.005 cores.
  double lost() const;
};
/// As the kernel's settings, its threads and a trial show it. Nothing where free_bandwidth() finds nothing.
std::optional<DeadlineBandwidth> deadline_bandwidth();

/// The command that makes the kernel count its reservations anew.
std::string recount_command();

/// Why the kernel answers EBUSY to threads of this process that ask for `asked` cores together, the smallest of those
/// refused for `least_refused`: other processes, lost bandwidth, or their own budgets. With the fix.
std::string why_busy(double asked, double least_refused);
/// The same from figures. `self`: the calling process.
std::string why_busy(double asked, double least_refused, double limit, const std::vector<DeadlineHolder>& holders,
                     pid_t self);

}  // namespace takt
