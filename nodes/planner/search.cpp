// SPDX-License-Identifier: Apache-2.0
#include "nodes/planner/search.hpp"

#include <algorithm>
#include <bit>

namespace takt::planner {
namespace {

constexpr int64_t kNoLimit = std::numeric_limits<int64_t>::max();

uint64_t mixed(uint64_t h, uint64_t word) {
  h = (h ^ word) * 0x9E3779B97F4A7C15ULL;  // golden ratio
  return h ^ (h >> 29);
}

/// Value 0 is that of the beginning.
bool open_at_first(const Fact& goal) { return goal.value != 0; }

uint64_t hash_of(std::span<const Fact> changes, uint32_t place) {
  uint64_t h = mixed(0, place);
  for (const Fact& fact : changes) h = mixed(h, uint64_t{fact.variable} << 32 | fact.value);
  return h;
}

}  // namespace

Search::Search(const SearchCapacity& capacity)
    : capacity_(capacity), slots_(std::bit_ceil(2 * capacity.states)), open_(capacity.states) {
  states_.reserve(capacity.states);
  changes_.reserve(capacity.changes);
  worth_.reserve(capacity.actions);
  goal_ns_.reserve(kMostSteps);
}

/// Whatever else a plan does, it drives to an action's objects and to those of the goals, and acts for both.
void Search::find_worthwhile() {
  worth_.clear();
  full_ = domain_->actions.size() > capacity_.actions;
  int64_t goals_ns = 0;
  for (size_t i = 0; i < goal_ns_.size(); ++i)
    if (open_at_first(domain_->goals[i])) goals_ns += std::max<int64_t>(0, goal_ns_[i]);
  for (uint32_t number = 0; number < domain_->actions.size() && !full_; ++number) {
    const GroundAction& action = domain_->actions[number];
    const bool gives_goal = std::any_of(action.results.begin(), action.results.end(), [&](const Fact& fact) {
      return open_at_first(fact) &&
             std::find(domain_->goals.begin(), domain_->goals.end(), fact) != domain_->goals.end();
    });
    const int64_t own_ns = fixed_ns(action);
    const int64_t actions_ns = gives_goal ? std::max(own_ns, goals_ns) : own_ns + goals_ns;
    if (actions_ns + way_ns(action) < limit_ns_) worth_.push_back(number);
  }
}

/// At least so long is a way by an object of the action and one of a goal, in either order.
int64_t Search::way_ns(const GroundAction& action) const {
  if (domain_->cost_mode == CostMode::faithful) return 0;
  int64_t longest = 0;
  for (const uint32_t place : action.places) {
    const int64_t there = domain_->travel_ns(0, place);
    longest = std::max(longest, there);
    for (size_t i = 0; i < domain_->goals.size(); ++i) {
      const uint32_t goal = domain_->goal_places[i];
      if (open_at_first(domain_->goals[i]))
        longest = std::max(longest, std::min(there + domain_->travel_ns(place, goal),
                                             domain_->travel_ns(0, goal) + domain_->travel_ns(goal, place)));
    }
  }
  return std::max<int64_t>(0, longest - 2 * kTravelSlack_ns);
}

/// What an action costs wherever the robot is: driving depends on that only if it is counted in sequence.
int64_t Search::fixed_ns(const GroundAction& action) const {
  return action.cost_ns + (domain_->cost_mode == CostMode::faithful ? domain_->drive_ns(0, action) : 0);
}

/// What each goal costs at least: its cheapest action, whose cost it shares with the other goals that this one gives.
void Search::prepare() {
  goal_ns_.clear();
  for (const Fact& goal : domain_->goals) {
    int64_t least = -1;
    for (const uint32_t number : domain_->variables[goal.variable].achievers[goal.value]) {
      const GroundAction& action = domain_->actions[number];
      const auto shared = std::count_if(domain_->goals.begin(), domain_->goals.end(), [&](const Fact& g) {
        return std::find(action.results.begin(), action.results.end(), g) != action.results.end();
      });
      const int64_t share = fixed_ns(action) / shared;
      if (least < 0 || share < least) least = share;
    }
    goal_ns_.push_back(least);
  }
  states_.clear();
  changes_.clear();
  std::fill(slots_.begin(), slots_.end(), kNone);
  open_.clear();
  find_worthwhile();
}

bool Search::holds(std::span<const Fact> changes, const Fact& fact) const {
  const auto at = std::lower_bound(changes.begin(), changes.end(), fact.variable,
                                   [](const Fact& f, uint32_t variable) { return f.variable < variable; });
  return (at != changes.end() && at->variable == fact.variable ? at->value : 0) == fact.value;
}

std::optional<int64_t> Search::left_ns(std::span<const Fact> changes, uint32_t place) const {
  int64_t sum = 0, farthest = 0;
  for (size_t i = 0; i < domain_->goals.size(); ++i) {
    if (holds(changes, domain_->goals[i])) continue;
    if (goal_ns_[i] < 0) return std::nullopt;
    sum += goal_ns_[i];
    if (domain_->cost_mode == CostMode::sequential)
      farthest = std::max(farthest, domain_->travel_ns(place, domain_->goal_places[i]) - kTravelSlack_ns);
  }
  return sum + farthest;
}

bool Search::write_successor(uint32_t from, const GroundAction& action) {
  const auto old = changes(states_[from]);
  if (changes_.size() + old.size() + action.results.size() > capacity_.changes) return false;
  auto result = action.results.begin();
  for (const Fact& fact : old) {
    for (; result != action.results.end() && result->variable < fact.variable; ++result)
      if (result->value != 0) changes_.push_back(*result);
    if (result == action.results.end() || result->variable != fact.variable) changes_.push_back(fact);
  }
  // Those that replace an old change are passed over by the loop above, in their order.
  for (; result != action.results.end(); ++result)
    if (result->value != 0) changes_.push_back(*result);
  return true;
}

uint32_t& Search::slot_of(const State& state) {
  const size_t mask = slots_.size() - 1;
  for (size_t at = state.hash & mask;; at = (at + 1) & mask) {
    uint32_t& slot = slots_[at];
    if (slot == kNone) return slot;
    const State& other = states_[slot];
    const auto a = changes(state), b = changes(other);
    if (other.hash == state.hash && other.place == state.place && std::equal(a.begin(), a.end(), b.begin(), b.end()))
      return slot;
  }
}

void Search::expand(uint32_t from) {
  for (size_t i = 0; i < worth_.size() && !full_; ++i) {
    const uint32_t number = worth_[i];
    const GroundAction& action = domain_->actions[number];
    const auto before = changes(states_[from]);
    if (!std::all_of(action.required.begin(), action.required.end(),
                     [&](const Fact& fact) { return holds(before, fact); }))
      continue;
    State next = states_[from];
    next.cost_ns += domain_->drive_ns(next.place, action) + action.cost_ns;
    if (next.cost_ns >= limit_ns_) continue;
    next.from = from;
    next.action = number;
    next.place = action.places.back();
    next.first = static_cast<uint32_t>(changes_.size());
    full_ = !write_successor(from, action);
    if (full_) return;
    next.count = static_cast<uint32_t>(changes_.size()) - next.first;
    const auto after = changes(next);
    const auto left = left_ns(after, next.place);
    bool kept = false;
    // An action that changes nothing would only be a detour.
    if (left && next.cost_ns + *left < limit_ns_ &&
        !std::equal(before.begin(), before.end(), after.begin(), after.end())) {
      next.hash = hash_of(after, next.place);
      uint32_t& slot = slot_of(next);
      kept = slot == kNone;
      full_ = kept && states_.size() == capacity_.states;
      if (kept && !full_) {
        slot = static_cast<uint32_t>(states_.size());
        states_.push_back(next);
      }
      kept = kept && !full_;
      if (kept || (!full_ && next.cost_ns < states_[slot].cost_ns)) {
        State& state = states_[slot];
        state.cost_ns = next.cost_ns;
        state.from = from;
        state.action = number;
        open_.put(slot, {next.cost_ns + *left, -next.cost_ns});
      }
    }
    if (!kept) changes_.resize(next.first);
  }
}

void Search::begin(const Domain& domain, const Plan& known) {
  domain_ = &domain;
  limit_ns_ = known.exists() ? known.cost_ns : kNoLimit;
  prepare();
  plan_ = known;
  plan_.bound_ns = 0;
  plan_.expanded = 0;
  const State begin{0, hash_of({}, 0), kNone, kNone, 0, 0, 0};
  states_.push_back(begin);
  slot_of(begin) = 0;
  if (const auto left = left_ns({}, 0); left && *left < limit_ns_) open_.put(0, {*left, 0});
}

void Search::remember(StateArchive& archive, const Domain& domain) {
  TAKT_STATE(archive, open_, limit_ns_, full_, plan_);
  archive.room(kMostSteps * sizeof(Step) + capacity_.states * sizeof(State) + capacity_.changes * sizeof(Fact) +
               capacity_.actions * sizeof(uint32_t) + goal_ns_.capacity() * sizeof(int64_t));
  if (archive.loads()) domain_ = &domain;
  if (open_.empty() || archive.failed()) return;
  TAKT_STATE(archive, states_, changes_, worth_, goal_ns_);
  if (!archive.loads() || archive.failed()) return;
  std::fill(slots_.begin(), slots_.end(), kNone);
  if (states_.size() > capacity_.states || changes_.size() > capacity_.changes) return archive.fail();
  for (uint32_t number = 0; number < states_.size(); ++number) {
    const State& state = states_[number];
    if (state.count > changes_.size() || state.first > changes_.size() - state.count) return archive.fail();
    slot_of(state) = number;
  }
}

bool Search::go_on(const Effort& effort) {
  for (size_t expanded = 0; !open_.empty(); ++expanded) {
    plan_.bound_ns = std::max(plan_.bound_ns, open_.least().first);
    const bool early = full_ || expanded >= effort.expansions || (effort.time_is_up && effort.time_is_up());
    if (early) {
      plan_.verdict = plan_.exists() ? Verdict::found : Verdict::gave_up;
      return full_;
    }
    const uint32_t number = open_.take_least();
    ++plan_.expanded;
    const auto now = changes(states_[number]);
    if (std::all_of(domain_->goals.begin(), domain_->goals.end(), [&](const Fact& goal) { return holds(now, goal); })) {
      plan_.verdict = Verdict::best;
      plan_.bound_ns = plan_.cost_ns = states_[number].cost_ns;
      write_steps(number, plan_);
      open_.clear();
      return true;
    }
    expand(number);
    if (full_) open_.put(number, {plan_.bound_ns, 0});  // not expanded wholly: the bound stays
  }
  plan_.verdict = plan_.exists() ? Verdict::best : Verdict::none;
  if (plan_.exists()) plan_.bound_ns = plan_.cost_ns;
  return true;
}

void Search::write_steps(uint32_t end, Plan& plan) const {
  plan.steps.clear();
  for (uint32_t at = end; states_[at].from != kNone; at = states_[at].from) {
    const GroundAction& action = domain_->actions[states_[at].action];
    plan.steps.push_back(
        {states_[at].action, domain_->drive_ns(states_[states_[at].from].place, action), action.cost_ns});
  }
  std::reverse(plan.steps.begin(), plan.steps.end());
}

}  // namespace takt::planner
