// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "rt/sched/plan.hpp"
#include "rt/sched/run_board.hpp"

namespace takt::command {

/// What the nodes of a run say (Job::log), as lines for whoever watches it: from `info` on, in the order of their
/// instants.
///
///     SaidLines said(plan, board, in_journal(STDERR_FILENO));
///     for (const std::string& line : said.take()) ...  // "12.345 s stereo: warning: too dark to tell ground"
class SaidLines {
 public:
  /// `prefixed`: with the level as sd-daemon(3) wants it.
  SaidLines(const Plan& plan, const RunBoard& board, bool prefixed);
  /// Those that are new. What was written over before it was seen is told in a line of its own.
  std::vector<std::string> take();

 private:
  const Plan& plan_;
  const RunBoard& board_;
  const bool prefixed_;
  std::vector<LogReader> readers_;  ///< by task
  uint64_t missed_ = 0;
};

/// Whether what is written to this descriptor goes to the journal of systemd (JOURNAL_STREAM, systemd.exec(5)).
bool in_journal(int descriptor);

}  // namespace takt::command
