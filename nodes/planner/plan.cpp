// SPDX-License-Identifier: Apache-2.0
#include "nodes/planner/plan.hpp"

#include <fmt/format.h>

namespace takt::planner {

std::string to_text(const semantic::SemanticMap& map, const Domain& domain, const Plan& plan) {
  if (!plan.exists())
    return plan.verdict == Verdict::none ? "no plan leads to the goals" : "no plan was found in the time that was left";
  if (plan.steps.empty()) return "nothing has to be done";
  const auto& network = map.network();
  std::string text;
  for (size_t i = 0; i < plan.steps.size(); ++i) {
    const Step& step = plan.steps[i];
    const GroundAction& ground = domain.actions[step.action];
    const semantic::Action& action = map.action(ground.action);
    std::vector<std::string> filled;
    for (size_t role = 0; role < action.roles.size(); ++role)
      filled.push_back(fmt::format("{} {}", action.roles[role].name, network.name(ground.objects[role])));
    text += fmt::format("{}. {}({}): drive {:.1f} s, act {:.1f} s\n", i + 1, network.name(ground.action),
                        fmt::join(filled, ", "), static_cast<double>(step.drive_ns) * 1e-9,
                        static_cast<double>(step.action_ns) * 1e-9);
  }
  text += fmt::format("{:.1f} s in all", static_cast<double>(plan.cost_ns) * 1e-9);
  if (plan.verdict == Verdict::best) return text + "; no plan takes less";
  if (plan.bound_ns == 0) return text;
  return text + fmt::format("; none takes less than {:.1f} s", static_cast<double>(plan.bound_ns) * 1e-9);
}

}  // namespace takt::planner
