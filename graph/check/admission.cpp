// SPDX-License-Identifier: Apache-2.0
#include "graph/check/admission.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "rt/sched/lane.hpp"
#include "rt/sched/lane_tasks.hpp"
#include "rt/sched/watch_rules.hpp"

namespace takt::graph {
namespace {

using analysis::Overheads;
using analysis::Ticks;

double ms(int64_t ns) { return static_cast<double>(ns) / 1e6; }

/// What no schedule can do, task by task and together.
std::vector<std::string> impossible(const Plan& plan) {
  constexpr double kRounding = 1e-9;  // a sum of shares may miss the whole by this much
  std::vector<std::string> reasons;
  double all = 0;
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const TaskPlan& task = plan.tasks[t];
    const double rate = effective_rate_hz(plan, t), share = static_cast<double>(task.budget_ns) * 1e-9 * rate;
    all += share;
    if (task.deadline_ns > 0 && task.budget_ns > task.deadline_ns)
      reasons.push_back(
          fmt::format("{}: its budget of {} ms is above its deadline of {} ms; give it a deadline from {} ms "
                      "on or a smaller budget",
                      task.name, ms(task.budget_ns), ms(task.deadline_ns), ms(task.budget_ns)));
    else if (share > 1 + kRounding)
      reasons.push_back(
          fmt::format("{}: its budget of {} ms at {:.4g} Hz is more than one core, and a job runs on one; at "
                      "most {:.4g} Hz would fit",
                      task.name, ms(task.budget_ns), rate, 1e9 / static_cast<double>(task.budget_ns)));
  }
  const size_t cores = std::max<size_t>(plan.cores.size(), 1);
  if (all > static_cast<double>(cores) + kRounding)
    reasons.push_back(
        fmt::format("budgets ask for {:.2f} of {} core{}; lower rates or budgets", all, cores, cores == 1 ? "" : "s"));
  return reasons;
}

class Admitting {
 public:
  Admitting(const Plan& plan, const Overheads& overheads, bool bounds)
      : plan_(plan), overheads_(overheads), bounds_(bounds), lanes_(lane_tasks(plan, plan.policy, overheads)) {
    result_.nodes.resize(plan.tasks.size());
  }

  Admission run() {
    result_.answer = Answer::admitted;
    for (const auto& [low, high] : low_before_high(plan_))
      result_.notes.push_back(
          fmt::format("{} (low criticality) runs on the worker of {} (high), which waits for it: a job of it that does "
                      "not end would "
                      "stop both; give {} a `rate`, or `criticality: high`",
                      plan_.tasks[low].name, plan_.tasks[high].name, plan_.tasks[low].name));
    for (std::string& reason : impossible(plan_)) refuse(Answer::infeasible, std::move(reason));
    if (result_.answer == Answer::infeasible) return std::move(result_);
    for (const TaskPlan& task : plan_.tasks)
      if (task.budget_ns == 0)
        refuse(Answer::not_proven,
               fmt::format("{}: no budget stated; give it one (`takt profile` measures it)", task.name));
    ask_kernel();
    const bool followers = lanes_.lanes.size() < plan_.tasks.size();
    whole_ = analyse_set(lanes_.set, plan_.policy, bounds_ || followers);
    result_.by = whole_.by;
    if (whole_.answer != Answer::admitted) {
      refuse(whole_.answer, whole_.why);
      return std::move(result_);
    }
    for (size_t l = 0; l < lanes_.lanes.size(); ++l) judge_members(l);
    ask_about_overruns();
    return std::move(result_);
  }

 private:
  int64_t ns(Ticks ticks) const { return (ticks + lanes_.set.ticks_per_ns - 1) / lanes_.set.ticks_per_ns; }

  void refuse(Answer answer, std::string reason) {
    if (result_.answer != Answer::infeasible) result_.answer = answer;
    result_.reasons.push_back(std::move(reason));
  }

  /// The kernel's own admission, with the figures that the executor reserves.
  void ask_kernel() {
    if (plan_.policy != Policy::deadline || overheads_.deadline_bandwidth <= 0) return;
    double sum = 0;
    for (const Reservation& r : reservations(plan_, plan_.policy))
      sum += static_cast<double>(r.runtime_ns) / static_cast<double>(r.period_ns);
    constexpr double kKernelStep = 1.0 / (1 << 20);  // it counts bandwidth in these
    if (sum > overheads_.deadline_bandwidth + kKernelStep)
      refuse(Answer::infeasible, fmt::format("the reservations add up to {:.3f} cores, and the kernel gives {:.3f} to "
                                             "SCHED_DEADLINE; a budget counts over its deadline there",
                                             sum, overheads_.deadline_bandwidth));
  }

