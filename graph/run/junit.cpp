// SPDX-License-Identifier: Apache-2.0
#include "graph/run/junit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "graph/view/markup.hpp"

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
  const auto failures = std::count_if(cases.begin(), cases.end(), [](const Case& one) { return !one.failure.empty(); });
  const std::string name = view::escape("takt." + graph);
  std::string xml = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" time=\"{}\">\n",
      name, cases.size(), failures, report["duration_s"].get<double>());
  for (const Case& one : cases) {
    xml += fmt::format("  <testcase classname=\"{}.{}\" name=\"{}\"", name, one.suite, view::escape(one.name));
    xml += one.failure.empty()
               ? "/>\n"
               : fmt::format(">\n    <failure message=\"{}\"/>\n  </testcase>\n", view::escape(one.failure));
  }
  return xml + "</testsuite>\n";
}

}  // namespace takt::command
