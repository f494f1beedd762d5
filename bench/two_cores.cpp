// SPDX-License-Identifier: Apache-2.0
#include "bench/two_cores.hpp"

#include <fstream>
#include <vector>

namespace takt::bench {
namespace {

/// The CPUs of one core have the same list; empty if the system has none.
std::string hardware_threads_beside(int cpu) {
  std::string list;
  std::getline(
      std::ifstream("/sys/devices/system/cpu/cpu" + std::to_string(cpu) + "/topology/thread_siblings_list") >> std::ws,
      list);
  return list;
}

}  // namespace

TwoCores::TwoCores() {
  if (sched_getaffinity(0, sizeof before_, &before_) != 0) return;
  std::vector<int> chosen;
  std::string core;
  for (int cpu = 0; cpu < CPU_SETSIZE && chosen.size() < 2; ++cpu) {
    if (!CPU_ISSET(static_cast<size_t>(cpu), &before_)) continue;
    const std::string its_core = hardware_threads_beside(cpu);
    if (its_core.empty() || its_core == core) continue;
    core = its_core;
    chosen.push_back(cpu);
  }
  if (chosen.size() < 2) return;
  cpu_set_t two;
  CPU_ZERO(&two);
  for (const int cpu : chosen) CPU_SET(static_cast<size_t>(cpu), &two);
  moved_ = sched_setaffinity(0, sizeof two, &two) == 0;
  if (moved_) text_ = "CPUs " + std::to_string(chosen[0]) + " and " + std::to_string(chosen[1]);
}

TwoCores::~TwoCores() {
  if (moved_) sched_setaffinity(0, sizeof before_, &before_);
}

}  // namespace takt::bench