  /// Bound on the end of what lane `l` begins with.
  std::optional<int64_t> first_part_of(size_t l, int64_t work_ns) const {
    return bound_of({l, work_ns * lanes_.set.ticks_per_ns});
  }

  /// Of a member that its thread goes on with, from its own release.
  std::optional<int64_t> continuation_of(size_t l, size_t position) const {
    const std::vector<size_t>& lane = lanes_.lanes[l];
    const int64_t ticks = lanes_.set.ticks_per_ns;
    Part part{l, segment_ns(plan_, lane, position, overheads_) * ticks, false};
    const auto producer = std::find(lane.begin(), lane.end(), plan_.tasks[lane[position]].on_task);
    const auto ready = finish_of(l, static_cast<size_t>(producer - lane.begin())), done = finish_of(l, position);
    const bool waits =
        std::any_of(lanes_.lanes.begin(), lanes_.lanes.end(), [&](const auto& other) { return waits_within(other); });
    if (ready && done && !waits) {
      part.ready_by = *ready * ticks;
      part.done_by = *done * ticks;
      part.slack = (plan_.anticipate_ns + overheads_.release_ns) * ticks;
    }
    return bound_of(part);
  }

  std::optional<int64_t> bound_of(const Part& part) const {
    const auto found = response_of_part(lanes_.set, plan_.policy, whole_, part);
    return found ? std::optional(ns(*found)) : std::nullopt;
  }

  /// Whether a worker waits in the middle of the lane for an output to become visible.
  bool waits_within(const std::vector<size_t>& lane) const {
    return std::any_of(lane.begin(), lane.end(), [&](size_t t) {
      const size_t producer = plan_.tasks[t].on_task;
      return producer != kNone && plan_.tasks[producer].publish == PublishAt::let;
    });
  }

  /// What a worker is charged before its head's own work.
  int64_t lead_ns(const std::vector<size_t>& lane) const {
    return plan_.policy == Policy::cooperative ? 0 : longest_lead_ns(plan_, lane);
  }

  /// From the head's release, with the work of the lane up to there.
  std::optional<int64_t> finish_of(size_t l, size_t position) const {
    const std::vector<size_t>& lane = lanes_.lanes[l];
    if (position + 1 == lane.size()) return ns(*whole_.response[l]);
    return first_part_of(l, lead_ns(lane) + prefix_ns(plan_, lane, position, overheads_));
  }

  /// The least time from the head's release to that of task t of its lane.
  int64_t released_after_ns(size_t t) const {
    if (plan_.tasks[t].on_task == kNone) return 0;
    const TaskPlan& producer = plan_.tasks[plan_.tasks[t].on_task];
    return released_after_ns(plan_.tasks[t].on_task) + (producer.publish == PublishAt::let ? producer.deadline_ns : 0);
  }

  /// Of a follower, from its own release.
  std::optional<int64_t> response_of_member(size_t l, size_t position) const {
    const std::vector<size_t>& lane = lanes_.lanes[l];
    std::optional<int64_t> bound = finish_of(l, position);
    if (bound) *bound -= released_after_ns(lane[position]);
    // A worker that waits for an output to become visible lets others run, who may then be in its way.
    const bool goes_on = std::none_of(lane.begin(), lane.begin() + static_cast<ptrdiff_t>(position),
                                      [&](size_t t) { return plan_.tasks[t].publish == PublishAt::let; });
    if (!goes_on && plan_.policy != Policy::cooperative) return bound;
    const auto part = continuation_of(l, position);
    if (!bound || (part && *part < *bound)) bound = part;
    return bound;
  }

  /// Of a head: as if it had only to begin. A follower begins when the member before it is done, or is waited for.
  std::optional<int64_t> start_of(size_t l, size_t position) const {
    const std::vector<size_t>& lane = lanes_.lanes[l];
    if (position > 0) {
      const TaskPlan& producer = plan_.tasks[plan_.tasks[lane[position]].on_task];
      return producer.publish == PublishAt::asap ? result_.nodes[lane[position - 1]].finish_ns
                                                 : finish_of(l, position);
    }
    constexpr int64_t kMicrosecond = 1'000;
    return first_part_of(l, lead_ns(lane) + overheads_.release_ns + overheads_.switch_ns + kMicrosecond);
  }

