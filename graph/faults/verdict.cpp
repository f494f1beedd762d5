// SPDX-License-Identifier: Apache-2.0
#include "graph/faults/verdict.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "graph/expect/figures.hpp"

namespace takt::graph {
namespace {

using Json = nlohmann::ordered_json;

std::string seconds_text(int64_t ns) { return fmt::format("{:.3f} s", static_cast<double>(ns) * 1e-9); }

/// "drop head_camera.pair"
std::string fault_text(std::string_view kind, std::string_view target) {
  return fmt::format("{}{}{}", kind, target.empty() ? "" : " ", target);
}

class Judge {
 public:
  Judge(const Scenario& scenario, const Json& report, const RunEvents& events)
      : scenario_(scenario), expect_(scenario.expect), report_(report), events_(events) {}

  std::vector<Finding> judge() {
    findings_ = figure_findings(expect_, report_);
    for (const auto& [process, bound] : expect_.restarts) restarts(process, bound);
    if (expect_.recovery_ns) recovery(*expect_.recovery_ns);
    if (expect_.lost) lost(*expect_.lost);
    exit();
    every_fault_struck();
    for (Finding& finding : promise_findings(expect_, report_, events_.struck_nodes))
      findings_.push_back(std::move(finding));
    return std::move(findings_);
  }

 private:
  void add(std::string what, std::string expected, std::string observed, bool met) {
    findings_.push_back({std::move(what), std::move(expected), std::move(observed), met});
  }
  void add(std::string what, const Bound& bound, double value) {
    add(std::move(what), bound_text(bound, ""), fmt::format("{:g}", value), bound.holds(value));
  }

  void restarts(const std::string& process, const Bound& bound) {
    const auto count = std::count_if(events_.restarts.begin(), events_.restarts.end(),
                                     [&](const Restart& restart) { return restart.process == process; });
    add("restarts of " + process, bound, static_cast<double>(count));
  }

  /// The longest time from the end of a fault to the last sign of it: before the next fault begins, or the run ends.
  void recovery(int64_t within_ns) {
    int64_t longest = -1;
    std::string slowest;
    const auto took = [&](int64_t ns, const std::string& who) {
      if (ns <= longest) return;
      longest = ns;
      slowest = who;
    };
    for (const FaultSpec& fault : scenario_.faults) {
      const int64_t end = fault.ends_ns();
      if (end >= events_.end_ns) continue;
      took(0, "");
      for (const Unwell& sign : events_.unwell)
        if (sign.at_ns > end && sign.at_ns <= next_begin(end)) took(sign.at_ns - end, sign.node);
    }
    for (const Restart& restart : events_.restarts) took(restart.back_ns - restart.gone_ns, restart.process);
    const std::string observed = longest < 0       ? "no fault ended before the run did"
                                 : slowest.empty() ? seconds_text(longest)
                                                   : seconds_text(longest) + " (" + slowest + ")";
    add("recovery", "within " + seconds_text(within_ns), observed, longest >= 0 && longest <= within_ns);
  }

  int64_t next_begin(int64_t after_ns) const {
    int64_t next = events_.end_ns;
    for (const FaultSpec& fault : scenario_.faults)
      if (fault.begins_ns() >= after_ns) next = std::min(next, fault.begins_ns());
    return next;
  }

  void lost(const Bound& bound) {
    const auto recorder = report_["recorder_lost"].get<uint64_t>();
    add("lost", bound, static_cast<double>(recorder + events_.unaccounted));
  }

  void exit() {
    const bool met = expect_.exit ? events_.exit == *expect_.exit : events_.exit <= 1;
    add("exit", expect_.exit ? std::to_string(*expect_.exit) : "0 or 1", std::to_string(events_.exit), met);
  }

  void every_fault_struck() {
    std::vector<std::string> idle;
    for (size_t f = 0; f < scenario_.faults.size(); ++f) {
      const FaultSpec& fault = scenario_.faults[f];
      if (events_.struck[f] == 0) idle.push_back(fault_text(info(fault.kind).name, fault.target));
    }
    add("faults", "each strikes", idle.empty() ? "each struck" : fmt::format("never: {}", fmt::join(idle, ", ")),
        idle.empty());
  }

  const Scenario& scenario_;
  const Expectations& expect_;
  const Json& report_;
  const RunEvents& events_;
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> verdict(const Scenario& scenario, const Json& report, const RunEvents& events) {
  return Judge(scenario, report, events).judge();
}

Json scenario_json(const Scenario& scenario, const RunEvents& events, const std::vector<Finding>& findings) {
  Json json{{"name", scenario.name}, {"seed", scenario.seed}, {"faults", Json::array()}};
  for (size_t f = 0; f < scenario.faults.size(); ++f)
    json["faults"].push_back({{"kind", info(scenario.faults[f].kind).name},
                              {"target", scenario.faults[f].target},
                              {"struck", events.struck[f]}});
  json["expectations"] = findings_json(findings);
  json["met"] = all_met(findings);
  return json;
}

std::string scenario_text(const Json& scenario) {
  std::string text =
      fmt::format("scenario {} (seed {})\n", scenario["name"].get<std::string>(), scenario["seed"].get<uint64_t>());
  for (const Json& fault : scenario["faults"])
    text += fmt::format("  {}: struck {}\n",
                        fault_text(fault["kind"].get<std::string>(), fault["target"].get<std::string>()),
                        fault["struck"].get<uint64_t>());
  text += findings_text(scenario["expectations"]);
  return text + (scenario["met"].get<bool>() ? "scenario met\n" : "SCENARIO NOT MET\n");
}

}  // namespace takt::graph
