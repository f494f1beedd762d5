// SPDX-License-Identifier: Apache-2.0
#include "graph/run/junit.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <vector>

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

struct Case {
  std::string suite, name, failure;  ///< failure: empty if the promise was kept
};

/// What was expected of a run or of a scenario: [{what, expected, observed, met}].
void add_findings(std::vector<Case>& cases, const std::string& suite, const Json& findings) {
  for (const Json& row : findings) {
    const std::string expected = row["expected"], observed = row["observed"], what = row["what"];
    cases.push_back({suite, fmt::format("{}: {}", what, expected),
                     row["met"].get<bool>() ? "" : fmt::format("expected {}, observed {}", expected, observed)});
  }
}

void add_nodes(std::vector<Case>& cases, const Json& nodes) {
  for (const Json& node : nodes) {
    const auto misses = node["deadline_misses"].get<uint64_t>(), completed = node["completed"].get<uint64_t>(),
               released = node["released"].get<uint64_t>();
    std::string failure;
    if (node["criticality"] == "high" && misses > 0) failure = fmt::format("missed {} deadlines", misses);
    else if (!node["rate_hz"].is_null() && completed + 1 < released)
      failure = fmt::format("completed {} of {} releases", completed, released);
    cases.push_back({"nodes", node["name"], failure});
  }
}

std::vector<Case> cases_of(const Json& report) {
  std::vector<Case> cases;
  const bool expects = report.contains("expectations"), scenario = report.contains("scenario");
  if (expects) add_findings(cases, "expectations", report["expectations"]["conditions"]);
  if (scenario) add_findings(cases, "scenario", report["scenario"]["expectations"]);
  if (expects || scenario) return cases;
  add_nodes(cases, report["nodes"]);
  const std::string verdict = report["proofs"]["verdict"];
  cases.push_back(
      {"proofs", "nothing was seen above its proof",
       verdict == "unexplained" ? "samples above their bound that no cause explains, see `proofs` of the report" : ""});
  const bool told = std::any_of(cases.begin(), cases.end(), [](const Case& one) { return !one.failure.empty(); });
  cases.push_back(
      {"run", "every job returned", report["ok"].get<bool>() || told ? "" : "a job hung, see `faults` of the report"});
  return cases;
}

}  // namespace

std::string junit_text(const Json& report) {
  const std::vector<Case> cases = cases_of(report);
  const std::string graph = report["graph"];
  tinyxml2::XMLPrinter xml;
  xml.PushHeader(false, true);
  xml.OpenElement("testsuite");
  xml.PushAttribute("name", ("takt." + graph).c_str());
  xml.PushAttribute("tests", static_cast<unsigned>(cases.size()));
  xml.PushAttribute("failures", static_cast<unsigned>(std::count_if(
                                    cases.begin(), cases.end(), [](const Case& one) { return !one.failure.empty(); })));
  xml.PushAttribute("time", report["duration_s"].get<double>());
  for (const Case& one : cases) {
    xml.OpenElement("testcase");
    xml.PushAttribute("classname", ("takt." + graph + "." + one.suite).c_str());
    xml.PushAttribute("name", one.name.c_str());
    if (!one.failure.empty()) {
      xml.OpenElement("failure");
      xml.PushAttribute("message", one.failure.c_str());
      xml.CloseElement();
    }
    xml.CloseElement();
  }
  xml.CloseElement();
  return std::string(xml.CStr()) + "\n";
}

}  // namespace takt::command
