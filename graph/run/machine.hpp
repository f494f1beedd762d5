// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "hal/settings/json.hpp"

namespace takt::command {

/// What the figures were measured on: CPU model, cores, kernel, memory.
nlohmann::ordered_json machine_facts();

/// CPU time that the host has taken from this machine since its start, over all CPUs, ns, in ticks of 10 ms; 0 on a
/// machine of its own. A system call that reads a line; not in a job.
int64_t stolen_ns();

/// Whole-process readings; the difference of two of them goes into the report.
struct ProcessReading {
  int64_t cpu_ns = 0;    ///< all threads, user and system
  int64_t steal_ms = 0;  ///< time the host took from this machine's CPUs
  double rss_mb = 0;     ///< peak resident memory

  static ProcessReading now();
};

/// Memory of a process, MB, in which pages shared by n processes count 1/n: the sum over the processes of a run is what
/// the run takes. 0 if the kernel does not say.
double proportional_memory_mb(int pid);

}  // namespace takt::command
