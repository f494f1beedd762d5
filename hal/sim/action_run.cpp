// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/action_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "hal/sim/random.hpp"
#include "hal/sim/stage.hpp"

namespace takt::sim {
namespace {

constexpr uint64_t kDurationDraw = 0x0B4;
constexpr int64_t kPatienceNs = 500'000'000;  // as long others are waited for

/// A text of a message, also of one that somebody forgot to end.
template <size_t N>
std::string_view text_of(const char (&field)[N]) {
  return {field, strnlen(field, N)};
}

size_t role_index(const WorldAction& action, const std::string& name) {
  const auto role =
      std::find_if(action.roles.begin(), action.roles.end(), [&](const ActionRole& r) { return r.name == name; });
  return static_cast<size_t>(role - action.roles.begin());
}

}  // namespace

/// Why an action is not possible; written without allocation, cut where it gets too long.
struct ActionRun::Reason {
  char text[sizeof ActionOutcome::reason] = {};
  size_t used = 0;

  template <class... Values>
  bool operator()(fmt::format_string<Values...> format, Values&&... values) {
    const size_t room = sizeof text - 1 - used;
    used += std::min(room, fmt::format_to_n(text + used, room, format, std::forward<Values>(values)...).size);
    return false;
  }
  template <class List>
  bool choices(const List& list) {
    for (size_t i = 0; i < list.size(); ++i) (*this)("{}{}", i == 0 ? "; valid are: " : ", ", list[i].name);
    return false;
  }
};

void ActionRun::start(int64_t at_ns, double spread) {
  spread_ = spread;
  waiting_count_ = 0;
  newest_ = 0;
  verdict_ = {};
  settled_ns_.store(at_ns + kLatencyNs - 1, std::memory_order_release);
}

bool ActionRun::understand(const ActionCommand& command, Doing& doing, Reason& reason) const {
  const World& world = stage_.world();
  const std::string_view wanted = text_of(command.action);
  const auto action =
      std::find_if(world.actions.begin(), world.actions.end(), [&](const WorldAction& a) { return a.name == wanted; });
  if (action == world.actions.end()) {
    reason("there is no action `{}`", wanted);
    return reason.choices(world.actions);
  }
  doing.action = &*action;
  for (size_t i = 0; i < std::size(command.objects); ++i) {
    const std::string_view name = text_of(command.objects[i]);
    if (i >= action->roles.size()) {
      if (name.empty()) continue;
      return reason("`{}` has {} roles: `{}` is too much", action->name, action->roles.size(), name);
    }
    const ActionRole& role = action->roles[i];
    const auto object = stage_.states().object(name);
    if (!object) {
      reason("there is no object `{}` to be {} `{}`", name, role.type, role.name);
      return reason.choices(world.objects);
    }
    if (const std::string& type = world.objects[*object].type; type != role.type)
      return reason("`{}` is of type {}, and `{}` of `{}` is {}", name, type, role.name, action->name, role.type);
    const auto end = doing.objects.begin() + static_cast<ptrdiff_t>(i);
    if (std::find(doing.objects.begin(), end, *object) != end) return reason("`{}` has two roles", name);
    doing.objects[i] = *object;
  }
  return true;
}

bool ActionRun::possible(const Doing& doing, int64_t at_ns, Reason& reason) const {
  const WorldAction& action = *doing.action;
  const States& states = stage_.states();
  const int64_t since = at_ns - stage_.epoch_ns();
  const RobotState robot = stage_.robot(robot_).state(at_ns);
  for (size_t i = 0; i < action.roles.size(); ++i) {
    const std::string& name = stage_.world().objects[doing.objects[i]].name;
    const auto placed = stage_.placed(doing.objects[i], at_ns);
    if (!placed) return reason("{} is not here any more", name);
    const double distance = distance_to(*placed, {robot.x_m, robot.y_m});
    if (distance > action.reach_m)
      return reason("{} is {:.2f} m away, and the reach is {:.1f} m", name, distance, action.reach_m);
  }
  for (const RoleCondition& condition : action.pre) {
    const size_t object = doing.objects[role_index(action, condition.role)];
    const ValueId value = states.at(*states.attribute(object, condition.attribute), since);
    const std::string_view is = value == kUnknown ? "unknown" : states.text(value);
    if (value == kUnknown || is != condition.value)
      return reason("{}.{} is {} and not {}", stage_.world().objects[object].name, condition.attribute, is,
                    condition.value);
  }
  return std::all_of(action.moves.begin(), action.moves.end(),
                     [&](const RoleMove& move) { return possible_move(doing, move, at_ns, reason); });
}

/// Nothing can stand on what stands on itself.
bool ActionRun::possible_move(const Doing& doing, const RoleMove& move, int64_t at_ns, Reason& reason) const {
  const size_t target = role_index(*doing.action, move.to),
               object = doing.objects[role_index(*doing.action, move.role)];
  if (target == doing.action->roles.size()) return true;  // carried, or away
  const auto& objects = stage_.world().objects;
  size_t below = doing.objects[target];
  for (size_t depth = 0; depth < objects.size(); ++depth) {
    const Whereabouts& where = stage_.states().whereabouts(below, at_ns - stage_.epoch_ns());
    if (where.kind != Whereabouts::Kind::on) break;
    below = where.index;
    if (below == object) return reason("{} stands on {}", objects[doing.objects[target]].name, objects[object].name);
  }
  return true;
}

void ActionRun::apply(const Doing& doing) {
  const WorldAction& action = *doing.action;
  States& states = stage_.states();
  const int64_t since = doing.end_ns - stage_.epoch_ns();
  for (const RoleCondition& result : action.post) {
    const Variable variable = *states.attribute(doing.objects[role_index(action, result.role)], result.attribute);
    states.change(robot_, variable, {since, states.value(result.value)});
  }
  for (const RoleMove& move : action.moves) {
    const size_t target = role_index(action, move.to);
    const ValueId where = target < action.roles.size() ? states.on(doing.objects[target])
                          : move.to == "robot"         ? states.carried(robot_)
                                                       : states.away();
    states.change(robot_, states.place(doing.objects[role_index(action, move.role)]), {since, where});
  }
}

bool ActionRun::command(const ActionCommand& command, int64_t at_ns) {
  if (command.number == 0 || command.number == newest_) return true;
  Doing doing;
  doing.number = command.number;
  doing.begin_ns = at_ns + kLatencyNs;
  Reason reason;
  const bool understood = understand(command, doing, reason);
  // What ends before the new one begins is let end.
  while (waiting_count_ > 0 && waiting_[waiting_count_ - 1].end_ns > doing.begin_ns) --waiting_count_;
  if (understood && waiting_count_ == waiting_.size()) return false;
  newest_ = doing.number;
  newest_begin_ns_ = doing.begin_ns;
  if (!understood) {
    judge(doing, action_state::refused, at_ns, reason);
    return true;
  }
  doing.end_ns = doing.begin_ns + duration_ns(*doing.action);
  waiting_[waiting_count_++] = doing;
  return true;
}

int64_t ActionRun::duration_ns(const WorldAction& action) const {
  const auto number = static_cast<uint64_t>(&action - stage_.world().actions.data());
  const double share = 2 * uniform(mix(stage_.seed() ^ kDurationDraw, robot_, number)) - 1;
  return std::llround(action.cost_s * (1 + spread_ * share) * 1e9);
}

bool ActionRun::others_settled(int64_t at_ns) const {
  const size_t robots = stage_.world().clients.size();
  for (size_t i = 0; i < robots; ++i) {
    if (!stage_.robot(i).base_settled(at_ns)) return false;
    // At the same instant the first client is first.
    if (i != robot_ && stage_.actions(i).settled_ns() < at_ns - (i < robot_ ? 0 : 1)) return false;
  }
  return true;
}

void ActionRun::advance(int64_t now_ns) {
  const int64_t horizon_ns = now_ns + kLatencyNs;
  while (waiting_count_ > 0) {
    const int64_t next_ns = waiting_[0].next_ns();
    if (next_ns > horizon_ns || (next_ns + kPatienceNs > now_ns && !others_settled(next_ns))) break;
    proceed();
  }
  settled_ns_.store(waiting_count_ > 0 ? std::min(horizon_ns, waiting_[0].end_ns - 1) : horizon_ns,
                    std::memory_order_release);
}

void ActionRun::proceed() {
  Doing& doing = waiting_[0];
  Reason reason;
  const bool possible = this->possible(doing, doing.next_ns(), reason);
  if (possible && !doing.begun) {
    doing.begun = true;
    return;
  }
  if (possible) apply(doing);
  judge(doing,
        possible       ? action_state::done
        : !doing.begun ? action_state::refused
                       : action_state::failed,
        doing.next_ns(), reason);
  std::move(waiting_.begin() + 1, waiting_.begin() + static_cast<ptrdiff_t>(waiting_count_), waiting_.begin());
  --waiting_count_;
}

void ActionRun::judge(const Doing& doing, uint8_t state, int64_t at_ns, const Reason& reason) {
  if (doing.number != newest_) return;
  verdict_ = {doing.number, state, at_ns, {}};
  std::memcpy(verdict_.reason, reason.text, sizeof verdict_.reason);
}

ActionOutcome ActionRun::outcome(int64_t at_ns) const {
  ActionOutcome outcome;
  outcome.number = newest_;
  if (newest_ == 0) return outcome;
  const bool over = verdict_.number == newest_ && verdict_.at_ns <= at_ns;
  outcome.state = over ? verdict_.state : action_state::under_way;
  const int64_t until_ns = over ? verdict_.at_ns : at_ns;
  outcome.duration_s = static_cast<double>(std::max<int64_t>(0, until_ns - newest_begin_ns_)) * 1e-9;
  if (over) std::memcpy(outcome.reason, verdict_.reason, sizeof outcome.reason);
  return outcome;
}

}  // namespace takt::sim
