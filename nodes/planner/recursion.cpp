// SPDX-License-Identifier: Apache-2.0
#include "nodes/planner/recursion.hpp"

#include <algorithm>
#include <numeric>

namespace takt::planner {

Recursion::Recursion(const RecursionParameters& parameters) : parameters_(parameters) {
  values_.reserve(parameters.variables);
  trail_.reserve(8 * kMostSteps);
  steps_.reserve(kMostSteps);
  open_.reserve(static_cast<size_t>(parameters.depth) + 1);
  cheapest_.resize(static_cast<size_t>(parameters.depth) + 1);
  for (Candidate& candidate : cheapest_) {
    candidate.steps.reserve(kMostSteps);
    candidate.values.reserve(trail_.capacity());
  }
}

Plan Recursion::find(const Domain& domain, const Effort& effort) {
  Plan plan;
  domain_ = &domain;
  effort_ = &effort;
  tried_ = 0;
  gave_up_ = domain.variables.size() > parameters_.variables;
  std::array<Fact, 16> few;
  const bool permute = domain.goals.size() <= std::min(parameters_.orders_up_to, few.size());
  std::array<uint32_t, 16> order;
  std::iota(order.begin(), order.end(), 0);
  const auto last = order.begin() + static_cast<ptrdiff_t>(permute ? domain.goals.size() : 0);
  do {
    if (exhausted()) break;
    trail_.clear();
    back_to({0, 0, 0, 0});
    values_.assign(domain.variables.size(), 0);
    std::span<const Fact> goals = domain.goals;
    if (permute) {
      std::transform(order.begin(), last, few.begin(), [&](uint32_t i) { return domain.goals[i]; });
      goals = std::span(few).first(domain.goals.size());
    }
    if (!achieve(goals, parameters_.depth) || (plan.exists() && plan.cost_ns <= cost_ns_)) continue;
    plan.cost_ns = cost_ns_;
    plan.steps.assign(steps_.begin(), steps_.end());
  } while (std::next_permutation(order.begin(), last));
  // Not finding one proves nothing: the recursion misses plans that exist.
  plan.verdict = plan.exists() ? Verdict::found : Verdict::gave_up;
  plan.expanded = tried_;
  return plan;
}

bool Recursion::exhausted() {
  gave_up_ = gave_up_ || tried_ >= effort_->expansions || (effort_->time_is_up && effort_->time_is_up());
  return gave_up_;
}

void Recursion::set(const Fact& fact) {
  trail_.push_back({fact.variable, values_[fact.variable]});
  values_[fact.variable] = fact.value;
}

void Recursion::back_to(const Mark& mark) {
  for (; trail_.size() > mark.trail; trail_.pop_back()) values_[trail_.back().variable] = trail_.back().before;
  steps_.resize(mark.steps);
  cost_ns_ = mark.cost_ns;
  place_ = mark.place;
}

bool Recursion::achieve(std::span<const Fact> goals, int depth) {
  for (const Fact& goal : goals)
    if (!holds(goal) && !achieve(goal, depth)) return false;
  return std::all_of(goals.begin(), goals.end(), [&](const Fact& goal) { return holds(goal); });
}

bool Recursion::achieve(const Fact& goal, int depth) {
  if (depth == 0 || std::find(open_.begin(), open_.end(), goal) != open_.end()) return false;
  const Mark mark{steps_.size(), trail_.size(), cost_ns_, place_};
  Candidate& best = cheapest_[static_cast<size_t>(depth)];
  bool found = false;
  open_.push_back(goal);
  for (const uint32_t action : domain_->variables[goal.variable].achievers[goal.value]) {
    if (exhausted()) break;
    ++tried_;
    if (achieve(domain_->actions[action].required, depth - 1) && act(action) && (!found || cost_ns_ < best.cost_ns)) {
      found = true;
      best.cost_ns = cost_ns_;
      best.place = place_;
      best.steps.assign(steps_.begin() + static_cast<ptrdiff_t>(mark.steps), steps_.end());
      best.values.clear();
      for (size_t i = mark.trail; i < trail_.size(); ++i)
        best.values.push_back({trail_[i].variable, values_[trail_[i].variable]});
    }
    back_to(mark);
  }
  open_.pop_back();
  if (!found) return false;
  for (const Fact& fact : best.values) set(fact);
  steps_.insert(steps_.end(), best.steps.begin(), best.steps.end());
  cost_ns_ = best.cost_ns;
  place_ = best.place;
  return true;
}

/// False: no room for the step, though its requirements hold.
bool Recursion::act(uint32_t number) {
  const GroundAction& action = domain_->actions[number];
  if (steps_.size() == kMostSteps || trail_.size() + action.results.size() > trail_.capacity()) return false;
  const Step step{number, domain_->drive_ns(place_, action), action.cost_ns};
  steps_.push_back(step);
  cost_ns_ += step.drive_ns + step.action_ns;
  place_ = action.places.back();
  for (const Fact& fact : action.results) set(fact);
  return true;
}

}  // namespace takt::planner
