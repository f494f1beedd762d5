// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/script.hpp"

#include <cmath>

#include "hal/settings/units.hpp"

namespace takt {
namespace {

constexpr const char* kForm =
    "; wanted: a time and a task, such as `2s goal cup_1.level=full; 30s stop`, times ascending";

std::string_view trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(" \t\r\n");
  return first == std::string_view::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r\n") + 1 - first);
}

}  // namespace

tl::expected<std::vector<TimedTask>, std::string> parse_task_script(std::string_view text) {
  std::vector<TimedTask> script;
  for (size_t at = 0; at <= text.size();) {
    const size_t end = std::min(text.find(';', at), text.size());
    const std::string_view piece = trimmed(text.substr(at, end - at));
    at = end + 1;
    if (piece.empty()) continue;
    const auto wrong = [&](const char* what) {
      return tl::make_unexpected("`" + std::string(piece) + "` " + what + kForm);
    };
    const size_t space = piece.find(' ');
    const auto seconds = parse_quantity(piece.substr(0, space), Dimension::time);
    if (!seconds || !(*seconds >= 0 && *seconds <= 4e9)) return wrong("does not begin with a time");
    const std::string_view task = space == std::string_view::npos ? "" : trimmed(piece.substr(space));
    if (task.empty()) return wrong("has no task");
    if (task.size() > Interaction::kLongestTask) return wrong("is longer than a task may be, 240 characters");
    script.push_back({std::llround(*seconds * 1e9), std::string(task)});
    if (script.size() > 1 && script[script.size() - 2].after_ns > script.back().after_ns)
      return wrong("comes before the piece before it");
  }
  return script;
}

InteractionReading ScriptedPerson::read(int64_t wanted_ns) {
  InteractionReading reading;
  if (!started_) return reading;
  reading.status = ReadStatus::ok;
  reading.stamp_ns = wanted_ns;
  for (const TimedTask& task : script_) {
    if (epoch_ns_ + task.after_ns > wanted_ns) break;
    ++reading.number;
    reading.task = task.task;
  }
  return reading;
}

}  // namespace takt
