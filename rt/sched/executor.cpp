// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/executor.hpp"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <thread>

#include "rt/capability.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/memory/sanitized.hpp"
#include "rt/node.hpp"
#include "rt/sched/anticipation.hpp"
#include "rt/sched/bandwidth.hpp"
#include "rt/sched/cooperative.hpp"
#include "rt/sched/lane_tasks.hpp"
#include "rt/sched/rendezvous.hpp"
#include "rt/sched/virtual_run.hpp"
#include "rt/sched/worker_threads.hpp"

namespace takt {
namespace {

/// What preparation has cost this thread is no job's.
void start_counting() {
  take_thread_use();
  take_page_faults();
}

/// While it lives, threads that this one makes begin at its priority, if that is a real-time one: else workers of a
/// process on its way back would have to wait among ordinary threads until they can ask for their own.
class PassesPriorityOn {
 public:
  PassesPriorityOn() : policy_(sched_getscheduler(0)) {
    sched_getparam(0, &priority_);
    if (priority_.sched_priority > 0) sched_setscheduler(0, policy_ & ~SCHED_RESET_ON_FORK, &priority_);
  }
  ~PassesPriorityOn() {
    if (priority_.sched_priority > 0) sched_setscheduler(0, policy_, &priority_);
  }
  PassesPriorityOn(const PassesPriorityOn&) = delete;
  PassesPriorityOn& operator=(const PassesPriorityOn&) = delete;

