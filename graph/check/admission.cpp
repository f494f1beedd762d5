// SPDX-License-Identifier: Apache-2.0
#include "graph/check/admission.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/check/piece_bounds.hpp"
#include "rt/sched/lane.hpp"
#include "rt/sched/watch_rules.hpp"
#include "rt/time/units.hpp"

namespace takt::graph {
namespace {

using analysis::Overheads;
using analysis::Ticks;

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
                      task.name, to_ms(task.budget_ns), to_ms(task.deadline_ns), to_ms(task.budget_ns)));
    else if (share > 1 + kRounding)
      reasons.push_back(
          fmt::format("{}: its budget of {} ms at {:.4g} Hz is more than one core, and a job runs on one; at "
                      "most {:.4g} Hz would fit",
                      task.name, to_ms(task.budget_ns), rate, 1e9 / static_cast<double>(task.budget_ns)));
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
    if (!ask_about_sources()) return std::move(result_);
    ask_kernel();
    ask_about_priorities();
    ask_about_waits();
    ask_about_lanes();
    if (lanes_admitted_) ask_about_overruns();
    return std::move(result_);
  }

 private:
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

  /// False: what a device's job sleeps for leaves it no time, so that no analysis need look at it.
  bool ask_about_sources() {
    bool time_left = true;
    for (const TaskPlan& task : plan_.tasks) {
      if (task.source.wait_ns == 0 || task.source.wait_ns + task.budget_ns <= task.deadline_ns) continue;
      time_left = false;
      refuse(Answer::not_proven,
             fmt::format("{}: what it asked for may come {:.3f} ms after its release, and its deadline of {} ms leaves "
                         "its budget of {} ms no time then; say in its settings what it takes at most "
                         "(`takt nodes` lists them), or give it a deadline from {:.3f} ms on",
                         task.name, to_ms(task.source.wait_ns), to_ms(task.deadline_ns), to_ms(task.budget_ns),
                         to_ms(task.source.wait_ns + task.budget_ns)));
    }
    return time_left;
  }

  /// SCHED_FIFO has 99 priorities; a lane and its watchdog take two of those that Takt uses.
  void ask_about_priorities() {
    if (plan_.policy != Policy::fixed) return;
    for (int core = 0; core < lanes_.set.cores; ++core) {
      int lanes = 0;
      for (size_t l = 0; l < lanes_.lanes.size(); ++l) lanes += lanes_.set.tasks[l].core == core;
      if (lanes > kMostLanesOfCore)
        refuse(Answer::infeasible,
               fmt::format("{} lanes share a core, and `fixed` has priorities for {}, each with one for its watchdog; "
                           "name more `cores`, or let nodes of one rate follow one another (`on`)",
                           lanes, kMostLanesOfCore));
    }
  }

  /// A worker that has slept within its pass gets a new deadline from the kernel, counted from its waking, and takes
  /// what is left of that into its next pass (the wake-up rule of a constant bandwidth server, Abeni & Buttazzo 1998):
  /// its jobs are neither due when the analyses think, nor bound by it.
  void ask_about_waits() {
    if (plan_.policy != Policy::deadline) return;
    for (size_t t = 0; t < plan_.tasks.size(); ++t) {
      if (!waits_for_release(plan_, t)) continue;
      const TaskPlan& task = plan_.tasks[t];
      const TaskPlan& producer = plan_.tasks[task.on_task];
      refuse(
          Answer::not_proven,
          fmt::format("{}: it waits for the instant at which what {} publishes with `let` is seen, and after a wait "
                      "within a pass SCHED_DEADLINE keeps no deadline; give {} a `rate` and, as `offset`, that of {} "
                      "and its deadline, or let {} publish `asap`",
                      task.name, producer.name, task.name, producer.name, producer.name));
    }
  }

  /// What the analysis says of the lanes, cut into pieces in one manner.
  struct Judged {
    SetAnswer set = {};  ///< of the pieces that decided
    std::vector<PieceSet> ways = {};
    std::vector<NodeAdmission> nodes = {};
  };

  Judged judge(Splitting splitting, const std::vector<int64_t>& done_by_ns) const {
    Judged judged;
    judged.ways = lane_pieces(plan_, lanes_, overheads_, done_by_ns, splitting);
    const bool followers = lanes_.lanes.size() < plan_.tasks.size();
    for (const PieceSet& pieces : judged.ways) {
      judged.set = analyse_set(pieces.set, plan_.policy, bounds_ || followers);
      // A delay that is only a bound need not come.
      if (judged.set.answer == Answer::infeasible && delayed(pieces)) judged.set.answer = Answer::not_proven;
      if (judged.set.answer != Answer::admitted) return judged;
      const PieceBounds bounds(plan_, overheads_, lanes_, pieces, judged.set);
      const std::vector<NodeAdmission> longest = bounds.longest(bounds_);
      for (size_t t = 0; t < longest.size(); ++t)
        if (judged.nodes.size() <= t) judged.nodes.push_back(longest[t]);
        else judged.nodes[t] = longer(judged.nodes[t], longest[t]);
    }
    return judged;
  }

  static bool delayed(const PieceSet& pieces) {
    return std::any_of(pieces.set.tasks.begin(), pieces.set.tasks.end(), [](const auto& t) { return t.jitter > 0; });
  }

  /// Under `cooperative` a worker that waits does nothing else meanwhile, under `deadline` none may wait; and global
  /// EDF knows no phases.
  Splitting splitting() const {
    const bool fits = std::all_of(lanes_.set.tasks.begin(), lanes_.set.tasks.end(),
                                  [](const analysis::TimedTask& task) { return task.budget <= task.deadline; });
    const bool phases = plan_.policy != Policy::deadline || lanes_.set.cores == 1;
    return {fits && plan_.policy == Policy::fixed, fits && phases};
  }

  /// Every task published by its deadline, which is what is asked for.
  std::vector<int64_t> due_ns() const {
    std::vector<int64_t> due(plan_.tasks.size(), 0);
    for (const auto& lane : lanes_.lanes)
      for (const size_t t : lane)
        due[t] = (plan_.tasks[t].on_task == kNone ? 0 : due[plan_.tasks[t].on_task]) + plan_.tasks[t].deadline_ns;
    return due;
  }

  void ask_about_lanes() {
    Judged judged = judge(splitting(), due_ns());
    const bool delays = delayed(judged.ways.front());
    if (judged.set.answer == Answer::not_proven)
      if (Judged plain = judge({}, due_ns()); plain.set.answer == Answer::admitted) judged = std::move(plain);
    result_.by = judged.set.by;
    if (judged.set.answer != Answer::admitted) return refuse(judged.set.answer, judged.set.why);
    // What was shown of those that others are delayed by takes the place of their deadlines.
    constexpr int kRounds = 3;
    for (int round = 0; round < kRounds && delays; ++round) {
      std::vector<int64_t> done_by_ns = due_ns();
      for (size_t t = 0; t < done_by_ns.size(); ++t)
        done_by_ns[t] = std::min(done_by_ns[t], judged.nodes[t].finish_ns.value_or(done_by_ns[t]));
      if (Judged closer = judge(splitting(), done_by_ns); closer.set.answer == Answer::admitted)
        judged = std::move(closer);
    }
    lanes_admitted_ = true;
    result_.nodes = std::move(judged.nodes);
    for (const auto& lane : lanes_.lanes) judge_members(lane);
  }

  void judge_members(const std::vector<size_t>& lane) {
    for (const size_t t : lane) {
      const NodeAdmission& node = result_.nodes[t];
      // The lane is in time as a whole; a member's own deadline may be tighter.
      if (node.response_ns && *node.response_ns <= plan_.tasks[t].deadline_ns) continue;
      if (!node.response_ns && lane.size() == 1) continue;
      refuse(Answer::not_proven,
             fmt::format("{}: its deadline of {} ms is not proven within the lane of {}{}", plan_.tasks[t].name,
                         to_ms(plan_.tasks[t].deadline_ns), plan_.tasks[lane.front()].name,
                         node.response_ns ? fmt::format(" (bound {:.3f} ms)", to_ms(*node.response_ns)) : ""));
    }
  }

  bool high(size_t lane) const { return any_high(plan_, lanes_.lanes[lane]); }

  int64_t excess_ns() const {
    return plan_.policy == Policy::fixed ? overheads_.demotion_ns + (overheads_.demotion_ns > 0 ? kWatchGrain_ns : 0)
                                         : overheads_.throttled_late_ns();
  }

  /// Lanes that are stopped late. Under `fixed` one of low criticality is demoted until the job has ended, so the
  /// excess may come with every job; one of high criticality is not demoted.
  analysis::TaskSet with_demotions(const PieceSet& pieces) const {
    analysis::TaskSet set = pieces.set;
    for (size_t p = 0; p < pieces.pieces.size(); ++p) {
      const Piece& piece = pieces.pieces[p];
      if (high(piece.lane)) continue;
      set.tasks[p].budget += excess_ns() * set.ticks_per_ns;
      // Being late is its own fault.
      set.tasks[p].deadline = lanes_.set.tasks[piece.lane].period - piece.ready_ns * set.ticks_per_ns;
    }
    return set;
  }

  /// Under `deadline` a reservation is filled up every reservation period, which is shorter than the lane's where its
  /// deadline is: whoever runs on takes that much. What he ran too long he pays back: the excess comes once in any
  /// window, here as a task of its own, of each low lane and of that one of the high ones that runs on.
  analysis::TaskSet throttled() const {
    analysis::TaskSet set = lanes_.set;
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
    if (plan_.policy == Policy::deadline)
      return refuse_overruns(analyse_set(throttled(), plan_.policy, false), " and one of high");
    if (excess_ns() == 0) return;  // asked already
    for (const PieceSet& pieces : lane_pieces(plan_, lanes_, overheads_, due_ns(), splitting_of_overruns())) {
      const SetAnswer answer = analyse_set(with_demotions(pieces), plan_.policy, false);
      if (answer.answer != Answer::admitted && !high_ones_keep_up(pieces, answer)) return refuse_overruns(answer, "");
    }
  }

  /// A lane that is late waits for later instants than planned. If one may be, waits count as work, wherever they fall.
  Splitting splitting_of_overruns() const {
    Splitting splitting = this->splitting();
    for (size_t l = 0; l < lanes_.lanes.size(); ++l) {
      const auto& members = lanes_.lanes[l];
      const bool waits =
          std::any_of(members.begin(), members.end(), [&](size_t t) { return waits_for_release(plan_, t); });
      if (waits && !high(l)) splitting.at_waits = false;
    }
    return splitting;
  }

  void refuse_overruns(const SetAnswer& answer, std::string_view more) {
    if (answer.answer == Answer::admitted) return;
    refuse(Answer::not_proven, fmt::format("with every node of low criticality{} running on to {:.1f} ms over its "
                                           "budget: {}",
                                           more, to_ms(excess_ns()), answer.why));
  }

  /// The low ones may miss then; the high ones must not.
  bool high_ones_keep_up(const PieceSet& pieces, const SetAnswer& answer) const {
    if (answer.response.size() != pieces.set.tasks.size()) return false;
    for (size_t p = 0; p < pieces.pieces.size(); ++p)
      if (high(pieces.pieces[p].lane) && (!answer.response[p] || *answer.response[p] > pieces.set.tasks[p].deadline))
        return false;
    return true;
  }

  const Plan& plan_;
  const Overheads& overheads_;
  const bool bounds_;
  const LaneTasks lanes_;
  bool lanes_admitted_ = false;
  Admission result_;
};

}  // namespace

Admission admit(const Plan& plan, const Overheads& overheads, bool bounds) {
  if (plan.tasks.empty()) return {Answer::admitted, "nothing to do", {}, {}, {}};
  return Admitting(plan, overheads, bounds).run();
}

}  // namespace takt::graph
