// SPDX-License-Identifier: Apache-2.0
// What happened once, not per job: changes of mode, faults; and the lines of the summary that name who was to blame.
#include <fmt/format.h>

#include <algorithm>

#include "graph/attach/parameters.hpp"
#include "graph/run/report.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

std::string_view to_string(uint32_t kind) {
  switch (kind) {
    case Fault::hang: return "hang";
    case Fault::exception: return "exception";
    case Fault::memory: return "memory";
    case Fault::lost: return "lost";
    case Fault::back: return "back";
    case Fault::doubtful: return "doubtful";
    case Fault::wrong: return "wrong";
    case Fault::spoiled: return "spoiled";
    case Fault::damaged: return "damaged";
    case Fault::bandwidth: return "bandwidth";
    case Fault::poison: return "poison";
  }
  return "";
}

/// "demoted 6 times, nanosleep 20"; empty if the node kept to the rules.
std::string offences(const Json& node) {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  const auto count = [&](const char* key, const char* what) {
    if (const auto n = node.value(key, uint64_t{0}); n > 0) add(fmt::format("{} {}", what, n));
  };
  count("budget_overruns", "budget overruns");
  if (const auto n = node.value("demoted", uint64_t{0}); n > 0)
    add(fmt::format("demoted {} (at most {:.0f} us late)", n, node["enforcement_error_us"].get<double>()));
  count("lifted", "lifted out of a used-up reservation");
  if (node["rt_violations"].is_object())
    for (const auto& [call, n] : node["rt_violations"].items())
      add(fmt::format("{} in jobs {}", call, n.get<uint64_t>()));
  return text;
}

/// "parameters: cruise.speed 0.2 m/s (set at 3.1 s)"; empty if all are as in the graph's file.
std::string parameters_line(const Json& parameters) {
  std::string text;
  for (const Json& parameter : parameters)
    text += (text.empty() ? "parameters: " : ", ") + attach::parameter_text(parameter);
  return text.empty() ? "" : text + "\n";
}

/// "900 received, 3 damaged, missing 1; trouble"; empty if the device lost nothing and is well.
std::string losses(const Json& device) {
  std::string text;
  for (const char* what : {"damaged", "resyncs", "missing", "unsent"})
    if (const auto n = device.value(what, uint64_t{0}); n > 0) text += fmt::format(", {} {}", n, what);
  if (!text.empty()) text = fmt::format("{} received{}", device["received"].get<uint64_t>(), text);
  const auto trouble = device.value("trouble", "");
  return text + (text.empty() || trouble.empty() ? "" : "; ") + trouble;
}

}  // namespace

Json modes_json(const RunFacts& facts) {
  const int64_t epoch = facts.result.epoch_ns, end = std::max(epoch, facts.result.end_ns);
  const auto seconds = [&](int64_t ns) { return static_cast<double>(std::clamp(ns, epoch, end) - epoch) / 1e9; };
  Json modes =
      Json::array({{{"name", facts.graph.mode}, {"from_s", 0.0}, {"to_s", seconds(end)}, {"reason", "start"}}});
  for (size_t i = 0; i < facts.board.modes().size(); ++i) {
    const ModeLog::Change* change = facts.board.modes().change(i);
    if (change == nullptr || change->mode >= facts.plan.modes.size() || change->from_ns >= end ||
        facts.board.modes().repeats(i))
      continue;
    modes.back()["to_s"] = seconds(change->from_ns);
    modes.push_back({{"name", facts.plan.modes[change->mode].name},
                     {"from_s", seconds(change->from_ns)},
                     {"to_s", seconds(end)},
                     {"reason", facts.board.modes().reason(i)}});
  }
  return modes;
}

