// SPDX-License-Identifier: Apache-2.0
#include "rt/trace/blame.hpp"

#include <algorithm>
#include <tuple>

namespace takt::trace {
namespace {

constexpr int64_t kTimerNs = 200'000;  // a timer that is later than this did not just take its time

/// What its thread did, if all of the job's time is known; else null.
const std::vector<const Slice*>* slices_for(const Evidence& evidence, const JobSpan& job) {
  const Trace& trace = evidence.trace();
  const bool known = trace.source != Source::none && job.release_ns >= trace.first_ns;
  return known ? evidence.slices_of(job.thread) : nullptr;
}

/// Builds the course of one job, front to back.
class Course {
 public:
  Course(const Evidence& evidence, const JobSpan& job)
      : evidence_(evidence), job_(job), slices_(slices_for(evidence, job)), at_(job.release_ns) {}

  std::vector<Piece> pieces() {
    const int64_t start = std::max(job_.start_ns, job_.release_ns);
    for (const JobSpan* ahead : evidence_.ahead_of(job_, job_.release_ns, start)) {
      before_start(std::min(start, ahead->start_ns));
      const auto& tasks = evidence_.trace().tasks;
      const bool lane = tasks[ahead->task].lane == tasks[job_.task].lane;
      until(std::min(start, ahead->published_ns), lane ? Cause::lane : Cause::queue, tasks[ahead->task].name,
            ahead->cpu);
    }
    before_start(start);
    started_ = true;
    if (slices_ == nullptr) until(job_.published_ns, Cause::running, "", job_.cpu);
    else follow_thread(job_.published_ns);
    return std::move(pieces_);
  }

 private:
  void until(int64_t to_ns, Cause cause, const std::string& who = {}, int cpu = -1) {
    if (to_ns <= at_) return;
    if (!pieces_.empty() && pieces_.back().cause == cause && pieces_.back().who == who && pieces_.back().cpu == cpu)
      pieces_.back().to_ns = to_ns;
    else pieces_.push_back({at_, to_ns, cause, who, cpu});
    at_ = to_ns;
  }

  void before_start(int64_t to_ns) {
    if (slices_ == nullptr) until(to_ns, Cause::late);
    else follow_thread(to_ns);
  }

  /// By what the job's thread did from here to `to_ns`.
  void follow_thread(int64_t to_ns) {
    auto next = std::partition_point(slices_->begin(), slices_->end(), [&](const Slice* s) { return s->to_ns <= at_; });
    const Slice* last = next != slices_->begin() ? *std::prev(next) : nullptr;
    while (at_ < to_ns) {
      const Slice* slice = next != slices_->end() ? *next++ : nullptr;
      const int64_t comes = slice != nullptr ? slice->from_ns : to_ns;
      if (comes > at_) off_cpu(std::min(comes, to_ns), last, slice);
      if (slice == nullptr) return;
      until(std::min(to_ns, slice->to_ns), started_ ? Cause::running : Cause::late, "", started_ ? slice->cpu : -1);
      last = slice;
    }
  }

  /// The thread had no CPU from here to `to_ns`, between two of its slices, each of which may be missing.
  void off_cpu(int64_t to_ns, const Slice* last, const Slice* next) {
    const bool preempted = last != nullptr && last->end == Slice::End::preempted;
    if (!preempted) {
      if (next == nullptr) return until(to_ns, started_ ? Cause::unattributed : Cause::late);
      // A source that does not tell wake-ups counts the wait for a CPU after one as sleep.
      const int64_t woken = next->woken_ns > 0 ? next->woken_ns : next->from_ns;
      asleep(std::min(to_ns, woken), last, *next);
    }
    if (at_ < to_ns)
      wait_for_cpu(to_ns, preempted ? last->cpu : next->cpu, preempted ? last->priority : next->priority);
  }

  void asleep(int64_t to_ns, const Slice* last, const Slice& next) {
    if (started_) return until(to_ns, Cause::asleep);
    // A timer interrupts whoever runs. If it was late, and the host took time from the CPU it was set on, that CPU was
    // not there.
    const int cpu = last != nullptr ? last->cpu : next.cpu;
    const bool stall = next.woken_ns > 0 && to_ns - at_ > kTimerNs && evidence_.stolen_ns(cpu, at_, to_ns) > 0;
    until(to_ns, stall ? Cause::stall : Cause::late);
  }

  void wait_for_cpu(int64_t to_ns, int cpu, int priority) {
    if (!knows_every_cpu(evidence_.trace().source)) return wait_for_ours(to_ns, cpu);
    for (const Piece& occupant : evidence_.occupants(cpu, at_, to_ns)) {
      nobody_ran(occupant.from_ns, cpu, priority);
      // A thread of SCHED_DEADLINE yields to nobody but its like, unless the kernel holds it back.
      if (priority < 0 && evidence_.left_to_others(cpu, occupant.from_ns)) held_back(occupant.to_ns, cpu);
      else until(occupant.to_ns, started_ ? Cause::preempted : Cause::behind, occupant.who, cpu);
    }
    nobody_ran(to_ns, cpu, priority);
  }

