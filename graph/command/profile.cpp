// SPDX-License-Identifier: Apache-2.0
#include "graph/command/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "graph/language/edit_schedule.hpp"

namespace takt::command {
namespace {

std::string ms(int64_t ns) { return ns > 0 ? fmt::format("{:.3f}", static_cast<double>(ns) / 1e6) : "-"; }

std::string quantile_name(double quantile) { return fmt::format("p{:g}", quantile * 100); }

std::string change(int64_t now_ns, int64_t before_ns) {
  if (before_ns <= 0) return "-";
  return fmt::format("{:+.0f} %", 100 * (static_cast<double>(now_ns) / static_cast<double>(before_ns) - 1));
}

/// `title`, then the names behind it, broken between them into lines of 80 columns.
std::string list_text(const std::string& title, const std::vector<std::string>& names) {
  std::string text = title, line;
  for (const std::string& name : names) {
    if (line.empty() || line.size() + name.size() + 1 > 80) {
      text += line + "\n";
      line = " ";
    }
    line += " " + name;
  }
  return names.empty() ? "" : text + line + "\n";
}

}  // namespace

int64_t NodeProfile::quantile_ns(double quantile) const {
  return std::max(alone.quantile_ns(quantile), together.quantile_ns(quantile));
}

bool NodeProfile::enough_for(double quantile) const {
  const auto enough = [&](const takt::Histogram& h) {
    return h.count() == 0 || static_cast<double>(h.count()) * (1 - quantile) >= 1;
  };
  return enough(alone) && enough(together);
}

std::map<std::string, int64_t> budgets_of(const std::vector<NodeProfile>& nodes, double quantile, double margin) {
  std::map<std::string, int64_t> budgets;
  for (const NodeProfile& node : nodes) {
    const auto ns = static_cast<int64_t>(std::ceil(static_cast<double>(node.quantile_ns(quantile)) * margin));
    if (ns > 0) budgets[node.name] = ns;
  }
  return budgets;
}

std::vector<Drift> drift_of(const std::vector<NodeProfile>& nodes, const graph::ScheduleSpec& schedule, double quantile,
                            double tolerance) {
  std::vector<Drift> drifts;
  for (const NodeProfile& node : nodes) {
    Drift drift;
    drift.name = node.name;
    drift.measured = node.samples() > 0;
    drift.measured_ns = node.quantile_ns(quantile);
    drift.budget_ns = node.budget_ns;
    if (schedule.measured) {
      const auto stored = schedule.measured->nodes.find(node.name);
      if (stored != schedule.measured->nodes.end()) drift.stored_ns = stored->second.exec_ns;
    }
    const auto above = [&](int64_t limit_ns) {
      return limit_ns > 0 && static_cast<double>(drift.measured_ns) > static_cast<double>(limit_ns) * (1 + tolerance);
    };
    drift.above_stored = above(drift.stored_ns);
    drift.above_budget = above(drift.budget_ns);
    drifts.push_back(std::move(drift));
  }
  return drifts;
}

std::string profile_text(const std::vector<NodeProfile>& nodes, double quantile, double margin) {
  const std::string q = quantile_name(quantile);
  std::string text = fmt::format("{:<18} {:>8} {:>9} {:>9} {:>9} {:>9} {:>10}\n", "execution, ms", "samples", "alone",
                                 "together", "largest", "budget", "new budget");
  text += fmt::format("{:<18} {:>8} {:>9} {:>9} {:>9} {:>9} {:>10}\n", "node", "", q, q, "", "stated",
                      fmt::format("{} x {:g}", q, margin));
  std::vector<std::string> few, none;
  const auto budgets = budgets_of(nodes, quantile, margin);
  for (const NodeProfile& node : nodes) {
    const auto budget = budgets.find(node.name);
    text += fmt::format("{:<18} {:>8} {:>9} {:>9} {:>9} {:>9} {:>10}\n", node.name, node.samples(),
                        ms(node.alone.quantile_ns(quantile)), ms(node.together.quantile_ns(quantile)),
                        ms(std::max(node.alone.max_ns(), node.together.max_ns())), ms(node.budget_ns),
                        budget == budgets.end() ? "-" : graph::budget_text(budget->second));
    if (node.samples() == 0) none.push_back(node.name);
    else if (!node.enough_for(quantile)) few.push_back(node.name);
  }
  return text + list_text(fmt::format("too few jobs for {}, so the largest counts:", q), few) +
         list_text("no job ran, so the budget stays:", none);
}

std::string drift_text(const std::vector<Drift>& drifts, double tolerance) {
  std::string text =
      fmt::format("{:<18} {:>9} {:>9} {:>7} {:>9} {:>7}\n", "execution, ms", "measured", "stored", "", "budget", "");
  for (const Drift& d : drifts)
    text += fmt::format("{:<18} {:>9} {:>9} {:>7} {:>9} {:>7}  {}\n", d.name, ms(d.measured_ns), ms(d.stored_ns),
                        d.measured ? change(d.measured_ns, d.stored_ns) : "-", ms(d.budget_ns),
                        d.measured ? change(d.measured_ns, d.budget_ns) : "-",
                        !d.measured                        ? "no job ran"
                        : d.above_stored && d.above_budget ? "ABOVE both"
                        : d.above_stored                   ? "ABOVE stored"
                        : d.above_budget                   ? "ABOVE budget"
                                                           : "ok");
  const auto bad = std::count_if(drifts.begin(), drifts.end(), [](const Drift& d) { return !d.ok(); });
  text += fmt::format("{} of {} nodes above by more than {:g} %\n", bad, drifts.size(), tolerance * 100);
  return text;
}

std::optional<double> parse_tolerance(const std::string& text) {
  size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    return std::nullopt;
  }
  if (text.substr(used) == "%") value /= 100;
  else if (used != text.size()) return std::nullopt;
  return value >= 0 && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

}  // namespace takt::command
