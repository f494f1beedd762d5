// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/stall_watch.hpp"

#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <map>
#include <utility>

#include "rt/capability.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/sched/grant.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/time/clock.hpp"

namespace takt {
namespace {

constexpr int kProbePriority = kHighestPriority + 2;  // above the watchdogs

void sleep_until(int64_t instant_ns) {
  const timespec instant{instant_ns / 1'000'000'000, instant_ns % 1'000'000'000};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &instant, nullptr);
}

int64_t overlap_ns(int64_t from_ns, int64_t to_ns, int64_t other_from_ns, int64_t other_to_ns) {
  return std::max<int64_t>(0, std::min(to_ns, other_to_ns) - std::max(from_ns, other_from_ns));
}

/// False if the kernel refused.
bool become(int priority, int core) {
  prefault_stack();
  const bool granted = apply(fixed_reservation(priority, core)).error == 0;
  keep_rights(Rights::none);
  return granted;
}

}  // namespace

void StallLog::add(const Stall& stall) {
  if (stalls_.size() < kMost) stalls_.push_back(stall);
  else ++lost_;
}

int64_t away_ns(const std::vector<Stall>& stalls, int64_t from_ns, int64_t to_ns) {
  std::map<int, int64_t> by_witness;
  int64_t most_ns = 0;
  for (const Stall& stall : stalls) {
    if (stall.from_ns > to_ns || stall.to_ns < from_ns) continue;
    most_ns = std::max(most_ns, by_witness[stall.cpu] += stall.away_ns);
  }
  return most_ns;
}

void StealReader::look(int64_t now_ns, StallLog& log) {
  const int64_t total_ns = read_();
  if (last_look_ns_ > 0 && total_ns > last_total_ns_)
    log.add({last_look_ns_ - tick_ns_, now_ns, total_ns - last_total_ns_, Stall::kAllCpus});
  last_look_ns_ = now_ns;
  last_total_ns_ = total_ns;
}

int64_t idle_ns(const RunBoard& board, size_t tasks, int64_t from_ns, int64_t to_ns) {
  constexpr uint64_t kLooked = 48;  // of a ring of 64, so that none is being written meanwhile
  int64_t left_ns = to_ns - from_ns;
  for (size_t t = 0; t < tasks; ++t) {
    const TaskStatistics& s = board.task(t);
    const uint64_t count = s.job_count.load(std::memory_order_acquire);
    for (uint64_t n = count; n > count - std::min(count, kLooked); --n) {
      const JobRecord& job = s.jobs[(n - 1) % s.jobs.size()];
      if (job.finish_ns < from_ns) break;
      left_ns -= overlap_ns(job.start_ns, job.finish_ns, from_ns, to_ns);
    }
  }
  return std::max<int64_t>(0, left_ns);
}

StallWatch::StallWatch(const Plan& plan, const RunBoard& board, std::function<int64_t()> stolen_ns)
    : board_(board),
      tasks_(plan.tasks.size()),
      jobs_go_before_(plan.policy == Policy::deadline),
      stolen_ns_(std::move(stolen_ns)) {
  const auto begin = [&](auto work) { threads_.emplace_back(work, OwnThread::kStack, OwnThread::Stack::resident); };
  for (const int core : plan.cores) begin([this, core] { probe(core); });
  if (stolen_ns_) begin([this] { read_steal(); });
}

const StallLog& StallWatch::end() {
  ended_.store(true);
  for (OwnThread& thread : threads_) thread.join();
  threads_.clear();
  return log_;
}

void StallWatch::probe(int core) {
  pthread_setname_np(pthread_self(), "takt-probe");
  if (!become(kProbePriority, core)) return;
  std::vector<Stall> late;
  late.reserve(2 * kSettled_ns / kProbe_ns);
  const MonotonicClock clock;
  for (int64_t due_ns = clock.now_ns(); !ended_.load();) {
    due_ns += kProbe_ns;
    sleep_until(due_ns);
    const int64_t now_ns = clock.now_ns();
    settle(late, now_ns);
    if (now_ns - due_ns < kShortest_ns) continue;
    late.push_back({due_ns, now_ns, now_ns - due_ns, core});
    due_ns = clock.now_ns();
  }
  settle(late, INT64_MAX);
}

void StallWatch::read_steal() {
  pthread_setname_np(pthread_self(), "takt-steal");
  become(kLowestPriority, -1);
  StealReader reader(stolen_ns_, 1'000'000'000 / sysconf(_SC_CLK_TCK));
  const MonotonicClock clock;
  while (!ended_.load()) {
    {
      const std::lock_guard lock(mutex_);
      reader.look(clock.now_ns(), log_);
    }
    sleep_until(clock.now_ns() + kSteal_ns);
  }
  const std::lock_guard lock(mutex_);
  reader.look(clock.now_ns(), log_);
}

void StallWatch::settle(std::vector<Stall>& late, int64_t now_ns) {
  const auto settled = [&](const Stall& stall) { return !jobs_go_before_ || now_ns - kSettled_ns >= stall.to_ns; };
  for (Stall stall : late) {
    if (!settled(stall)) continue;
    if (jobs_go_before_) stall.away_ns = idle_ns(board_, tasks_, stall.from_ns, stall.to_ns);
    const std::lock_guard lock(mutex_);
    if (stall.away_ns >= kShortest_ns) log_.add(stall);
  }
  std::erase_if(late, settled);
}

}  // namespace takt