  /// Where only our own threads are followed: they are named, whoever else had the CPU is not.
  void wait_for_ours(int64_t to_ns, int cpu) {
    const auto others = [&](int64_t until_ns) {
      until(until_ns, started_ ? Cause::preempted : Cause::late, "", started_ ? cpu : -1);
    };
    for (const Piece& occupant : evidence_.occupants(cpu, at_, to_ns)) {
      others(occupant.from_ns);
      until(occupant.to_ns, started_ ? Cause::preempted : Cause::behind, occupant.who, cpu);
    }
    others(to_ns);
  }

  /// Of SCHED_DEADLINE, runnable, and its CPU did nothing more urgent.
  void held_back(int64_t to_ns, int cpu) {
    const bool stall = evidence_.stolen_ns(cpu, at_, to_ns) > (to_ns - at_) / 2;  // most of what it waited for
    until(to_ns, stall ? Cause::stall : Cause::throttled);
  }

  /// It could have run and its CPU was free.
  void nobody_ran(int64_t to_ns, int cpu, int priority) {
    const bool long_wait = to_ns - at_ > kTimerNs;  // less is the way through the scheduler
    if (priority < 0 && long_wait) held_back(to_ns, cpu);
    else until(to_ns, started_ ? Cause::unattributed : Cause::late);
  }

  const Evidence& evidence_;
  const JobSpan& job_;
  const std::vector<const Slice*>* slices_;
  int64_t at_;
  bool started_ = false;
  std::vector<Piece> pieces_;
};

void add(std::vector<Part>& parts, Cause cause, int64_t ns, const std::string& who = {}, int cpu = -1) {
  if (ns == 0) return;
  const auto same = std::find_if(parts.begin(), parts.end(), [&](const Part& part) {
    return part.cause == cause && part.who == who && part.cpu == cpu;
  });
  if (same != parts.end()) same->ns += ns;
  else parts.push_back({cause, ns, who, cpu});
}

/// What the host took from the CPUs that the job ran on while it did, at most; 0 if none of it shows.
int64_t taken_from(const std::vector<Piece>& pieces, const Evidence& evidence) {
  std::map<int, std::pair<int64_t, int64_t>> ran;  // per CPU, from the first to the last
  for (const Piece& piece : pieces)
    if (piece.cause == Cause::running) ran.try_emplace(piece.cpu, piece.from_ns, 0).first->second.second = piece.to_ns;
  int64_t sum = 0;
  for (const auto& [cpu, span] : ran)
    if (const int64_t shown = evidence.stolen_ns(cpu, span.first, span.second); shown > 0) sum += shown + kStealTickNs;
  return sum;
}

}  // namespace

std::vector<Piece> course(const Evidence& evidence, const JobSpan& job) { return Course(evidence, job).pieces(); }

Blame blame(const Evidence& evidence, const JobSpan& job) {
  const Trace& trace = evidence.trace();
  const TaskFacts& task = trace.tasks[job.task];
  Blame result;
  result.miss_ns = job.published_ns - job.deadline_ns;
  int64_t had_cpu = 0;
  const std::vector<Piece> pieces = course(evidence, job);
  for (const Piece& piece : pieces) {
    if (piece.cause == Cause::running) had_cpu += piece.to_ns - piece.from_ns;
    else add(result.parts, piece.cause, piece.to_ns - piece.from_ns, piece.who, piece.cpu);
  }
  // The CPU clock also counts the wake-up, which the course has as lateness.
  const int64_t executed = std::min(job.cpu_ns, had_cpu);
  const int64_t stood_still = had_cpu - executed;
  const bool switches_known = slices_for(evidence, job) != nullptr;
  const int64_t stall = switches_known ? std::min(stood_still, taken_from(pieces, evidence)) : 0;
  add(result.parts, Cause::stall, stall);
  add(result.parts, Cause::unattributed, stood_still - stall);
  const int64_t allowed = task.budget_ns > 0 ? std::min(executed, task.budget_ns) : 0;
  add(result.parts, task.budget_ns > 0 ? Cause::budget : Cause::execution, executed - allowed);
  // A job that starts before its planned release (clocks of two machines) is not early but has that much more slack.
  const int64_t early = std::max<int64_t>(0, job.release_ns - job.published_ns);
  add(result.parts, Cause::slack, -(job.deadline_ns - job.release_ns - allowed) - early);
  std::stable_sort(result.parts.begin(), result.parts.end(), [](const Part& a, const Part& b) {
    return std::tuple(a.cause, -a.ns) < std::tuple(b.cause, -b.ns);
  });
  return result;
}

}  // namespace takt::trace
