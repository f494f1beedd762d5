// SPDX-License-Identifier: Apache-2.0
#include "graph/check/proofs.hpp"

#include <algorithm>
#include <cmath>

namespace takt::graph {
namespace {

ModeProofs mode_proofs(const Plan& plan, const ModeCheck& mode) {
  ModeProofs proofs;
  for (const TaskPlan& task : plan.tasks) {
    const auto place = std::find(mode.tasks.begin(), mode.tasks.end(), task.name);
    if (place == mode.tasks.end()) {
      proofs.responses.push_back({std::nullopt, "the mode leaves it out"});
      continue;
    }
    const auto& bound_ns = mode.admission.nodes[static_cast<size_t>(place - mode.tasks.begin())].response_ns;
    proofs.responses.push_back({bound_ns, bound_ns ? "" : "the analysis gives no bound on its response"});
  }
  proofs.ages = mode.ages;
  return proofs;
}

}  // namespace

Proven Proofs::response(size_t mode, size_t task) const {
  return mode < modes.size() ? modes[mode].responses[task] : Proven{std::nullopt, why};
}

Proven Proofs::chain(size_t mode, const std::string& name) const { return age(mode, false, name); }
Proven Proofs::edge(size_t mode, const std::string& name) const { return age(mode, true, name); }

Proven Proofs::age(size_t mode, bool edge, const std::string& name) const {
  if (mode >= modes.size()) return {std::nullopt, why};
  const auto& ages = modes[mode].ages;
  const auto found =
      std::find_if(ages.begin(), ages.end(), [&](const AgeBound& a) { return a.edge == edge && a.name == name; });
  if (found == ages.end()) return {std::nullopt, edge ? "the edge has no max_age" : "the mode leaves it out"};
  return {found->bound_ns, found->bound_ns ? "" : found->why};
}

Proofs proofs_of(const Plan& plan, const CheckResult& check, const CheckMachine& machine) {
  Proofs proofs;
  proofs.policy = plan.policy;
  proofs.basis = check.basis;
  proofs.overheads_from = machine.overheads_from;
  proofs.stall_ns = check.charged.release_ns;
  if (!check.admitted) {
    proofs.why = "the schedule is not admitted; takt check says why";
    return proofs;
  }
  for (const ModeCheck& mode : check.modes) proofs.modes.push_back(mode_proofs(plan, mode));
  return proofs;
}

double chance_of(uint64_t above, uint64_t samples, double share) {
  if (above == 0) return 1;
  const auto n = static_cast<double>(samples);
  double sum = 0;
  for (uint64_t i = above; i <= samples; ++i) {
    const auto k = static_cast<double>(i);
    const double term = std::exp(std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1) +
                                 k * std::log(share) + (n - k) * std::log1p(-share));
    sum += term;
    // Beyond the middle of the distribution terms only fall.
    constexpr double kNothing = 1e-12;
    if (k > n * share && term < kNothing * sum) break;
  }
  return std::min(1.0, sum);
}

}  // namespace takt::graph
