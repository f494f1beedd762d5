// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>

#include "graph/run/said_lines.hpp"
#include "rt/own_thread.hpp"
#include "rt/sched/run_board.hpp"

namespace takt::command {

/// Shows what a run is doing, from a thread of the default policy that only reads atomics: a table that redraws itself
/// in a terminal of at least 60 columns, otherwise one plain line every five seconds; what nodes say above it, at once.
/// Writes to stderr, so that stdout holds the summary alone.
class LiveTable {
 public:
  LiveTable(const Plan& plan, const RunBoard& board, std::string title);
  ~LiveTable();
  LiveTable(const LiveTable&) = delete;
  LiveTable& operator=(const LiveTable&) = delete;

 private:
  void show();
  void draw_table(int columns, int rows);
  void print_line();
  void clear_table();
  bool print_said();

  const Plan& plan_;
  const RunBoard& board_;
  const std::string title_;
  SaidLines said_;
  int drawn_lines_ = 0;
  std::atomic<uint32_t> ended_{0};
  OwnThread thread_;
};

}  // namespace takt::command
