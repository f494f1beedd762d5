// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/mode_rules.hpp"

namespace takt {
namespace {

bool covers(const ModeRule& rule, SourceSet lost) { return (lost & ~rule.covers) == 0; }

/// Some rule says that this mode can do without all of them.
bool mode_covers(const ModeRules& rules, size_t mode, SourceSet lost) {
  for (const ModeRule& rule : rules.rules)
    if (rule.mode == mode && covers(rule, lost)) return true;
  return false;
}

}  // namespace

size_t mode_without(const ModeRules& rules, SourceSet lost, size_t safe_stop) {
  for (const ModeRule& rule : rules.rules)
    if (rule.mode != ModeRule::kUnreachable && covers(rule, lost)) return rule.mode;
  return safe_stop;
}

std::optional<size_t> change_of_mode(const ModeRules& rules, SourceSet lost, bool newly_lost, const ModeInForce& now,
                                     size_t safe_stop) {
  const bool by_rule = now.origin == ModeOrigin::rule;
  if (!by_rule && (!newly_lost || now.mode == safe_stop)) return std::nullopt;
  size_t wanted = now.before;
  // What the mode of before can do without needs no other mode: it may have been asked for because of that.
  if (lost != 0 && !mode_covers(rules, now.before, lost)) wanted = mode_without(rules, lost, safe_stop);
  if (wanted == now.mode) return std::nullopt;
  return wanted;
}

}  // namespace takt
