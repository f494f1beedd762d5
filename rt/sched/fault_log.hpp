// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/sched/append_log.hpp"

namespace takt {

/// Something that a node did and should not have done, beyond what counters tell.
struct Fault {
  enum Kind : uint32_t {
    hang,       ///< a job did not return
    exception,  ///< a job threw
    memory,     ///< a job asked for more memory than its node may have, and got none
    lost,       ///< what the task reads from outside gives no good data any more
    back,       ///< it does again
    doubtful,   ///< a job said that the results of its node are worse than they look
    wrong,      ///< a job said that they are wrong
    spoiled,    ///< the commit word of its outputs held what nobody writes there
    damaged,    ///< a message was written over by its own process: withheld, or lost to a reader
    bandwidth,  ///< what the kernel reserved for the task's thread may be lost
    poison,     ///< its process ended twice on one message, which is passed over
  };
  Kind kind = hang;
  uint32_t task = 0;  ///< index into Plan::tasks
  uint64_t job = 0;   ///< its index
  int64_t at_ns = 0;
  BoundedText<200> what;
};

inline constexpr size_t kMostFaults = 256;
using FaultLog = AppendLog<Fault, kMostFaults>;

}  // namespace takt