 private:
  const int policy_;
  sched_param priority_{};
};

void name_thread(const std::string& name) { pthread_setname_np(pthread_self(), name.substr(0, 15).c_str()); }

/// One line per reason, whichever lanes it hit.
void add_refusal(const std::string& lane, const std::string& reason, std::vector<std::string>& lines) {
  for (std::string& line : lines) {
    if (!line.ends_with(": " + reason)) continue;
    line.insert(line.size() - reason.size() - 2, ", " + lane);
    return;
  }
  lines.push_back(lane + ": " + reason);
}

}  // namespace

Executor::Executor(const Plan& plan, Transport& transport, Clock& clock, const Options& options)
    : plan_(plan),
      transport_(transport),
      clock_(clock),
      options_(options),
      own_board_(options.board == nullptr ? std::make_unique<RunBoard>(plan) : nullptr),
      board_(options.board == nullptr ? *own_board_ : *options.board),
      stop_(board_.stop()),
      tasks_(plan.tasks.size()) {
  const auto own = [&](size_t t) { return options_.own.empty() || options_.own[t]; };
  for (size_t t = 0; t < plan_.tasks.size(); ++t)
    if (own(t)) tasks_[t] = std::make_unique<Task>(plan_, t, transport, clock, board_);
  for (const auto& members : lane_members(plan_))
    if (own(members.front())) lanes_.push_back(std::make_unique<Lane>(members, tasks_));
}

Executor::~Executor() = default;

RunResult Executor::run() {
  RunResult result;
  if (clock_.is_virtual()) {
    run_virtual(result);
  } else if (plan_.policy == Policy::cooperative || !run_partitioned(plan_.policy, result)) {
    if (!result.refused.empty() && options_.require_policy) throw PolicyRefused(result.refused.front());
    for (const auto& lane : lanes_) set_grants(*lane, apply(Reservation{}));
    start_clockwork(result);
    run_cooperative(result);
  }
  result.end_ns = stop_.end_ns();
  for (const auto& task : tasks_) {
    if (!task) continue;
    if (task->plan().rate) task->forget_from(result.end_ns);  // followers count their own releases
    task->settle();
  }
  result.released = released_jobs(plan_, board_, result.epoch_ns, result.end_ns);
  return result;
}

void Executor::set_grants(const Lane& lane, const Grant& grant) {
  for (const size_t member : lane.members()) board_.set_grant(member, grant);
}

void Executor::start_clockwork(RunResult& result) {
  result.epoch_ns = options_.gate != nullptr ? options_.gate->epoch_ns()
                                             : clock_.now_ns() + (clock_.is_virtual() ? 0 : options_.start_delay_ns);
  // Where a supervisor has fixed it, that is not this process's to write.
  if (board_.epoch_ns().load() != result.epoch_ns) board_.epoch_ns().store(result.epoch_ns);
  if (options_.duration_ns > 0) stop_.set_planned_end(result.epoch_ns + options_.duration_ns);
  without_rights([&] {  // the threads of devices
    for (const auto& task : tasks_)
      if (task) task->start(result.epoch_ns, options_.rejoin ? &transport_ : nullptr);
  });
  for (auto& lane : lanes_) {
    if (options_.rejoin) lane->join(result.epoch_ns, clock_.now_ns());
    else lane->set_epoch(result.epoch_ns);
  }
}

std::vector<Reservation> Executor::own_reservations(Policy policy) const {
  // Over all lanes of the plan, so that every process of a run comes to the same assignment.
  const std::vector<std::vector<size_t>> lanes = lane_members(plan_);
  const std::vector<Reservation> all = reservations(plan_, policy);
  std::vector<Reservation> own;
  for (size_t i = 0; i < lanes.size(); ++i)
    if (tasks_[lanes[i].front()]) own.push_back(all[i]);
  return own;
}

/// What the workers of a run share. It lives as long as the executor: a job that never returns may still use it.
struct Executor::Crew {
  explicit Crew(size_t lanes) : ready(lanes + 1), started(lanes + 1), grants(lanes) {}
  std::atomic<bool> go{false};
  Rendezvous ready, started;
  std::vector<Reservation> wanted;  ///< by lane; none under `cooperative`
  std::vector<Grant> grants;
  std::unique_ptr<CooperativeQueue> queue;
  std::unique_ptr<Watchdog> watchdog;
  WorkerThreads workers;
};

namespace {

/// What the lane asks for. Under `fixed` the watchdogs go above the lanes: a limit (RLIMIT_RTPRIO) that leaves them no
/// room refuses the policy, since nothing would be enforced.
Grant apply_below_watchdog(const Reservation& wanted, int64_t patience_ns) {
  if (wanted.policy == Policy::fixed) {
    Reservation above = wanted;
    above.priority = kHighestPriority + 1;
    if (Grant grant = apply(above); !grant.refused.empty()) return grant;
  }
  return apply(wanted, patience_ns);
}

/// The worker of a restarted process whose bandwidth is not free: SCHED_FIFO until it is, where a lifted one would be.
Grant go_beside(Lane& lane, const Reservation& wanted, bool behind) {
  const Grant grant = apply(fixed_reservation(behind ? kLowestPriority : kHighestPriority));
  if (grant.refused.empty()) lane.watch().bind_beside(wanted, behind);
  return grant;
}

/// Once all workers hold what they got: EBUSY says neither how much is missing nor who has it.
void explain_busy(const std::vector<Reservation>& wanted, std::vector<Grant>& grants) {
  double asked = 0, least_refused = std::numeric_limits<double>::max();
  for (size_t i = 0; i < grants.size(); ++i) {
    if (wanted[i].policy != Policy::deadline) return;
    const double share = static_cast<double>(wanted[i].runtime_ns) / static_cast<double>(wanted[i].period_ns);
    asked += share;
    if (grants[i].error == EBUSY) least_refused = std::min(least_refused, share);
  }
  if (least_refused > asked) return;
  const std::string why = "SCHED_DEADLINE was refused (Device or resource busy): " + why_busy(asked, least_refused);
  for (Grant& grant : grants)
    if (grant.error == EBUSY) grant.refused = why;
}

}  // namespace

bool Executor::run_partitioned(Policy policy, RunResult& result) {
  crew_ = std::make_unique<Crew>(lanes_.size());
  const std::vector<Reservation>& wanted = crew_->wanted = own_reservations(policy);
  // A process before this one may just have died with the same reservations. One that comes back does not wait: its
  // jobs are due.
  const int64_t patience_ns = options_.rejoin ? 0 : bandwidth_within_ns(wanted) + kBandwidthMargin_ns;
  size_t begun = 0;
  const auto begin_lane = [&](size_t i) {
    const PassesPriorityOn at_once;
    crew_->workers.start([this, policy, &crew = *crew_, &lane = *lanes_[i], mine = wanted[i], patience_ns, i] {
      name_thread(lane.head().plan().name);
      keep_rights(Rights::real_time);
      prefault_stack();
      crew.grants[i] = apply_below_watchdog(mine, patience_ns);
      lane.watch().bind(mine);
      if (options_.rejoin && crew.grants[i].error == EBUSY)
        crew.grants[i] = go_beside(lane, mine, /*behind=*/!any_high(plan_, lane.members()));
      crew.ready.arrive_and_wait();
      crew.started.arrive_and_wait();
      if (!crew.go.load()) return;
      const trace::Thread traced(options_.trace,
                                 lane.head().plan().name);  // not before: cooperative workers need rings
      start_counting();
      Anticipation anticipation(longest_lead_ns(plan_, lane.members()), Anticipation::Beside::workers);
      while (lane.next_release_ns() < stop_.end_ns()) {
        const int64_t release_ns = lane.next_release_ns();
        lane.watch().falls_asleep();
        const bool early = anticipation.sleep_before(release_ns, clock_, stop_);
        lane.watch().awakes();
        if (early) {
          lane.rehearse();
          anticipation.stay_awake_until(release_ns, clock_);
        } else {
          lane.fetch_ahead();
        }
        if (lane.next_release_ns() >= stop_.end_ns()) break;
        lane.run_next(clock_, stop_);
      }
      // To end takes a thread longer than a short job takes: the last jobs of others need not wait for that.
      if (policy == Policy::fixed) demote_thread(0);
    });
  };
  try {
    for (; begun < lanes_.size(); ++begun) begin_lane(begun);
    crew_->ready.arrive_and_wait();
    agree(policy, result);
  } catch (...) {  // too many threads, a device that cannot start: the workers must not wait for ever
    if (begun < lanes_.size()) {
      for (Rendezvous* meeting : {&crew_->ready, &crew_->started}) meeting->leave(lanes_.size() - begun);
      crew_->ready.arrive_and_wait();
    }
    crew_->started.arrive_and_wait();
    throw;
  }
  crew_->started.arrive_and_wait();
  join(result);
  return crew_->go.load();
}

void Executor::agree(Policy policy, RunResult& result) {
  std::vector<Grant>& grants = crew_->grants;
  explain_busy(crew_->wanted, grants);
  for (size_t i = 0; i < lanes_.size(); ++i) set_grants(*lanes_[i], grants[i]);
  const bool mine = std::all_of(grants.begin(), grants.end(), [](const Grant& grant) { return grant.refused.empty(); });
  const bool go = options_.gate != nullptr ? options_.gate->all_granted(mine) : mine;
  // Of several processes only the supervisor reads them, while none of them writes: between agreement and decision.
  if (options_.gate == nullptr) result.refused = refusals(plan_, board_);
  if (!go) return;
  result.policy_granted = policy;
  start_clockwork(result);
  watch(policy);
  if (options_.gives_up_rights) keep_rights(Rights::none);  // workers and watchdogs have theirs
  crew_->go.store(true);
}

void Executor::run_cooperative(RunResult& result) {
  crew_ = std::make_unique<Crew>(0);
  if (options_.gives_up_rights) keep_rights(Rights::none);
  int64_t lead_ns = plan_.anticipate_ns;
  for (const auto& lane : lanes_) lead_ns = std::min(lead_ns, longest_lead_ns(plan_, lane->members()));
  crew_->queue = std::make_unique<CooperativeQueue>(lanes_, clock_, stop_, lead_ns);
  watch(Policy::cooperative);
  const size_t workers = std::clamp<size_t>(plan_.cores.size(), 1, std::max<size_t>(lanes_.size(), 1));
  const auto begin_worker = [&](size_t i) {
    crew_->workers.start([this, &queue = *crew_->queue, i] {
      name_thread("takt-worker-" + std::to_string(i));
      const trace::Thread traced(options_.trace, "takt-worker-" + std::to_string(i));
      prefault_stack();
      apply(cooperative_reservation());
      start_counting();
      queue.work();
    });
  };
  try {
    for (size_t i = 0; i < workers; ++i) begin_worker(i);
  } catch (...) {  // too many threads: those that were begun must not work on
    stop_.raise(clock_.now_ns());
    throw;
  }
  stop_.sleep_until(stop_.end_ns());
  join(result);
}

void Executor::watch(Policy granted) {
  std::vector<Watchdog::Worker> workers;
  for (size_t i = 0; i < lanes_.size(); ++i)
    workers.push_back(
        {&lanes_[i]->watch(), lanes_[i]->members(), granted == Policy::fixed ? crew_->wanted[i] : Reservation{}});
  Watchdog::Options options;
  options.granted = granted;
  options.patience_ns = options_.hang_patience_ns > 0 ? options_.hang_patience_ns : Watchdog::patience_ns(granted);
  options.stolen_ns = options_.stolen_ns;
  options.life = options_.life;
  options.priority = granted == Policy::cooperative ? 0 : kHighestPriority + 1;
  crew_->watchdog = std::make_unique<Watchdog>(plan_, board_, clock_, std::move(workers), options);
}

void Executor::join(RunResult& result) {
  const Watchdog* watchdog = crew_->watchdog.get();
  std::vector<size_t> hanging;
  const size_t given_up = crew_->workers.join([&](const std::vector<size_t>& at_work) {
    hanging.clear();
    for (size_t i = 0; watchdog != nullptr && i < lanes_.size(); ++i)
      if (watchdog->hangs(i)) hanging.push_back(i);
    // Not before the end: a job that hangs now may still come back.
    return hanging.size() >= at_work.size() && clock_.now_ns() >= stop_.end_ns();
  });
  if (given_up == 0) hanging.clear();  // what hung when it was last asked has come back
  for (const size_t i : hanging) {
    const JobWatch::Running job = lanes_[i]->watch().running();
    result.stuck.push_back(lanes_[i]->members()[job.member]);
    // It may have come back this moment, or have been released at the very end.
    if (job.serial == 0 || job.release_ns >= stop_.end_ns()) continue;
    TaskStatistics& statistics = board_.task(result.stuck.back());
    statistics.deadline_misses.fetch_add(1);
    const int64_t over_ns = lanes_[i]->watch().cpu_ns() - job.cpu_limit_ns;
    if (over_ns > 0) statistics.budget_overruns.fetch_add(1);
    statistics.cpu_ns += over_ns + enforced_budget_ns(plan_.tasks[result.stuck.back()]);
  }
  if (result.stuck.empty()) crew_->watchdog.reset();
}

void Executor::run_virtual(RunResult& result) {
  start_clockwork(result);
  start_counting();
  VirtualRun(plan_, lanes_, dynamic_cast<VirtualClock&>(clock_), stop_,
             {options_.job_duration_ns, options_.after_step, options_.ran, options_.trace})
      .run();
}

uint64_t left_out_jobs(const Plan& plan, const RunBoard& board, size_t task, int64_t epoch_ns, int64_t end_ns) {
  const TaskPlan& t = plan.tasks[task];
  if (!t.rate) return 0;
  const int64_t origin = epoch_ns + t.offset_ns;
  uint64_t jobs = 0;
  board.modes().for_each_part(epoch_ns, end_ns, [&](uint32_t mode, int64_t from_ns, int64_t to_ns) {
    if (mode < plan.modes.size() && !plan.modes[mode].runs[task] && to_ns > from_ns)
      jobs += static_cast<uint64_t>(t.rate->releases_before(origin, to_ns) - t.rate->releases_before(origin, from_ns));
  });
  return jobs;
}

std::vector<uint64_t> released_jobs(const Plan& plan, const RunBoard& board, int64_t epoch_ns, int64_t end_ns) {
  std::vector<uint64_t> released;
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const TaskPlan& task = plan.tasks[t];
    if (!task.rate) {
      released.push_back(board.task(t).released.load() - board.task(t).paused.load());
      continue;
    }
    const auto planned = static_cast<uint64_t>(task.rate->releases_before(epoch_ns + task.offset_ns, end_ns));
    const uint64_t passed = board.task(t).paused.load() + left_out_jobs(plan, board, t, epoch_ns, end_ns);
    released.push_back(planned - std::min(planned, passed));
  }
  return released;
}

std::vector<std::string> refusals(const Plan& plan, const RunBoard& board) {
  std::vector<std::string> lines;
  for (const auto& members : lane_members(plan)) {
    const Grant grant = board.grant(members.front());
    if (!grant.refused.empty()) add_refusal(plan.tasks[members.front()].name, grant.refused, lines);
  }
  return lines;
}

}  // namespace takt
