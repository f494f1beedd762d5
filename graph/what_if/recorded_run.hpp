// SPDX-License-Identifier: Apache-2.0
// A record as a what-if needs it: what each job took, what it published, and where the stamps of that came from.
//
//   record::LogFile log = ...;
//   const RecordedRun run = read_recorded_run(log, plan);
//   const PastJob* past = run.tasks[t].nearest(release_ns);  // past->full_ns, ...
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "rt/record/log_file.hpp"
#include "rt/sched/histogram.hpp"
#include "rt/sched/plan.hpp"

namespace takt::what_if {

/// Where the stamp of a message came from, so that another run can give it the stamp that the node would have given.
struct StampOrigin {
  enum Of : uint8_t { release, start, input };
  Of of = release;
  uint16_t edge = 0;      ///< of input: index into TaskPlan::edges
  uint16_t back = 0;      ///< of input: 0 is the newest message that the job held, 1 the one before it
  int64_t offset_ns = 0;  ///< the stamp minus that instant
};

/// One message that a job published, or would publish.
struct Publication {
  uint16_t output = 0;  ///< index into TaskPlan::ports
  StampOrigin stamp;
  bool if_new = false;  ///< only if the message that its stamp came from is new to the job
  std::shared_ptr<const std::vector<std::byte>> content;  ///< packed; null unless the message is a request
};

/// One recorded job.
struct PastJob {
  int64_t release_ns = 0;
  int64_t visible_ns = 0;         ///< from when consumers could see what it published
  int64_t full_ns = 0;            ///< what it would have taken at full quality
  uint32_t first = 0, count = 0;  ///< of RecordedTask::published
};

/// The jobs of one node, by release.
struct RecordedTask {
  std::vector<PastJob> jobs;
  std::vector<Publication> published;
  /// The job whose release is nearest, the earlier one of two; null if the record has none.
  const PastJob* nearest(int64_t release_ns) const;
};

/// What a record says of one node; the same figures as of a run.
struct RecordedFigures {
  uint64_t jobs = 0, deadline_misses = 0;
  Histogram lateness, exec, response;
  std::vector<Histogram> edge_age;    ///< by edge: of the newest message held, when the job started
  std::vector<Histogram> output_age;  ///< by output: when the message became visible
};

struct RecordedRun {
  int64_t epoch_ns = 0;             ///< of the run; releases are counted from here
  int64_t from_ns = 0, end_ns = 0;  ///< the record has the releases in [from, end)
  std::vector<RecordedTask> tasks;  ///< by task of the plan
  std::vector<RecordedFigures> figures;
  std::vector<record::RecordedEvent> modes;  ///< changes of mode that no deadline and no budget caused
  uint64_t cut_off = 0;           ///< jobs whose process died in them: nobody knows what they would have taken
  uint64_t unknown_stamps = 0;    ///< messages that the record does not have, not even by hash
  uint64_t unknown_requests = 0;  ///< requests that it does not have with their fields: they ask for nothing then
};

/// `plan`: of the graph of the record, its tasks and ports in the order that they had. The file is read once more
/// where a job published requests.
RecordedRun read_recorded_run(record::LogFile& log, const Plan& plan);

}  // namespace takt::what_if
