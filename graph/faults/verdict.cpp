// SPDX-License-Identifier: Apache-2.0
#include "graph/faults/verdict.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace takt::graph {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kNsPerMs = 1e6;

std::string bound_text(const Bound& bound, const char* unit) {
  if (bound.at_least && bound.at_most && *bound.at_least == *bound.at_most)
    return fmt::format("{:g}{}", *bound.at_least, unit);
  std::string text;
  if (bound.at_least) text = fmt::format("at least {:g}{}", *bound.at_least, unit);
  if (bound.at_most) text += fmt::format("{}at most {:g}{}", text.empty() ? "" : ", ", *bound.at_most, unit);
  return text;
}

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
    modes();
    for (const auto& [node, bound] : expect_.rates) rate(node, bound);
    for (const auto& [node, bound] : expect_.misses) counter("misses", node, "deadline_misses", bound);
    for (const auto& [node, bound] : expect_.stale) counter("stale", node, "stale_inputs", bound);
    for (const auto& [chain, bound] : expect_.ages) age(chain, bound);
    for (const auto& [process, bound] : expect_.restarts) restarts(process, bound);
    if (expect_.recovery_ns) recovery(*expect_.recovery_ns);
    if (expect_.lost) lost(*expect_.lost);
    exit();
    every_fault_struck();
    others_keep_their_promises();
    no_other_node_fails();
    return std::move(findings_);
  }

 private:
  void add(std::string what, std::string expected, std::string observed, bool met) {
    findings_.push_back({std::move(what), std::move(expected), std::move(observed), met});
  }
  void add(std::string what, const Bound& bound, const char* unit, std::optional<double> value) {
    add(std::move(what), bound_text(bound, unit), value ? fmt::format("{:g}{}", *value, unit) : "nothing",
        value && bound.holds(*value));
  }

  const Json* node(const std::string& name) const { return named("nodes", name); }
  const Json* named(const char* list, const std::string& name) const {
    for (const Json& entry : report_[list])
      if (entry["name"] == name) return &entry;
    return nullptr;
  }

  void modes() {
    if (expect_.modes.empty()) return;
    std::vector<std::string> seen;
    for (const Json& mode : report_["modes"]) seen.push_back(mode["name"].get<std::string>());
    add("modes", fmt::format("{}", fmt::join(expect_.modes, ", ")), fmt::format("{}", fmt::join(seen, ", ")),
        seen == expect_.modes);
  }

  void rate(const std::string& name, const Bound& bound) {
    std::optional<double> value;
    if (const Json* entry = node(name); entry != nullptr && (*entry)["active_s"].get<double>() > 0)
      value = static_cast<double>((*entry)["completed"].get<uint64_t>()) / (*entry)["active_s"].get<double>();
    add("rate of " + name, bound, " Hz", value);
  }

  void counter(const char* what, const std::string& name, const char* key, const Bound& bound) {
    std::optional<double> value;
    if (const Json* entry = node(name)) value = static_cast<double>((*entry)[key].get<uint64_t>());
    add(fmt::format("{} of {}", what, name), bound, "", value);
  }

  void age(const std::string& name, Bound bound) {
    if (bound.at_least) *bound.at_least /= kNsPerMs;
    if (bound.at_most) *bound.at_most /= kNsPerMs;
    std::optional<double> value;
    if (const Json* chain = named("chains", name); chain != nullptr && !(*chain)["age_ms"]["max"].is_null())
      value = (*chain)["age_ms"]["max"].get<double>();
    add("oldest of " + name, bound, " ms", value);
  }

  void restarts(const std::string& process, const Bound& bound) {
    const auto count = std::count_if(events_.restarts.begin(), events_.restarts.end(),
                                     [&](const Restart& restart) { return restart.process == process; });
    add("restarts of " + process, bound, "", static_cast<double>(count));
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
    add("lost", bound, "", static_cast<double>(recorder + events_.unaccounted));
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

  bool is_struck(const std::string& name) const {
    return std::find(events_.struck_nodes.begin(), events_.struck_nodes.end(), name) != events_.struck_nodes.end();
  }

  void others_keep_their_promises() {
    std::vector<std::string> broken;
    for (const Json& entry : report_["nodes"]) {
      const auto name = entry["name"].get<std::string>();
      if (entry["criticality"] != "high" || is_struck(name)) continue;
      const auto misses = entry["deadline_misses"].get<uint64_t>();
      if (misses > 0 && !expect_.misses.contains(name)) broken.push_back(fmt::format("{} missed {}", name, misses));
      const auto completed = entry["completed"].get<uint64_t>(), released = entry["released"].get<uint64_t>();
      if (!entry["rate_hz"].is_null() && completed + 1 < released && !expect_.rates.contains(name))
        broken.push_back(fmt::format("{} completed {} of {}", name, completed, released));
    }
    add("high nodes not struck", "no miss, all jobs",
        broken.empty() ? "kept" : fmt::format("{}", fmt::join(broken, ", ")), broken.empty());
  }

  /// What a struck node did, or the outage of a process that has one.
  bool concerns_struck(const Json& fault) const {
    if (fault.contains("node")) return is_struck(fault["node"].get<std::string>());
    if (!fault.contains("nodes")) return false;
    return std::any_of(fault["nodes"].begin(), fault["nodes"].end(),
                       [&](const Json& node) { return is_struck(node.get<std::string>()); });
  }

  void no_other_node_fails() {
    std::vector<std::string> failed;
    for (const Json& fault : report_["faults"])
      if (!concerns_struck(fault)) failed.push_back(fault["what"].get<std::string>());
    add("nodes not struck", "none fails", failed.empty() ? "none" : fmt::format("{}", fmt::join(failed, "; ")),
        failed.empty());
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
  Json json{
      {"name", scenario.name}, {"seed", scenario.seed}, {"faults", Json::array()}, {"expectations", Json::array()}};
  for (size_t f = 0; f < scenario.faults.size(); ++f)
    json["faults"].push_back({{"kind", info(scenario.faults[f].kind).name},
                              {"target", scenario.faults[f].target},
                              {"struck", events.struck[f]}});
  bool met = true;
  for (const Finding& finding : findings) {
    json["expectations"].push_back(
        {{"what", finding.what}, {"expected", finding.expected}, {"observed", finding.observed}, {"met", finding.met}});
    met = met && finding.met;
  }
  json["met"] = met;
  return json;
}

std::string scenario_text(const Json& scenario) {
  std::string text =
      fmt::format("scenario {} (seed {})\n", scenario["name"].get<std::string>(), scenario["seed"].get<uint64_t>());
  for (const Json& fault : scenario["faults"])
    text += fmt::format("  {}: struck {}\n",
                        fault_text(fault["kind"].get<std::string>(), fault["target"].get<std::string>()),
                        fault["struck"].get<uint64_t>());
  constexpr const char* kRow = "  {:<3} {:<26} {:<24} {}\n";
  text += fmt::format(fmt::runtime(kRow), "", "", "expected", "observed");
  for (const Json& row : scenario["expectations"])
    text += fmt::format(fmt::runtime(kRow), row["met"].get<bool>() ? "ok" : "NO", row["what"].get<std::string>(),
                        row["expected"].get<std::string>(), row["observed"].get<std::string>());
  return text + (scenario["met"].get<bool>() ? "scenario met\n" : "SCENARIO NOT MET\n");
}

}  // namespace takt::graph
