// SPDX-License-Identifier: Apache-2.0
#include "graph/check/measured.hpp"

#include <fmt/format.h>

namespace takt::graph {

std::string measured_elsewhere(const ScheduleSpec& schedule, const machine::Identity& here) {
  if (!schedule.measured || schedule.measured->machine == here) return "";
  const MeasuredSpec& measured = *schedule.measured;
  const machine::Identity& there = measured.machine;
  std::string differs;
  const auto add = [&](const char* what, const std::string& was, const std::string& is) {
    if (was != is) differs += fmt::format("{}{} `{}`, here `{}`", differs.empty() ? "" : "; ", what, was, is);
  };
  add("processor", there.cpu, here.cpu);
  add("cores", std::to_string(there.cores), std::to_string(here.cores));
  add("kernel", there.kernel, here.kernel);
  const Position& at = measured.position;
  return fmt::format(
      "{}:{}:{}: warning: the budgets were measured on another machine ({}); measure them here: `takt "
      "profile GRAPH --in-place`",
      at.file, at.line, at.column, differs);
}

}  // namespace takt::graph
