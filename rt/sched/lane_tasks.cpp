// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/lane_tasks.hpp"

#include <algorithm>
#include <numeric>

#include "rt/node.hpp"
#include "rt/sched/analysis/integers.hpp"
#include "rt/sched/analysis/partition.hpp"
#include "rt/sched/lane.hpp"
#include "rt/sched/watch_rules.hpp"

namespace takt {
namespace {

using analysis::Overheads;
using analysis::Ticks;
using analysis::Wide;

constexpr Wide kSecond = 1'000'000'000;

/// The longest time that the plan states, ns.
int64_t longest_ns(const Plan& plan) {
  int64_t longest = 0;
  for (const TaskPlan& task : plan.tasks) {
    const int64_t period =
        task.rate ? static_cast<int64_t>(Wide{task.rate->denominator} * kSecond / task.rate->numerator) : 0;
    longest = std::max({longest, period, task.offset_ns, task.deadline_ns, task.budget_ns, task.min_interval_ns});
  }
  return longest;
}

/// Ticks to a nanosecond that make every period whole; 1 where that is too fine: periods are then rounded down.
int64_t ticks_per_ns(const Plan& plan, const std::vector<std::vector<size_t>>& lanes) {
  // With room for sums of a few of the plan's times.
  const int64_t finest =
      std::clamp<int64_t>(analysis::kLongest / 8 / std::max<int64_t>(longest_ns(plan), 1), 1, 1'000'000);
  int64_t ticks = 1;
  for (const auto& lane : lanes) {
    const Rate& rate = *plan.tasks[lane.front()].rate;
    const auto whole = static_cast<int64_t>(Wide{rate.denominator} * kSecond % rate.numerator);
    const int64_t needed = rate.numerator / std::gcd(whole, rate.numerator);
    ticks = std::lcm(ticks, needed);
    if (ticks > finest) return 1;
  }
  return ticks;
}

int64_t port_bytes(const PortPlan& port) {
  return port.type == nullptr ? 0 : static_cast<int64_t>(port.message_bytes());
}

/// What the runtime adds to one job of a task.
int64_t transport_ns(const Plan& plan, const TaskPlan& task, const Overheads& o) {
  int64_t bytes = 0;
  for (const EdgePlan& edge : task.edges) bytes += port_bytes(plan.ports[edge.port]) * edge.depth;
  for (const size_t port : task.ports) bytes += port_bytes(plan.ports[port]);
  return o.take_ns * static_cast<int64_t>(task.edges.size()) + o.publish_ns * static_cast<int64_t>(task.ports.size()) +
         static_cast<int64_t>(static_cast<double>(o.per_mb_ns) * static_cast<double>(bytes) * 1e-6);
}

/// What a member costs: a quarter of its deadline where no budget is stated, as the executor reserves.
int64_t member_ns(const Plan& plan, size_t t, const Overheads& o) {
  return lane_budget_ns(plan, {t}) + transport_ns(plan, plan.tasks[t], o);
}

/// The whole of a pass.
int64_t pass_ns(const Plan& plan, const std::vector<size_t>& lane, const Overheads& o) {
  std::vector<size_t> members(lane.size());
  std::iota(members.begin(), members.end(), size_t{0});
  return (lane_wait_ns(plan, lane) > 0 ? 2 : 1) * begin_ns(o) + occupied_ns(plan, lane, members, o);
}

/// All lanes as they are under `fixed`, not placed yet and without leads.
LaneTasks unplaced(const Plan& plan, const Overheads& o) {
  LaneTasks result;
  result.lanes = lane_members(plan);
  result.looks_ns.resize(result.lanes.size(), 0);
  result.set.cores = static_cast<int>(std::max<size_t>(plan.cores.size(), 1));
  const int64_t ticks = result.set.ticks_per_ns = ticks_per_ns(plan, result.lanes);
  for (const auto& lane : result.lanes) {
    const TaskPlan& head = plan.tasks[lane.front()];
    analysis::TimedTask task;
    task.name = head.name;
    task.period = static_cast<Ticks>(Wide{head.rate->denominator} * kSecond * ticks / head.rate->numerator);
    task.deadline = std::min(task.period, lane_span_ns(plan, lane) * ticks);
    task.budget = pass_ns(plan, lane, o) * ticks;
    task.offset = head.offset_ns * ticks;
    task.jitter = lane_wait_ns(plan, lane) * ticks;
    result.set.tasks.push_back(std::move(task));
  }
  return result;
}

/// A worker awake before its release takes the CPU from others as if its job arrived the longest lead earlier and
/// needed that much more (cooperative workers are awake early only while they have nothing else to do). Under `fixed`
/// no job ends later than that: what a shorter lead leaves free, it leaves to the same job. Under `deadline` the kernel
/// counts a deadline from the wake-up, and the leads of two lanes may differ by the longest one: what is proved is the
/// deadline less that.
void charge_leads(const Plan& plan, Policy policy, LaneTasks& lanes) {
  for (size_t i = 0; i < lanes.lanes.size(); ++i) {
    analysis::TimedTask& task = lanes.set.tasks[i];
    const Ticks lead = longest_lead_ns(plan, lanes.lanes[i]) * lanes.set.ticks_per_ns;
    task.budget += lead;
    if (policy == Policy::deadline) task.deadline -= lead;
  }
}

/// The share of ordinary threads on each core. The kernel gives it up to a millisecond early (dl_server_min_res).
void add_ordinary(const Overheads& o, analysis::TaskSet& set) {
  if (o.ordinary_runtime_ns <= 0 || o.ordinary_period_ns <= o.ordinary_runtime_ns) return;
  constexpr int64_t kEarly_ns = 1'000'000;
  for (int core = 0; core < set.cores; ++core) {
    analysis::TimedTask share;
    share.name = "ordinary threads";
    share.period = share.deadline = o.ordinary_period_ns * set.ticks_per_ns;
    share.budget = std::min(o.ordinary_runtime_ns + kEarly_ns, o.ordinary_period_ns) * set.ticks_per_ns;
    share.sporadic = share.deferrable = true;
    share.core = core;
    set.tasks.push_back(std::move(share));
  }
}

/// In deadline monotonic order nobody behind has a shorter lead, so that his own covers how much earlier than released
/// one of those before him may begin. In another order the rest of that is charged once, as blocking. `order`: the
/// tasks of a core, the highest priority first.
void charge_longer_leads(const Plan& plan, const LaneTasks& lanes, const std::vector<size_t>& order,
                         analysis::TaskSet& set) {
  int64_t longest_ns = 0;
  for (const size_t i : order) {
    if (i >= lanes.lanes.size()) continue;  // ordinary threads
    const int64_t lead_ns = longest_lead_ns(plan, lanes.lanes[i]);
    longest_ns = std::max(longest_ns, lead_ns);
    set.tasks[i].blocking = (longest_ns - lead_ns) * set.ticks_per_ns;
  }
}

/// The tasks of a core, the highest priority first.
std::vector<size_t> of_core_from_top(const analysis::TaskSet& set, int core) {
  std::vector<size_t> indexes;
  for (size_t i = 0; i < set.tasks.size(); ++i)
    if (set.tasks[i].core == core) indexes.push_back(i);
  std::sort(indexes.begin(), indexes.end(),
            [&](size_t a, size_t b) { return set.tasks[a].priority > set.tasks[b].priority; });
  return indexes;
}

/// Of a core's tasks, `indexes` in the set from the top, the lanes of high criticality come first. Deadline monotonic
/// order within them and within the others stays.
void put_high_first(const Plan& plan, const LaneTasks& lanes, std::vector<size_t> indexes, analysis::TaskSet& set) {
  std::vector<int> priorities;
  for (const size_t i : indexes) priorities.push_back(set.tasks[i].priority);
  std::stable_partition(indexes.begin(), indexes.end(),
                        [&](size_t i) { return i < lanes.lanes.size() && any_high(plan, lanes.lanes[i]); });
  for (size_t k = 0; k < indexes.size(); ++k) set.tasks[indexes[k]].priority = priorities[k];
  charge_longer_leads(plan, lanes, indexes, set);
}

/// Criticality decides who yields: a node that overruns its budget is stopped late, and an overload that nobody
/// admitted is not stopped at all. So the high ones go first on each core, unless the others would miss deadlines then
/// that they meet in plain deadline monotonic order.
void let_criticality_decide(const Plan& plan, LaneTasks& lanes) {
  const auto verdict = [](const analysis::TaskSet& set, const std::vector<size_t>& indexes) {
    std::vector<analysis::TimedTask> tasks;
    for (const size_t i : indexes) tasks.push_back(set.tasks[i]);
    return analysis::core_verdict(tasks, analysis::CorePolicy::fixed_priority);
  };
  for (int core = 0; core < lanes.set.cores; ++core) {
    const std::vector<size_t> indexes = of_core_from_top(lanes.set, core);
    analysis::TaskSet high_first = lanes.set;
    put_high_first(plan, lanes, indexes, high_first);
    if (verdict(high_first, indexes) == analysis::Verdict::schedulable ||
        verdict(lanes.set, indexes) != analysis::Verdict::schedulable)
      lanes.set = std::move(high_first);
  }
}

/// The order on each core as SCHED_FIFO priorities. What no thread stands for takes none.
void number_priorities(LaneTasks& lanes) {
  for (int core = 0; core < lanes.set.cores; ++core) {
    int next = kHighestPriority - 1;
    for (const size_t i : of_core_from_top(lanes.set, core)) {
      const bool lane = i < lanes.lanes.size();
      lanes.set.tasks[i].priority = std::max(next, kLowestPriority + kLaneStep) + (lane ? 0 : 1);
      if (lane) next -= kLaneStep;
    }
  }
}

/// Members whose budgets a watchdog minds under `fixed`.
int64_t minded_members(const Plan& plan, const std::vector<size_t>& lane) {
  return std::count_if(lane.begin(), lane.end(),
                       [&](size_t t) { return watch_rules(plan.tasks[t], Policy::fixed, 0).minds_overrun(); });
}

/// What goes before a lane on its core: a task of the set, how often each of its arrivals may preempt the lane, and the
/// looks that come with it.
struct Above {
  size_t task = 0;
  int64_t times = 1, looks = 0;
};

/// Looks in one pass while a member runs that is not minded, or the lane waits for an instant: another member may begin
/// any moment.
int64_t looks_between_jobs(const Plan& plan, const LaneTasks& lanes, size_t l) {
  int64_t least_ns = INT64_MAX, others_ns = 0, waits_ns = 0;
  for (const size_t t : lanes.lanes[l]) {
    const WatchRules rules = watch_rules(plan.tasks[t], Policy::fixed, 0);
    if (rules.minds_overrun()) least_ns = std::min(least_ns, rules.budget_ns);
    else others_ns += rules.budget_ns;
    const size_t producer = plan.tasks[t].on_task;
    const bool waits = producer != kNone && plan.tasks[producer].publish == PublishAt::let;
    if (waits) waits_ns = lanes.set.tasks[l].period / lanes.set.ticks_per_ns;
  }
  const int64_t sum_ns = others_ns + waits_ns;
  return sum_ns / std::max(least_ns, kWatchGrain_ns) + (sum_ns > 0 ? 1 : 0);
}

/// Looks of a lane's own watchdog in one pass.
int64_t looks_of_pass(const Plan& plan, const Overheads& o, const LaneTasks& lanes, size_t l,
                      const std::vector<Above>& above) {
  int64_t preemptions = 0, looks = 0;
  for (const Above& one : above) {
    const analysis::TimedTask& task = lanes.set.tasks[one.task];
    const int64_t arrivals = (lanes.set.tasks[l].period - 1) / task.period + (task.sporadic ? 2 : 1);
    preemptions += one.times * arrivals;
    looks += one.looks * arrivals;
  }
  return most_looks(preemptions, looks * o.look_ns) + (minded_members(plan, lanes.lanes[l]) - 1) * most_looks(0, 0) +
         looks_between_jobs(plan, lanes, l);
}

/// The watchdogs of the processes, which go before all lanes of any core: one look for a heartbeat and one at the end
/// of a patience each, and one at each deadline that leads to safe_stop.
Above add_process_watchdogs(const Plan& plan, const Overheads& o, int core, LaneTasks& lanes) {
  analysis::TimedTask watchdogs;
  watchdogs.name = "watchdog";
  watchdogs.sporadic = true;
  watchdogs.period = kHeartbeat_ns * lanes.set.ticks_per_ns;
  int64_t looks = 2 * plan.processes;
  for (size_t l = 0; l < lanes.lanes.size(); ++l)
    for (const size_t t : lanes.lanes[l]) {
      if (plan.tasks[t].on_miss != OnMiss::safe_stop) continue;
      ++looks;
      watchdogs.period = std::min(watchdogs.period, lanes.set.tasks[l].period);
    }
  watchdogs.deadline = watchdogs.period;
  watchdogs.budget = std::min(looks * o.look_ns * lanes.set.ticks_per_ns, watchdogs.period);
  watchdogs.priority = kHighestPriority + 1;
  watchdogs.core = core;
  lanes.set.tasks.push_back(std::move(watchdogs));
  return {lanes.set.tasks.size() - 1, 0, looks};
}

/// What the watchdogs take from whom. A lane's own one goes just above the lane: its looks delay that lane and those
/// below, as if the lane did them itself. Lanes above it are only held up by its timer's interrupt, once each time they
/// are busy: it sets no timer before it has run.
void charge_looks(const Plan& plan, const Overheads& o, int core, LaneTasks& lanes) {
  std::vector<size_t> order = of_core_from_top(lanes.set, core);
  int64_t watched_below = 0;
  for (const size_t i : order) watched_below += i < lanes.lanes.size() && minded_members(plan, lanes.lanes[i]) > 0;
  std::vector<Above> above{add_process_watchdogs(plan, o, core, lanes)};
  for (const size_t i : order) {
    if (i >= lanes.lanes.size()) {  // ordinary threads, in one go
      above.push_back({i});
      continue;
    }
    analysis::TimedTask& task = lanes.set.tasks[i];
    const bool watched = minded_members(plan, lanes.lanes[i]) > 0;
    if (watched) {
      --watched_below;
      lanes.looks_ns[i] = looks_of_pass(plan, o, lanes, i, above) * o.look_ns;
      task.budget += lanes.looks_ns[i] * lanes.set.ticks_per_ns;
    }
    task.blocking += watched_below * o.look_ns * lanes.set.ticks_per_ns;
    // A member that waits for an instant lets others run, and a watchdog may find its lane idle.
    const int64_t idle_looks = watched ? 1 + looks_between_jobs(plan, lanes, i) : 0;
    above.push_back({i, static_cast<int64_t>(lanes.lanes[i].size()), idle_looks});
  }
}

/// Cores and priorities under `fixed`.
void place(const Plan& plan, LaneTasks& lanes) {
  analysis::TaskSet& set = lanes.set;
  for (size_t i = 0; i < lanes.lanes.size(); ++i) {
    const auto named = std::find(plan.cores.begin(), plan.cores.end(), plan.tasks[lanes.lanes[i].front()].core);
    set.tasks[i].core = named == plan.cores.end() ? -1 : static_cast<int>(named - plan.cores.begin());
  }
  assign_deadline_monotonic(set);
  set = partition(set, set.cores, analysis::CorePolicy::fixed_priority).set;
  std::vector<double> work(static_cast<size_t>(set.cores), 0.0);
  for (const bool rest : {false, true}) {
    for (analysis::TimedTask& task : set.tasks) {
      if (rest != (task.core < 0)) continue;
      if (rest) task.core = static_cast<int>(std::min_element(work.begin(), work.end()) - work.begin());
      work[static_cast<size_t>(task.core)] += static_cast<double>(task.budget) / static_cast<double>(task.period);
    }
  }
  let_criticality_decide(plan, lanes);
  number_priorities(lanes);
}

}  // namespace

bool any_high(const Plan& plan, std::span<const size_t> tasks) {
  return std::any_of(tasks.begin(), tasks.end(),
                     [&](size_t t) { return plan.tasks[t].criticality == Criticality::high; });
}

LaneTasks lane_tasks(const Plan& plan, Policy policy, const Overheads& overheads) {
  LaneTasks result = unplaced(plan, overheads);
  if (policy == Policy::deadline) {
    const std::vector<Reservation> reserved = reservations(plan, policy);
    for (size_t i = 0; i < result.lanes.size(); ++i) {
      analysis::TimedTask& task = result.set.tasks[i];
      task.deadline = std::min(task.deadline, reserved[i].deadline_ns * result.set.ticks_per_ns);
      if (task.jitter == 0) continue;
      task.period = reserved[i].period_ns * result.set.ticks_per_ns;
      task.sporadic = true;
      task.offset = task.jitter = 0;
    }
  }
  if (policy != Policy::cooperative) charge_leads(plan, policy, result);
  if (policy == Policy::fixed) {
    add_ordinary(overheads, result.set);
    place(plan, result);
    for (int core = 0; core < result.set.cores && overheads.look_ns > 0; ++core)
      charge_looks(plan, overheads, core, result);
  }
  return result;
}

int64_t occupied_ns(const Plan& plan, const std::vector<size_t>& lane, std::span<const size_t> members,
                    const Overheads& overheads) {
  int64_t at = 0;
  std::vector<int64_t> visible(lane.size(), 0);
  for (size_t k = 0; k < members.size(); ++k) {
    const TaskPlan& task = plan.tasks[lane[members[k]]];
    const auto before = members.first(k);
    const auto producer = std::find_if(before.begin(), before.end(), [&](size_t m) { return lane[m] == task.on_task; });
    const int64_t release = producer == before.end() ? 0 : visible[*producer];
    at = std::max(at, release) + member_ns(plan, lane[members[k]], overheads);
    visible[members[k]] = task.publish == PublishAt::let ? std::max(at, release + task.deadline_ns) : at;
  }
  return at;
}

std::vector<Reservation> reservations(const Plan& plan, Policy policy) {
  const std::vector<std::vector<size_t>> lanes = lane_members(plan);
  std::vector<Reservation> wanted(lanes.size());
  const LaneTasks placed = policy == Policy::fixed ? lane_tasks(plan, policy, plan.overheads) : LaneTasks{};
  for (size_t i = 0; i < lanes.size(); ++i) {
    const int64_t budget_ns = lane_budget_ns(plan, lanes[i]) + longest_lead_ns(plan, lanes[i]);
    if (policy == Policy::deadline) {
      const int64_t awake_ns = std::max(lane_span_ns(plan, lanes[i]) - lane_wait_ns(plan, lanes[i]), budget_ns);
      wanted[i] = deadline_reservation(budget_ns, awake_ns, plan.tasks[lanes[i].front()].rate->period_ns());
      wanted[i].reclaims = any_high(plan, lanes[i]);
    }
    wanted[i].policy = policy;
    if (policy != Policy::fixed) continue;
    const analysis::TimedTask& task = placed.set.tasks[i];
    wanted[i].priority = task.priority;
    wanted[i].core = plan.cores.empty() ? -1 : plan.cores[static_cast<size_t>(task.core)];
  }
  return wanted;
}

}  // namespace takt
