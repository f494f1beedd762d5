// SPDX-License-Identifier: Apache-2.0
#include "bench/suite.hpp"

namespace takt::bench {

std::string refused_condition(const Suite& suite, const std::string& condition) {
  if (condition.empty()) return "";
  if (suite.conditions == nullptr)
    return "suite " + std::string(suite.name) + " is measured as a whole; leave out --only";
  std::string list;
  for (const std::string& known : suite.conditions()) {
    if (known == condition) return "";
    list += "\n  " + known;
  }
  return "no condition `" + condition + "` in suite " + std::string(suite.name) + "; there are:" + list;
}

std::string granted_text(const Grant& grant) {
  if (!grant.refused.empty()) return grant.refused;
  if (grant.policy != Policy::fixed) return "default policy";
  return "SCHED_FIFO " + std::to_string(grant.priority) +
         (grant.cpus.size() == 1 ? ", CPU " + std::to_string(grant.cpus[0]) : "");
}

void add_pair(std::vector<Row>& rows, Row row, const std::string& reference, const Pairs& pairs) {
  Row null{row.name + "_null", row.unit, 0, {}, reference, {}, {}, row.granted};
  row.reference = reference;
  if (const auto middle = pairs.middle()) {
    row.value = middle->value;
    row.reference_value = middle->reference;
    row.ratio = middle->ratio;
  }
  rows.push_back(std::move(row));
  if (const auto middle = pairs.null()) {
    null.value = middle->value;
    null.reference_value = middle->reference;
    null.ratio = middle->ratio;
    rows.push_back(std::move(null));
  }
}

}  // namespace takt::bench
