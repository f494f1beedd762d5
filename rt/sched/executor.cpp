// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/executor.hpp"

#include <pthread.h>

#include <algorithm>
#include <cstring>
#include <set>
#include <thread>
#include <tuple>

#include "rt/memory/memory_use.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/node.hpp"
#include "rt/sched/cooperative.hpp"
#include "rt/sched/lane_tasks.hpp"
#include "rt/sched/rendezvous.hpp"

namespace takt {
namespace {

/// What preparation has cost this thread is no job's.
void start_counting() {
  take_thread_use();
  take_page_faults();
}

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
    run_cooperative();
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
  board_.epoch_ns().store(result.epoch_ns);
  if (options_.duration_ns > 0) stop_.set_planned_end(result.epoch_ns + options_.duration_ns);
  for (auto& lane : lanes_) lane->set_epoch(result.epoch_ns);
  for (const auto& task : tasks_)
    if (task) task->plan().node->start(result.epoch_ns);
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

bool Executor::run_partitioned(Policy policy, RunResult& result) {
  const std::vector<Reservation> wanted = own_reservations(policy);
  std::vector<Grant> grants(lanes_.size());
  std::atomic<bool> go{false};
  Rendezvous ready(lanes_.size() + 1), started(lanes_.size() + 1);
  std::vector<std::thread> workers;
  for (size_t i = 0; i < lanes_.size(); ++i) {
    workers.emplace_back([&, i] {
      Lane& lane = *lanes_[i];
      name_thread(lane.head().plan().name);
      prefault_stack();
      grants[i] = apply(wanted[i]);
      ready.arrive_and_wait();
      started.arrive_and_wait();
      if (!go.load()) return;
      start_counting();
      while (lane.next_release_ns() < stop_.end_ns()) {
        stop_.sleep_until(lane.next_release_ns());
        if (lane.next_release_ns() >= stop_.end_ns()) break;
        lane.run_next(clock_, stop_);
      }
    });
  }
  ready.arrive_and_wait();
  for (size_t i = 0; i < lanes_.size(); ++i) set_grants(*lanes_[i], grants[i]);
  const bool mine = std::all_of(grants.begin(), grants.end(), [](const Grant& grant) { return grant.refused.empty(); });
  go.store(options_.gate != nullptr ? options_.gate->all_granted(mine) : mine);
  // Of several processes only the supervisor reads them, while none of them writes: between agreement and decision.
  if (options_.gate == nullptr) result.refused = refusals(plan_, board_);
  if (go.load()) {
    result.policy_granted = policy;
    start_clockwork(result);
  }
  started.arrive_and_wait();
  for (std::thread& worker : workers) worker.join();
  return go.load();
}

void Executor::run_cooperative() {
  CooperativeQueue queue(lanes_, clock_, stop_);
  std::vector<std::thread> workers;
  for (size_t i = 0; i < std::max<size_t>(plan_.cores.size(), 1); ++i) {
    workers.emplace_back([&queue, i] {
      name_thread("takt-worker-" + std::to_string(i));
      prefault_stack();
      apply(Reservation{});
      start_counting();
      queue.work();
    });
  }
  stop_.sleep_until(stop_.end_ns());
  queue.wake();
  for (std::thread& worker : workers) worker.join();
}

void Executor::run_virtual(RunResult& result) {
  auto& clock = dynamic_cast<VirtualClock&>(clock_);
  start_clockwork(result);
  start_counting();
  // Ordered by instant, then deadline, then lane: the same order in every run.
  using Event = std::tuple<int64_t, int64_t, size_t, size_t>;
  std::multiset<Event> events;
  const auto expect_head = [&](size_t lane) {
    events.insert({lanes_[lane]->next_release_ns(), lanes_[lane]->next_deadline_ns(), lane, 0});
  };
  for (size_t i = 0; i < lanes_.size(); ++i) expect_head(i);
  std::vector<Lane::Activation> released;
  while (!events.empty()) {
    const auto [instant, deadline, lane, member] = *events.begin();
    events.erase(events.begin());
    if (instant >= stop_.end_ns() && member == 0) continue;
    clock.advance_to(instant);
    released.clear();
    if (member == 0) {
      lanes_[lane]->run_head_modelled(stop_, released);
      expect_head(lane);
    } else {
      lanes_[lane]->run_follower_modelled({member, instant}, released);
    }
    for (const auto& a : released) {
      const int64_t relative = tasks_[lanes_[lane]->members()[a.member]]->plan().deadline_ns;
      events.insert({a.release_ns, a.release_ns + relative, lane, a.member});
    }
  }
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
    released.push_back(planned - std::min(planned, board.task(t).paused.load()));
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
