// SPDX-License-Identifier: Apache-2.0
#include "graph/explain/sentence.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace takt::explain {
namespace {

using trace::Cause;
using trace::Part;

constexpr int64_t kWakeUpNs = 50'000;  // about what a switch of threads takes
constexpr size_t kNamedCulprits = 3;   // of one cause; the others are told together

/// One decimal for misses of 10 ms and more, two from 1 ms, else three.
int decimals(int64_t miss_ns) { return std::abs(miss_ns) >= 10'000'000 ? 1 : std::abs(miss_ns) >= 1'000'000 ? 2 : 3; }

int64_t rounded(int64_t ns, int digits) {
  const double unit = 1e6 / std::pow(10, digits);
  return std::llround(static_cast<double>(ns) / unit);
}

std::string ms(int64_t units, int digits) {
  return fmt::format("{:.{}f}", static_cast<double>(units) / std::pow(10, digits), digits);
}

/// Of one cause only the largest culprits keep their names.
std::vector<Part> grouped(const std::vector<Part>& parts) {
  std::vector<Part> result;
  for (size_t first = 0, last = 0; first < parts.size(); first = last) {
    while (last < parts.size() && parts[last].cause == parts[first].cause) ++last;
    const size_t named = last - first > kNamedCulprits + 1 ? first + kNamedCulprits : last;
    for (size_t i = first; i < named; ++i) result.push_back(parts[i]);
    if (named == last) continue;
    Part others = parts[named];
    for (size_t i = named + 1; i < last; ++i) others.ns += parts[i].ns;
    others.who = fmt::format("{} others", last - named);
    others.cpu = -1;
    result.push_back(others);
  }
  return result;
}

/// Whoever left the CPU just as the job's thread woke up is no cause: the wake-up took that long.
std::vector<Part> without_wake_ups(const std::vector<Part>& parts) {
  std::vector<Part> result;
  int64_t wake_up_ns = 0;
  for (const Part& part : parts) {
    const bool wake_up = part.cause == Cause::late || (part.cause == Cause::behind && part.ns < kWakeUpNs);
    if (wake_up) wake_up_ns += part.ns;
    else result.push_back(part);
  }
  if (wake_up_ns != 0) result.insert(result.begin(), {Cause::late, wake_up_ns});
  return result;
}

std::string on_cpu(int cpu) { return cpu >= 0 ? fmt::format(" on cpu {}", cpu) : ""; }

std::string part_text(const Part& part, const std::string& figure, const std::string& node) {
  switch (part.cause) {
    case Cause::late: return fmt::format("released late {}", figure);
    case Cause::behind: return fmt::format("released late {} behind {}{}", figure, part.who, on_cpu(part.cpu));
    case Cause::lane:
      return part.who == node ? fmt::format("waited {} for its own previous job", figure)
                              : fmt::format("waited {} for {} ahead of it in its lane", figure, part.who);
    case Cause::queue: return fmt::format("waited {} for {}, which is not preempted", figure, part.who);
    case Cause::preempted:
      return part.who.empty() ? fmt::format("preempted {} by unnamed others", figure)
                              : fmt::format("preempted {} by {}{}", figure, part.who, on_cpu(part.cpu));
    case Cause::throttled: return fmt::format("throttled {} because its reservation was used up", figure);
    case Cause::asleep: return fmt::format("asleep {} in the job", figure);
    case Cause::stall: return fmt::format("host stall {}", figure);
    case Cause::unattributed: return fmt::format("{} unattributed", figure);
    case Cause::budget: return fmt::format("{} over its own budget", figure);
    case Cause::execution: return fmt::format("ran {} with no budget stated", figure);
    case Cause::running: return fmt::format("ran {}", figure);
    case Cause::slack:
      return part.ns > 0 ? fmt::format("{} of its budget beyond its deadline", figure)
                         : fmt::format("less {} of slack", figure);
  }
  return figure;
}

const char* source_text(trace::Source source) {
  switch (source) {
    case trace::Source::tracefs: return "switches from tracefs";
    case trace::Source::perf: return "switches from perf, which sees our own threads only";
    case trace::Source::simulation: return "switches as simulated";
    case trace::Source::none: break;
  }
  return "no source of switches, thread CPU clock only";
}

/// Releases that were skipped between this job and the node's next one.
size_t skipped_after(const trace::Trace& trace, const trace::JobSpan& job) {
  uint32_t next = UINT32_MAX;
  for (const trace::JobSpan& other : trace.jobs)
    if (other.task == job.task && other.job > job.job) next = std::min(next, other.job);
  return static_cast<size_t>(std::count_if(trace.marks.begin(), trace.marks.end(), [&](const trace::Mark& mark) {
    return mark.kind == trace::Kind::skip && mark.task == job.task && mark.job > job.job && mark.job < next;
  }));
}

}  // namespace

