// SPDX-License-Identifier: Apache-2.0
#include "graph/run/outages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

/// The end of the run for one that lasts until then.
int64_t end_of(const Outage& outage, const RunResult& result) {
  return outage.back_ns > 0 ? std::min(outage.back_ns, result.end_ns) : result.end_ns;
}

Json told(const Outage& outage, const std::string& process, std::vector<std::string> nodes, const RunResult& result) {
  const auto seconds = [&](int64_t ns) { return static_cast<double>(ns - result.epoch_ns) / 1e9; };
  const double down_s = static_cast<double>(end_of(outage, result) - outage.from_ns) / 1e9;
  std::string what = fmt::format("process {} {} at {:.2f} s, ", process, outage.cause.text(), seconds(outage.from_ns));
  if (outage.back_ns > 0) what += fmt::format("back after {:.2f} s", down_s);
  else what += outage.start_ns > 0 || outage.from_ns >= result.end_ns ? "not back by the end" : "given up";
  Json entry = {{"what", what},
                {"kind", "outage"},
                {"process", process},
                {"nodes", std::move(nodes)},
                {"cause", outage.cause.text()},
                {"at_s", seconds(outage.from_ns)},
                {"back_s", nullptr},
                {"down_s", down_s},
                {"chunks_freed", outage.freed},
                {"by_spare", outage.by_spare}};
  if (outage.back_ns > 0) {
    entry["back_s"] = seconds(outage.back_ns);
    const auto after_ms = [&](int64_t ns) { return static_cast<double>(ns - outage.from_ns) / 1e6; };
    entry["phases_ms"] = {{"started", after_ms(outage.start_ns)},
                          {"composed", after_ms(outage.composed_ns)},
                          {"joined", after_ms(outage.joined_ns)},
                          {"running", after_ms(outage.running_ns)}};
  }
  return entry;
}

/// Releases of a task within the outages of its process, none counted twice.
uint64_t missed(const TaskPlan& task, size_t process, const std::vector<Outage>& outages, const RunResult& result) {
  if (!task.rate) return 0;
  const int64_t origin_ns = result.epoch_ns + task.offset_ns;
  int64_t counted_to = 0, jobs = 0;
  for (const Outage& outage : outages) {
    if (outage.process != process) continue;
    const int64_t from = std::max(counted_to, task.rate->releases_before(origin_ns, outage.from_ns));
    counted_to = std::max(from, task.rate->releases_before(origin_ns, end_of(outage, result)));
    jobs += counted_to - from;
  }
  return static_cast<uint64_t>(jobs);
}

}  // namespace

void add_outages(const OutageLog& log, const std::vector<std::string>& processes, const Plan& plan,
                 const std::vector<std::vector<size_t>>& tasks_of, const RunResult& result, Json& report) {
  const std::vector<Outage> outages = log.in_order();
  for (const Outage& outage : outages) {
    std::vector<std::string> nodes;
    for (const size_t t : tasks_of[outage.process]) nodes.push_back(plan.tasks[t].name);
    report["faults"].push_back(told(outage, processes[outage.process], std::move(nodes), result));
  }
  if (log.lost() > 0)
    report["faults"].push_back(
        {{"what", fmt::format("{} earlier outages, not kept: releases in them are not in `down`", log.lost())}});
  for (size_t p = 0; p < tasks_of.size(); ++p)
    for (const size_t t : tasks_of[p])
      for (Json& node : report["nodes"])
        if (node["name"] == plan.tasks[t].name) node["down"] = missed(plan.tasks[t], p, outages, result);
}

void add_spares(const std::vector<std::string>& processes, const std::vector<graph::SpareChoice>& choices,
                const std::vector<graph::TakeoverRoom>& room, const Supervisor& supervisor, Json& report) {
  report["spares"] = Json::array();
  for (size_t p = 0; p < processes.size(); ++p) {
    const SpareUse use = supervisor.spare_use(p);
    if (!use.wanted) continue;
    report["spares"].push_back({{"process", processes[p]},
                                {"why", choices[p].why},
                                {"takeovers", use.takeovers},
                                {"not_ready", use.not_ready},
                                {"lost", use.lost},
                                {"ready_within_s", static_cast<double>(use.ready_within_ns) / 1e9},
                                {"memory_mb", use.memory_mb},
                                {"cpu_s", static_cast<double>(use.cpu_ns) / 1e9}});
    if (!room.empty()) report["spares"].back().update({{"needs_cores", room[p].needs}, {"free_cores", room[p].free}});
  }
}

}  // namespace takt::command
