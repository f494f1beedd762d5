// SPDX-License-Identifier: Apache-2.0
#include "graph/expect/finding.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace takt::graph {

using Json = nlohmann::ordered_json;

bool all_met(const std::vector<Finding>& findings) {
  return std::all_of(findings.begin(), findings.end(), [](const Finding& finding) { return finding.met; });
}

std::string bound_text(const Bound& bound, std::string_view unit) {
  if (bound.at_least && bound.at_most && *bound.at_least == *bound.at_most)
    return fmt::format("{:g}{}", *bound.at_least, unit);
  std::string text;
  if (bound.at_least) text = fmt::format("at least {:g}{}", *bound.at_least, unit);
  if (bound.at_most) text += fmt::format("{}at most {:g}{}", text.empty() ? "" : ", ", *bound.at_most, unit);
  return text;
}

Json findings_json(const std::vector<Finding>& findings) {
  Json list = Json::array();
  for (const Finding& finding : findings) {
    list.push_back(
        {{"what", finding.what}, {"expected", finding.expected}, {"observed", finding.observed}, {"met", finding.met}});
    if (finding.since_s) list.back()["since_s"] = *finding.since_s;
  }
  return list;
}

std::string findings_text(const Json& findings) {
  constexpr const char* kRow = "  {:<3} {:<26} {:<24} {}{}\n";
  std::string text = fmt::format(fmt::runtime(kRow), "", "", "expected", "observed", "");
  for (const Json& row : findings)
    text += fmt::format(fmt::runtime(kRow), row["met"].get<bool>() ? "ok" : "NO", row["what"].get<std::string>(),
                        row["expected"].get<std::string>(), row["observed"].get<std::string>(),
                        row.contains("since_s") ? fmt::format(", since {:.3f} s", row["since_s"].get<double>()) : "");
  return text;
}

}  // namespace takt::graph