std::string cause_text(Cause cause, const std::string& who, int cpu, const std::string& node) {
  std::string text = part_text({cause, 0, who, cpu}, "", node);
  for (size_t at = text.find("  "); at != std::string::npos; at = text.find("  ")) text.erase(at, 1);
  while (text.starts_with(' ')) text.erase(0, 1);
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

std::string sentence(const trace::Trace& trace, const trace::JobSpan& job, const trace::Blame& blame) {
  const int digits = decimals(blame.miss_ns);
  const int64_t miss = rounded(blame.miss_ns, digits);
  const std::string& node = trace.tasks[job.task].name;
  const std::vector<Part> parts = grouped(without_wake_ups(blame.parts));
  std::vector<int64_t> units;
  int64_t sum = 0;
  size_t largest = 0;
  for (const Part& part : parts) {
    units.push_back(rounded(part.ns, digits));
    sum += units.back();
    if (std::abs(part.ns) > std::abs(parts[largest].ns)) largest = units.size() - 1;
  }
  // What rounding took, half a unit of each figure at most, is too little to show in the largest. If more is missing,
  // the figures stay as they are: they do not add up, and nobody shall think so.
  const bool by_rounding = 2 * std::abs(miss - sum) <= static_cast<int64_t>(units.size()) + 1;
  if (!units.empty() && by_rounding) units[largest] += miss - sum;
  std::vector<std::string> texts;
  for (size_t i = 0; i < parts.size(); ++i)
    if (units[i] != 0) texts.push_back(part_text(parts[i], ms(std::abs(units[i]), digits), node));
  std::string text = fmt::format("{} missed job {} by {} ms: {} ({})", node, job.job, ms(miss, digits),
                                 fmt::join(texts, ", "), source_text(trace.source));
  if (const size_t skipped = skipped_after(trace, job); skipped > 0)
    text +=
        fmt::format("; {} skipped after it", skipped == 1 ? "1 release was" : fmt::format("{} releases were", skipped));
  return text;
}

std::string report_sentence(const Json& node) {
  const auto count = [&](const char* key) {
    return node.contains(key) && node[key].is_number_unsigned() ? node[key].get<uint64_t>() : 0;
  };
  const auto longest = [&](const char* key, double per_ms) {
    const bool known =
        node.contains(key) && node[key].is_object() && node[key].contains("max") && node[key]["max"].is_number();
    return known ? fmt::format("{:.1f} ms", node[key]["max"].get<double>() / per_ms) : "not known";
  };
  if (count("deadline_misses") == 0) return "";
  std::string text = fmt::format(
      "{} missed {} of {} jobs. A report does not hold single jobs, so no cause is attributed; longest start after "
      "release {}, longest execution {} ({} over the budget), longest response {}",
      node.contains("name") && node["name"].is_string() ? node["name"].get<std::string>() : "?",
      count("deadline_misses"), count("released"), longest("lateness_us", 1e3), longest("exec_ms", 1),
      count("budget_overruns") == 1 ? "1 job" : fmt::format("{} jobs", count("budget_overruns")),
      longest("response_ms", 1));
  if (node.contains("preempted_ms") && node["preempted_ms"].is_number())
    text += fmt::format("; started but off the CPU {:.1f} ms in all jobs together", node["preempted_ms"].get<double>());
  return text;
}

}  // namespace takt::explain
