// SPDX-License-Identifier: Apache-2.0
#include "graph/expect/figures.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace takt::graph {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kNsPerMs = 1e6;

const Json* named(const Json& list, const std::string& name) {
  const auto found = std::find_if(list.begin(), list.end(), [&](const Json& entry) { return entry["name"] == name; });
  return found == list.end() ? nullptr : &*found;
}

/// A figure that the report does not have is no proof.
Finding figure(std::string what, const Bound& bound, const char* unit, std::optional<double> value) {
  return {std::move(what), bound_text(bound, unit), value ? fmt::format("{:g}{}", *value, unit) : "nothing",
          value && bound.holds(*value)};
}

Finding modes(const std::vector<std::string>& expected, const Json& report) {
  std::vector<std::string> seen;
  for (const Json& mode : report["modes"]) seen.push_back(mode["name"].get<std::string>());
  return {"modes", fmt::format("{}", fmt::join(expected, ", ")), fmt::format("{}", fmt::join(seen, ", ")),
          seen == expected};
}

/// Jobs completed per active second, those without a result left out where `results` are asked for.
Finding rate(const char* what, bool results, const std::string& name, const Bound& bound, const Json& report) {
  std::optional<double> value;
  if (const Json* entry = named(report["nodes"], name); entry != nullptr && (*entry)["active_s"].get<double>() > 0) {
    const auto completed = (*entry)["completed"].get<double>();
    const double without = results ? (*entry)["no_result"].get<double>() : 0;
    value = std::max(0.0, completed - without) / (*entry)["active_s"].get<double>();
  }
  return figure(what + name, bound, " Hz", value);
}

Finding counter(const char* what, const std::string& name, const char* key, const Bound& bound, const Json& report) {
  std::optional<double> value;
  if (const Json* entry = named(report["nodes"], name)) value = static_cast<double>((*entry)[key].get<uint64_t>());
  return figure(fmt::format("{} of {}", what, name), bound, "", value);
}

Finding age(const std::string& name, Bound bound, const Json& report) {
  if (bound.at_least) *bound.at_least /= kNsPerMs;
  if (bound.at_most) *bound.at_most /= kNsPerMs;
  std::optional<double> value;
  if (const Json* chain = named(report["chains"], name); chain != nullptr && !(*chain)["age_ms"]["max"].is_null())
    value = (*chain)["age_ms"]["max"].get<double>();
  return figure("oldest of " + name, bound, " ms", value);
}

bool has(const std::vector<std::string>& names, const Json& name) {
  return std::find(names.begin(), names.end(), name.get<std::string>()) != names.end();
}

/// What an excepted node did, or the outage of a process that has one.
bool concerns(const Json& fault, const std::vector<std::string>& except) {
  if (fault.contains("node")) return has(except, fault["node"]);
  return fault.contains("nodes") &&
         std::any_of(fault["nodes"].begin(), fault["nodes"].end(), [&](const Json& node) { return has(except, node); });
}

Finding high_nodes(const FigureExpectations& expected, const Json& report, const std::vector<std::string>& except) {
  std::vector<std::string> broken;
  for (const Json& entry : report["nodes"]) {
    const auto name = entry["name"].get<std::string>();
    if (entry["criticality"] != "high" || has(except, entry["name"])) continue;
    const auto misses = entry["deadline_misses"].get<uint64_t>();
    if (misses > 0 && !expected.misses.contains(name)) broken.push_back(fmt::format("{} missed {}", name, misses));
    const auto completed = entry["completed"].get<uint64_t>(), released = entry["released"].get<uint64_t>();
    if (!entry["rate_hz"].is_null() && completed + 1 < released && !expected.rates.contains(name))
      broken.push_back(fmt::format("{} completed {} of {}", name, completed, released));
  }
  return {"high nodes not struck", "no miss, all jobs",
          broken.empty() ? "kept" : fmt::format("{}", fmt::join(broken, ", ")), broken.empty()};
}

Finding failures(const Json& report, const std::vector<std::string>& except) {
  std::vector<std::string> failed;
  for (const Json& fault : report["faults"])
    if (!concerns(fault, except)) failed.push_back(fault["what"].get<std::string>());
  return {"nodes not struck", "none fails", failed.empty() ? "none" : fmt::format("{}", fmt::join(failed, "; ")),
          failed.empty()};
}

}  // namespace

std::vector<Finding> figure_findings(const FigureExpectations& expected, const Json& report) {
  std::vector<Finding> findings;
  if (!expected.modes.empty()) findings.push_back(modes(expected.modes, report));
  for (const auto& [node, bound] : expected.rates) findings.push_back(rate("rate of ", false, node, bound, report));
  for (const auto& [node, bound] : expected.results) findings.push_back(rate("results of ", true, node, bound, report));
  for (const auto& [node, bound] : expected.misses)
    findings.push_back(counter("misses", node, "deadline_misses", bound, report));
  for (const auto& [node, bound] : expected.stale)
    findings.push_back(counter("stale", node, "stale_inputs", bound, report));
  for (const auto& [chain, bound] : expected.ages) findings.push_back(age(chain, bound, report));
  return findings;
}

std::vector<Finding> promise_findings(const FigureExpectations& expected, const Json& report,
                                      const std::vector<std::string>& except) {
  return {high_nodes(expected, report, except), failures(report, except)};
}

}  // namespace takt::graph
