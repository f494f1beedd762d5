// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/rewind/recorded_run.hpp"

namespace takt::rewind {

/// Shows jobs of a record: what a job was given, what it made, its parameters and what its node then remembers. Each
/// step, forward or backward, is a replay from the snapshots before that job.
///
///     Inspector inspector(run);                        // a RecordedRun that is composed
///     std::puts(inspector.answer("next stereo").text.c_str());
class Inspector {
 public:
  explicit Inspector(RecordedRun& run);

  struct Answer {
    bool there = true;  ///< what was asked for
    std::string text;   ///< lines
  };
  /// `first`, `next [NODE]`, `back [NODE]`, `go NODE JOB`, `at S [NODE]`, `in`, `out`, `params`, `state`, `help`.
  Answer answer(const std::string& line);
  /// To the first job from here on whose message passes.
  Answer go_to(const graph::ConditionSpec& condition);

 private:
  struct Shown {
    std::string head, in, out, params, state;
  };
  Answer go(size_t position);
  Answer step(int direction, const std::string& node);
  Answer at(double s, const std::string& node);
  size_t task_of(const std::string& node) const;
  Shown show(const record::Replayer& replayer, const record::RecordedJob& job) const;
  std::string inputs(const TaskPlan& task) const;
  std::string outputs(const record::Replayer& replayer, const record::RecordedJob& job) const;
  record::ReplayResult run(int64_t begin_ns, const decltype(record::Replayer::Options::visit)& visit);

  RecordedRun& run_;
  std::vector<const record::RecordedJob*> jobs_;  ///< of nodes, by their starts
  size_t position_ = 0;
  Shown shown_;
  bool used_ = false;  ///< nodes have run since they were composed
};

}  // namespace takt::rewind