Json faults_json(const RunFacts& facts) {
  Json faults = Json::array();
  for (size_t i = 0; i < facts.board.faults().size(); ++i) {
    const Fault* fault = facts.board.faults().at(i);
    if (fault == nullptr || fault->task >= facts.plan.tasks.size()) continue;
    faults.push_back({{"what", fault->what.text()},
                      {"kind", to_string(fault->kind)},
                      {"node", facts.plan.tasks[fault->task].name},
                      {"job", fault->job},
                      {"at_s", static_cast<double>(fault->at_ns - facts.result.epoch_ns) / 1e9}});
  }
  if (const uint64_t lost = facts.board.faults().lost(); lost > 0)
    faults.push_back({{"what", fmt::format("{} more faults, not kept", lost)}});
  return faults;
}

Json devices_json(const RunFacts& facts) {
  Json devices = Json::array();
  for (size_t t = 0; t < facts.plan.tasks.size(); ++t) {
    if (!facts.plan.tasks[t].device) continue;
    const SourceRecord& source = facts.board.source(t);
    const SourceCounts counts = source.counts();
    devices.push_back({{"name", facts.plan.tasks[t].name},
                       {"state", to_text(source.state.load())},
                       {"losses", source.losses.load()},
                       {"lost_s", static_cast<double>(source.lost_until_ns(facts.result.end_ns)) / 1e9},
                       {"reopen_tries", source.reopen_tries.load()},
                       {"received", counts.received},
                       {"damaged", counts.damaged},
                       {"resyncs", counts.resyncs},
                       {"missing", counts.missing},
                       {"unsent", counts.unsent},
                       {"trouble", source.trouble.text()}});
  }
  return devices;
}

Json violations_json(const TaskStatistics& statistics) {
  if (!watching_job_calls()) return nullptr;
  Json calls = Json::object();
  for (size_t i = 0; i < kJobCalls; ++i)
    if (const uint64_t count = statistics.rt_violations[i]; count > 0)
      calls[std::string(takt::to_string(static_cast<JobCall>(i)))] = count;
  return calls;
}

bool hung(const RunBoard& board) {
  for (size_t i = 0; i < board.faults().size(); ++i)
    if (const Fault* fault = board.faults().at(i); fault != nullptr && fault->kind == Fault::hang) return true;
  return false;
}

std::string events_text(const Json& report) {
  std::string text = parameters_line(report["parameters"]);
  const Json& modes = report["modes"];
  for (size_t i = 1; i < modes.size(); ++i)
    text += fmt::format("mode {} from {:.3f} s to {:.3f} s: {}\n", modes[i]["name"].get<std::string>(),
                        modes[i]["from_s"].get<double>(), modes[i]["to_s"].get<double>(),
                        modes[i]["reason"].get<std::string>());
  for (const Json& device : report["devices"])
    if (const auto losses = device["losses"].get<uint64_t>(); losses > 0)
      text +=
          fmt::format("device {}: lost {} time{}, {:.1f} s; {} tries to reopen it; now {}\n",
                      device["name"].get<std::string>(), losses, losses == 1 ? "" : "s", device["lost_s"].get<double>(),
                      device["reopen_tries"].get<uint64_t>(), device["state"].get<std::string>());
  for (const Json& device : report["devices"])
    if (const std::string what = losses(device); !what.empty())
      text += fmt::format("device {}: {}\n", device["name"].get<std::string>(), what);
  for (const Json& edge : report["edges"])
    if (const auto refused = edge["exhausted"].get<uint64_t>(); refused > 0)
      text += fmt::format("edge {} -> {}: {} messages never made, no chunk was free\n", edge["from"].get<std::string>(),
                          edge["to"].get<std::string>(), refused);
  for (const Json& node : report["nodes"])
    if (const std::string what = offences(node); !what.empty())
      text += fmt::format("{}: {}\n", node["name"].get<std::string>(), what);
  for (const Json& pool : report["memory"]["pools"])
    if (const auto refused = pool["exhausted"].get<uint64_t>(); refused > 0)
      text += fmt::format("{}: {} messages refused\n", pool["port"].get<std::string>(), refused);
  for (const Json& fault : report["faults"]) text += "fault: " + fault["what"].get<std::string>() + "\n";
  return text;
}

}  // namespace takt::command
