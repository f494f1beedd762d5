// SPDX-License-Identifier: Apache-2.0
// The lines that one node says (Job::log), in shared memory: its jobs append, whoever shows or records them reads
// beside.
//
//   NodeLog log;                      // on the board of the run
//   LogWriter writer(log);            // of the thread that runs the node's jobs
//   if (writer.admits(LogLevel::info, now_ns)) writer.append(line);
//   LogReader reader;                 // of each one who reads
//   reader.take(log, [](const LogLine& line) { ... });
#pragma once
#include <array>
#include <atomic>
#include <cstring>

#include "rt/hot.hpp"
#include "rt/log_line.hpp"

namespace takt {

/// The newest lines. One thread writes and never waits; a line that is written over while somebody reads it is passed
/// over and counted.
class alignas(kCacheLine) NodeLog {
 public:
  static constexpr uint64_t kKept = 32;

  /// Lines so far, those that were too many not counted.
  uint64_t size() const { return size_.load(std::memory_order_acquire); }
  uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  friend class LogWriter;
  friend class LogReader;
  static constexpr size_t kWords = sizeof(LogLine) / sizeof(uint64_t);
  static_assert(sizeof(LogLine) % sizeof(uint64_t) == 0 && std::is_trivially_copyable_v<LogLine>);
  struct Place {
    std::atomic<uint64_t> number{0};  ///< of the line that stands here whole, counted from 1; 0: none, or half of one
    std::array<std::atomic<uint64_t>, kWords> words{};
  };

  std::atomic<uint64_t> size_{0}, dropped_{0};
  std::array<Place, kKept> places_{};
};

/// The side of the jobs. A node may say ten lines at once and five a second on average, of `warning` and `error`, and
/// as many of the others: a node that says the same in each job hides neither itself nor others.
class LogWriter {
 public:
  static constexpr int64_t kBurst = 10, kPerSecond = 5;

  explicit LogWriter(NodeLog& log) : log_(log) {}
  /// Whether a line may be said now; if not, it is counted.
  bool admits(LogLevel level, int64_t now_ns);
  void append(LogLine& line);

 private:
  struct Allowance {
    int64_t from_ns =
        INT64_MIN;  ///< a line takes 1 / kPerSecond s from the time since then, at most kBurst lines' worth
  };
  NodeLog& log_;
  std::array<Allowance, 2> allowances_;  ///< debug and info; warning and error
  uint32_t dropped_ = 0;                 ///< since the last line
};

/// Where one reader of a log stands.
class LogReader {
 public:
  /// Calls `each` with the lines that are new. Those that were written over before are counted in missed().
  template <class Each>
  void take(const NodeLog& log, const Each& each) {
    for (const uint64_t size = log.size(); next_ < size; ++next_) {
      LogLine line;
      if (read(log, line)) each(static_cast<const LogLine&>(line));
      else ++missed_;
    }
  }
  uint64_t missed() const { return missed_; }

 private:
  bool read(const NodeLog& log, LogLine& line);

  uint64_t next_ = 0, missed_ = 0;
};

}  // namespace takt
