// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <optional>
#include <vector>

#include "rt/record/recorded_event.hpp"
#include "rt/record/recorded_job.hpp"
#include "rt/sched/plan.hpp"

namespace takt::record {

/// Follows what each task would go on from, and tells it where a replay may begin: behind a job that came with what its
/// node remembers; of a node that does not declare that, behind the first job of each interval. One thread.
class Snapshots {
 public:
  /// `every_ns` 0: none is told.
  Snapshots(const Plan& plan, int64_t every_ns);
  /// The next job of its task.
  std::optional<RecordedEvent> after(const RecordedJob& job);
  void note(const RecordedEvent& event);

 private:
  struct Task {
    bool device = false, says_state = false;
    int64_t slot = -1;                   ///< interval of the last one
    std::vector<uint64_t> seen, newest;  ///< by edge, by output
    std::map<uint16_t, ParamValue> params;
  };
  const int64_t every_ns_;
  std::vector<Task> tasks_;
};

}  // namespace takt::record
