// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/needs.hpp"

#include <algorithm>

namespace takt::semantic {

Needs::Needs(std::vector<Rule> rules, const NeedParameters& parameters)
    : rules_(std::move(rules)), states_(rules_.size()), parameters_(parameters) {}

bool Needs::is_true(const Rule& rule, const Surroundings& around, double margin_m) {
  if (rule.type.empty()) return around.crossing.value_or(true);
  if (!around.objects) return true;
  return std::any_of(around.objects->begin(), around.objects->end(), [&](const Neighbour& near) {
    return near.type == rule.type && near.distance_m <= rule.within_m + margin_m;
  });
}

void Needs::update(const Surroundings& around, int64_t now_ns) {
  for (size_t i = 0; i < rules_.size(); ++i) {
    State& state = states_[i];
    const bool held = state.needed && state.true_ns;
    if (is_true(rules_[i], around, held ? parameters_.margin_m : 0)) state.true_ns = now_ns;
    state.needed = state.true_ns && now_ns - *state.true_ns <= parameters_.hold_ns;
  }
}

}  // namespace takt::semantic