  void judge_members(size_t l) {
    const std::vector<size_t>& lane = lanes_.lanes[l];
    for (size_t m = 0; m < lane.size(); ++m) {
      const TaskPlan& task = plan_.tasks[lane[m]];
      NodeAdmission& node = result_.nodes[lane[m]];
      node.finish_ns = finish_of(l, m);
      const auto aged = [](const EdgePlan& edge) { return edge.max_age_ns > 0; };
      if (bounds_ && std::any_of(task.edges.begin(), task.edges.end(), aged)) node.start_ns = start_of(l, m);
      node.response_ns = m == 0 ? node.finish_ns : response_of_member(l, m);
      // The lane is in time as a whole; a member's own deadline may be tighter.
      if (node.response_ns && *node.response_ns <= task.deadline_ns) continue;
      if (!node.response_ns && lane.size() == 1) continue;
      refuse(Answer::not_proven,
             fmt::format("{}: its deadline of {} ms is not proven within the lane of {}{}", task.name,
                         ms(task.deadline_ns), plan_.tasks[lane.front()].name,
                         node.response_ns ? fmt::format(" (bound {:.3f} ms)", ms(*node.response_ns)) : ""));
    }
  }

  bool high(size_t lane) const {
    const auto& members = lanes_.lanes[lane];
    return std::any_of(members.begin(), members.end(),
                       [&](size_t t) { return plan_.tasks[t].criticality == Criticality::high; });
  }

  int64_t excess_ns() const {
    return plan_.policy == Policy::fixed ? overheads_.demotion_ns + (overheads_.demotion_ns > 0 ? kWatchGrain_ns : 0)
                                         : overheads_.throttled_late_ns();
  }

  /// Lanes that are stopped late. Under `fixed` one of low criticality is demoted until the job has ended, so the
  /// excess may come with every job; one of high criticality is not demoted.
  analysis::TaskSet with_overruns() const {
    analysis::TaskSet set = lanes_.set;
    if (plan_.policy == Policy::deadline) return throttled(std::move(set));
    for (size_t l = 0; l < lanes_.lanes.size(); ++l) {
      if (high(l)) continue;
      set.tasks[l].budget += excess_ns() * set.ticks_per_ns;
      set.tasks[l].deadline = set.tasks[l].period;  // its own fault
    }
    return set;
  }

  /// Under `deadline` a reservation is filled up every reservation period, which is shorter than the lane's where its
  /// deadline is: whoever runs on takes that much. What he ran too long he pays back: the excess comes once in any
  /// window, here as a task of its own, of each low lane and of that one of the high ones that runs on.
  analysis::TaskSet throttled(analysis::TaskSet set) const {
    const Ticks excess = excess_ns() * set.ticks_per_ns;
    const std::vector<Reservation> reserved = reservations(plan_, plan_.policy);
    std::optional<analysis::TimedTask> high_one;
    for (size_t l = 0; l < lanes_.lanes.size(); ++l) {
      analysis::TimedTask& task = set.tasks[l];
      task.period = std::min(task.period, reserved[l].period_ns * set.ticks_per_ns);
      task.sporadic = true;  // it is filled up when it was used up, not at releases
      task.offset = 0;
      if (excess == 0) continue;
      analysis::TimedTask late = task;
      constexpr int64_t kOnce = 1000;  // longer than any window that the tests look at
      late.name += " beyond its budget";
      late.budget = excess;
      late.period = std::min(late.period, analysis::kLongest / kOnce) * kOnce;
      if (!high(l)) set.tasks.push_back(late);
      else if (!high_one || late.deadline < high_one->deadline) high_one = late;
    }
    if (high_one) set.tasks.push_back(*high_one);
    return set;
  }

  void ask_about_overruns() {
    if (plan_.policy == Policy::cooperative) {
      result_.notes.push_back("cooperative: nothing is enforced, a node that overruns its budget delays the others");
      return;
    }
    const SetAnswer answer = analyse_set(with_overruns(), plan_.policy, false);
    if (answer.answer == Answer::admitted || high_ones_keep_up(answer)) return;
    refuse(Answer::not_proven,
           fmt::format("with every node of low criticality{} running on to {:.1f} ms over its budget: {}",
                       plan_.policy == Policy::deadline ? " and one of high" : "", ms(excess_ns()), answer.why));
  }

  /// Under `fixed` the low ones may miss then; the high ones must not.
  bool high_ones_keep_up(const SetAnswer& answer) const {
    if (plan_.policy != Policy::fixed || answer.response.size() != lanes_.set.tasks.size()) return false;
    for (size_t l = 0; l < lanes_.lanes.size(); ++l)
      if (high(l) && (!answer.response[l] || *answer.response[l] > lanes_.set.tasks[l].deadline)) return false;
    return true;
  }

  const Plan& plan_;
  const Overheads& overheads_;
  const bool bounds_;
  const LaneTasks lanes_;
  SetAnswer whole_ = {};  ///< of the lanes
  Admission result_;
};

}  // namespace

Admission admit(const Plan& plan, const Overheads& overheads, bool bounds) {
  if (plan.tasks.empty()) return {Answer::admitted, "nothing to do", {}, {}, {}};
  return Admitting(plan, overheads, bounds).run();
}

}  // namespace takt::graph
