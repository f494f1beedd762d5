// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/log_line.hpp>: core, experimental.
// What a job says in the log of its run: see Job::log.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "rt/sched/append_log.hpp"

namespace takt {

/// How much a line matters. `debug` is kept in records and shown by whoever asks; the others `takt run` prints, too.
enum class LogLevel : uint8_t { debug, info, warning, error };
inline constexpr uint8_t kLogLevels = 4;
/// "debug", "info", "warning", "error"; a number that is none of them reads as "error".
std::string_view to_string(LogLevel level);
std::optional<LogLevel> log_level(std::string_view name);

struct LogLine {
  int64_t at_ns = 0;
  uint64_t job = 0;      ///< Job::index() of the job that said it
  uint32_t dropped = 0;  ///< lines of the node that were too many since its line before this one
  LogLevel level = LogLevel::info;
  BoundedText<200> text;
};

/// As whoever shows a line says it: "only 3 of 8 points fit (12 lines before it were dropped)".
std::string with_dropped(std::string_view text, uint32_t dropped);

}  // namespace takt
