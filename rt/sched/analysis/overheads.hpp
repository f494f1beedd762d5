// SPDX-License-Identifier: Apache-2.0
#pragma once
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
  int64_t enforcement_ns = 0;  ///< what a thread may run on after its budget is used up
  int64_t tick_ns = 0;         ///< the kernel's tick, on which SCHED_DEADLINE looks at budgets
  /// Sum of runtime / period of all reservations that the kernel takes, over all its cores; 0: not known.
  double deadline_bandwidth = 0;
};

}  // namespace takt::analysis
