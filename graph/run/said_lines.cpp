// SPDX-License-Identifier: Apache-2.0
#include "graph/run/said_lines.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>

namespace takt::command {
namespace {

/// Of syslog(3).
int priority_of(LogLevel level) {
  switch (level) {
    case LogLevel::debug: return 7;
    case LogLevel::info: return 6;
    case LogLevel::warning: return 4;
    case LogLevel::error: break;
  }
  return 3;
}

/// A node's text is its own; what would move the cursor of a terminal is not shown.
std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return text;
}

}  // namespace

SaidLines::SaidLines(const Plan& plan, const RunBoard& board, bool prefixed)
    : plan_(plan), board_(board), prefixed_(prefixed), readers_(plan.tasks.size()) {}

std::vector<std::string> SaidLines::take() {
  std::vector<std::pair<int64_t, std::string>> all;
  const int64_t epoch_ns = board_.epoch_ns();
  const auto add = [&](int64_t at_ns, LogLevel level, std::string_view node, const std::string& text) {
    all.emplace_back(at_ns,
                     fmt::format("{}{:.3f} s {}: {}: {}", prefixed_ ? fmt::format("<{}>", priority_of(level)) : "",
                                 static_cast<double>(at_ns - epoch_ns) / 1e9, node, to_string(level), text));
  };
  uint64_t missed = 0;
  int64_t newest_ns = epoch_ns;
  for (size_t t = 0; t < readers_.size(); ++t) {
    readers_[t].take(board_.log(t), [&](const LogLine& line) {
      newest_ns = std::max(newest_ns, line.at_ns);
      if (line.level >= LogLevel::info)
        add(line.at_ns, line.level, plan_.tasks[t].name, printable(with_dropped(line.text.text(), line.dropped)));
    });
    missed += readers_[t].missed();
  }
  if (const uint64_t more = missed - std::exchange(missed_, missed); more > 0)
    add(newest_ns, LogLevel::warning, "takt",
        fmt::format("{} lines came too fast to be shown; a record has them", more));
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> lines;
  for (auto& [at_ns, line] : all) lines.push_back(std::move(line));
  return lines;
}

bool in_journal(int descriptor) {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat file {};
  if (stream == nullptr || fstat(descriptor, &file) != 0) return false;
  return fmt::format("{}:{}", file.st_dev, file.st_ino) == stream;
}

}  // namespace takt::command
