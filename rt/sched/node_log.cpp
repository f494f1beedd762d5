// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/node_log.hpp"

#include <algorithm>
#include <utility>

namespace takt {

namespace {

constexpr std::array<std::string_view, kLogLevels> kNames{"debug", "info", "warning", "error"};

}  // namespace

std::string_view to_string(LogLevel level) {
  return kNames[std::min<size_t>(static_cast<size_t>(level), kNames.size() - 1)];
}

std::optional<LogLevel> log_level(std::string_view name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<LogLevel>(found - kNames.begin());
}

std::string with_dropped(std::string_view text, uint32_t dropped) {
  std::string all(text);
  if (dropped == 1) all += " (1 line before it was dropped)";
  if (dropped > 1) all += " (" + std::to_string(dropped) + " lines before it were dropped)";
  return all;
}

bool LogWriter::admits(LogLevel level, int64_t now_ns) {
  constexpr int64_t kEachNs = 1'000'000'000 / kPerSecond;
  int64_t& from_ns = allowances_[level < LogLevel::warning ? 0 : 1].from_ns;
  from_ns = std::max(from_ns, now_ns - kBurst * kEachNs);
  if (now_ns - from_ns < kEachNs) {
    ++dropped_;
    log_.dropped_.fetch_add(1, std::memory_order_relaxed);
    return false;
  }
  from_ns += kEachNs;
  return true;
}

void LogWriter::append(LogLine& line) {
  line.dropped = std::exchange(dropped_, 0);
  std::array<uint64_t, NodeLog::kWords> words;
  std::memcpy(words.data(), &line, sizeof line);
  const uint64_t number = log_.size() + 1;
  NodeLog::Place& place = log_.places_[(number - 1) % NodeLog::kKept];
  // As in Boehm, "Can seqlocks get along with programming language memory models?" (2012), but with exchanges in place
  // of fences, which the thread sanitizer does not know.
  place.number.exchange(0, std::memory_order_acq_rel);
  for (size_t i = 0; i < words.size(); ++i) place.words[i].store(words[i], std::memory_order_release);
  place.number.store(number, std::memory_order_release);
  log_.size_.store(number, std::memory_order_release);
}

bool LogReader::read(const NodeLog& log, LogLine& line) {
  const NodeLog::Place& place = log.places_[next_ % NodeLog::kKept];
  if (place.number.load(std::memory_order_acquire) != next_ + 1) return false;
  std::array<uint64_t, NodeLog::kWords> words;
  for (size_t i = 0; i < words.size(); ++i) words[i] = place.words[i].load(std::memory_order_acquire);
  if (place.number.load(std::memory_order_acquire) != next_ + 1) return false;
  std::memcpy(static_cast<void*>(&line), words.data(), sizeof line);
  return true;
}

}  // namespace takt
