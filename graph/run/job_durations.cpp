// SPDX-License-Identifier: Apache-2.0
#include "graph/run/job_durations.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "graph/log/damages.hpp"
#include "graph/log/recorded_plan.hpp"
#include "rt/node.hpp"
#include "rt/record/log_file.hpp"
#include "rt/record/message_record.hpp"

namespace takt::command {
namespace {

JobDurations random(const Plan& plan, uint64_t seed) {
  return [&plan, seed](size_t task, uint64_t job) {
    const std::string key = fmt::format("{} {} {}", seed, plan.tasks[task].name, job);
    const uint64_t hash = record::hash_of(std::as_bytes(std::span(key.data(), key.size())));
    const double share = 0.5 + 0.5 * std::ldexp(static_cast<double>(hash >> 11), -53);
    return static_cast<int64_t>(share * static_cast<double>(plan.tasks[task].budget_ns));
  };
}

/// Execution times by name of the node, in the order of its jobs; none of a node that the record only names.
std::map<std::string, std::vector<int64_t>> recorded(const record::LogFile& log, const log::Json& tasks,
                                                     const Plan& plan) {
  std::map<std::string, std::vector<int64_t>> times;
  for (const log::Json& task : tasks) times[task.value("name", "")];  // those that had no job as well
  std::map<std::string, const Node*> nodes;
  for (const TaskPlan& task : plan.tasks) nodes[task.name] = task.node;
  for (const record::RecordedJob& job : log.jobs()) {
    if (job.task >= tasks.size() || job.cut_off) continue;  // damaged; or nobody knows what it would have taken
    const std::string name = tasks[job.task].value("name", "");
    const auto node = nodes.find(name);
    if (node == nodes.end()) continue;
    const auto& levels = node->second->levels();
    const auto level = static_cast<size_t>(job.level);
    times[name].push_back(at_full_quality_ns(job.cpu_ns, level < levels.size() ? levels[level].cost : 1.0));
  }
  return times;
}

tl::expected<JobDurations, std::string> recorded(const std::filesystem::path& file, const Plan& plan) {
  const auto log = record::LogFile::open(file);
  if (!log) return tl::make_unexpected("--durations: " + log.error());
  if (const std::string damages = log::damages_text(file, *log); !damages.empty())
    std::fprintf(stderr, "takt: --durations %s\n", damages.c_str());
  const log::Json json = log::Json::parse(log->attached("plan.json").value_or(""), nullptr, false);
  if (!json.is_object() || !json.contains("tasks") || !json["tasks"].is_array())
    return tl::make_unexpected(fmt::format("--durations {}: the record holds no readable plan.json", file.string()));
  const auto by_name = recorded(*log, json["tasks"], plan);
  std::vector<std::vector<int64_t>> times;
  for (const TaskPlan& task : plan.tasks) {
    const auto found = by_name.find(task.name);
    if (found == by_name.end())
      return tl::make_unexpected(fmt::format("--durations {}: the record knows no node {}", file.string(), task.name));
    times.push_back(found->second);
    if (times.back().empty()) times.back().push_back(task.budget_ns);
  }
  return [times = std::move(times)](size_t task, uint64_t job) { return times[task][job % times[task].size()]; };
}

}  // namespace

tl::expected<JobDurations, std::string> job_durations(const std::string& how, const Plan& plan, uint64_t seed) {
  if (how == "budgets") return JobDurations{};
  if (how == "random") return random(plan, seed);
  return recorded(how, plan);
}

int64_t at_full_quality_ns(int64_t cpu_ns, double cost) {
  if (!(cost > 0)) return cpu_ns;
  auto full_ns = static_cast<int64_t>(static_cast<double>(cpu_ns) / cost);
  while (static_cast<int64_t>(static_cast<double>(full_ns) * cost) < cpu_ns) ++full_ns;
  return full_ns;
}

}  // namespace takt::command
