// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace takt::command {

/// Lines that the processes of a run tell their supervisor before the run, in memory that they share: what their
/// devices left out of files. Made before they are forked.
///
///     ToldLines left_out;                 // supervisor
///     left_out.tell(composition.left_out) // a process, once
///     report["left_out"] = left_out.lines();
class ToldLines {
 public:
  /// Throws std::bad_alloc.
  ToldLines();
  ~ToldLines();
  ToldLines(const ToldLines&) = delete;
  ToldLines& operator=(const ToldLines&) = delete;

  /// Afterwards the memory can no longer be written by this process. Beyond 64 kB lines are cut off.
  void tell(const std::vector<std::string>& lines);
  /// Each once, in the order in which they were told: a process that was started again tells the same.
  std::vector<std::string> lines() const;

 private:
  struct Memory;
  Memory* memory_;
};

}  // namespace takt::command
