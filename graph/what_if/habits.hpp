// SPDX-License-Identifier: Apache-2.0
// How the outputs of nodes came about in a record: where their stamps came from, and whether they waited for something
// new.
#pragma once
#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "graph/what_if/recorded_run.hpp"

namespace takt::what_if {

/// Calls visit(edge, back, sequence) for all that a job held; of each edge the newest message first, which is 0 back.
template <class Visit>
void for_each_held(const record::RecordedJob& job, const Visit& visit) {
  for (const record::RecordedJob::Input& input : job.inputs) {
    uint16_t back = 0;
    for (auto run = input.held.rbegin(); run != input.held.rend(); ++run)
      for (uint64_t n = run->count; n-- > 0;) visit(input.edge, back++, run->first + n);
  }
}

/// What a job made itself on an output; null: nothing, or only the message before once more.
const record::RecordedJob::Output* made(const record::RecordedJob& job, size_t output);

/// Stamps of the messages of one port by sequence.
class Stamps {
 public:
  explicit Stamps(const std::map<uint64_t, record::LogFile::Known>& messages);
  /// Nothing: the record does not have that message.
  std::optional<int64_t> of(uint64_t sequence) const;
  /// A message that was published again has a sequence of its own, under which the record does not have it.
  void repeat(uint64_t sequence);

 private:
  std::unordered_map<uint64_t, int64_t> stamps_;
};

/// By edge: the newest message that earlier jobs of the task held.
using Seen = std::vector<uint64_t>;

class Habits {
 public:
  /// `jobs`: all whole ones by release, whose tasks, edges and outputs are those of the plan.
  Habits(const record::LogFile& log, const Plan& plan, const std::vector<const record::RecordedJob*>& jobs);

  /// Calls visit(job, seen) for each of the jobs.
  template <class Visit>
  void for_each_job(const Visit& visit) const {
    std::vector<Seen> seen;
    for (const TaskPlan& task : plan_.tasks) seen.emplace_back(task.edges.size());
    for (const record::RecordedJob* job : jobs_) {
      Seen& mine = seen[job->task];
      visit(*job, std::as_const(mine));
      for_each_held(*job, [&](uint16_t edge, uint16_t, uint64_t n) { mine[edge] = std::max(mine[edge], n); });
    }
  }

  const Stamps& stamps(size_t port) const { return stamps_[port]; }
  /// A message of that stamp, published by that job, was made of the message that it held with this stamp or the
  /// nearest one. What is not older than the release can be made of none: it is a device's, or the node's own.
  StampOrigin origin(const record::RecordedJob& job, uint16_t output, int64_t stamp_ns) const;
  /// Where nobody knows the stamp: the newest message of the first edge that may have it.
  StampOrigin newest_input(const record::RecordedJob& job, uint16_t output) const;
  /// The job was late, and its outputs were held back: on_miss is `skip` or `reuse_last`, as far as the record shows.
  bool withheld(const record::RecordedJob& job) const;
  /// The task publishes that output for new input only: it did not where it held old messages, and never of one.
  bool if_new(size_t task, size_t output) const;
  /// Of the edges that stamps of that output come from, the job held messages that earlier jobs had held, and no other.
  bool only_old(const record::RecordedJob& job, const Seen& seen, size_t output) const;

 private:
  struct Habit {
    std::vector<char> from;  ///< by edge: some stamp came from it
    bool from_old = false;   ///< one of a message that an earlier job had held as well, or of no message
    bool waited = false;     ///< a job with only_old() did not publish it
  };
  bool carries(const record::RecordedJob& job, uint16_t edge, uint16_t output) const;
  void learn_origins(const record::RecordedJob& job, const Seen& seen);
  void learn_pauses(const record::RecordedJob& job, const Seen& seen);

  const Plan& plan_;
  const std::vector<const record::RecordedJob*>& jobs_;
  std::vector<Stamps> stamps_;              ///< by port
  std::vector<std::vector<Habit>> habits_;  ///< by task and output
  std::vector<char> publishes_late_;        ///< by task: a late job published what it had made
};

}  // namespace takt::what_if
