// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstdint>

namespace takt::analysis {

/// What the runtime and the kernel add to a job, ns. Zero: not charged. `takt doctor --measure` finds the figures of a
/// machine; the defaults charge nothing, so that an analysis without them is that of the bare model.
struct Overheads {
  int64_t release_ns = 0;      ///< from a planned release to the first instruction of its job on an idle core
  int64_t switch_ns = 0;       ///< one change of context; a job costs two
  int64_t publish_ns = 0;      ///< one output, whatever its size
  int64_t take_ns = 0;         ///< one input, whatever its size
  int64_t per_mb_ns = 0;       ///< more for each megabyte of an input's or output's payload
  int64_t enforcement_ns = 0;  ///< SCHED_DEADLINE: what a thread may run on after its budget is used up
  int64_t demotion_ns = 0;     ///< SCHED_FIFO: the same, until a watchdog that looks in time has demoted it
  int64_t look_ns = 0;         ///< SCHED_FIFO: one look of a watchdog: its timer, two switches, a CPU clock
  int64_t tick_ns = 0;         ///< the kernel's tick, on which SCHED_DEADLINE looks at budgets
  /// What the kernel gives ordinary threads of each core in every period before those of SCHED_FIFO, where these have
  /// left them less (fair server, throttling); 0: nothing.
  int64_t ordinary_runtime_ns = 0, ordinary_period_ns = 0;
  /// Sum of runtime / period of all reservations that the kernel takes, over all its cores; 0: not known.
  double deadline_bandwidth = 0;

  /// What a budget under SCHED_DEADLINE may be exceeded by. Where it is enforced on the tick, no sample need have met
  /// the worst phase of that; much less than a tick shows that it is not.
  int64_t throttled_late_ns() const {
    return enforcement_ns > tick_ns / 2 ? std::max(enforcement_ns, tick_ns) : enforcement_ns;
  }
};

}  // namespace takt::analysis
