// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/job_watch.hpp"

#include <pthread.h>
#include <unistd.h>

#include <algorithm>

#include "rt/hot.hpp"
#include "rt/sched/lookout.hpp"
#include "rt/sched/stolen_time.hpp"
#include "rt/time/clock.hpp"

namespace takt {

void JobWatch::bind(const Reservation& has) {
  thread_local const int thread = gettid();
  has_ = has;
  runtime_ns_.store(has.runtime_ns, std::memory_order_release);
  clockid_t clock{};
  if (pthread_getcpuclockid(pthread_self(), &clock) == 0) clock_.store(clock, std::memory_order_release);
  rest(cpu_ns());
  thread_.store(thread, std::memory_order_release);
}

void JobWatch::bind_beside(const Reservation& wanted, bool behind) {
  bind(wanted);
  refusals_.store(1, std::memory_order_release);
  place_.store(behind ? Place::behind : Place::first, std::memory_order_release);
}

TAKT_HOT void JobWatch::begin(uint32_t member, uint64_t index, int64_t release_ns, int64_t cpu_limit_ns) {
  // Release stores: who reads one of them also sees that the job before has ended, and so takes no action on it.
  member_.store(member, std::memory_order_release);
  index_.store(index, std::memory_order_release);
  release_ns_.store(release_ns, std::memory_order_release);
  cpu_limit_ns_.store(cpu_limit_ns, std::memory_order_release);
  const uint64_t serial = state_.load(std::memory_order_relaxed) / kPhases + 1;
  state_.store(serial * kPhases + at_work, std::memory_order_release);
}

TAKT_HOT bool JobWatch::end() {
  if (place_.load(std::memory_order_relaxed) != Place::own) settle_down();
  uint64_t state = state_.load(std::memory_order_relaxed);
  const uint64_t serial = state / kPhases;
  state = serial * kPhases + at_work;
  const auto ended = serial * kPhases + idle;
  if (state_.compare_exchange_strong(state, ended, std::memory_order_acq_rel)) return false;
  // A watchdog demotes this thread. That happens under `fixed` only, where it goes before this thread and is through in
  // microseconds.
  while (state % kPhases == acting) state = state_.load(std::memory_order_acquire);
  state_.store(ended, std::memory_order_release);
  const bool was_demoted = state % kPhases == demoted;
  if (was_demoted) restore_thread(has_);
  if (Lookout* lookout = lookout_.load(std::memory_order_acquire)) lookout->wake();
  return was_demoted;
}

void JobWatch::overran(int64_t by_ns, int64_t at_ns) {
  const int64_t before_ns = owed_ns(at_ns);
  owed_ns_.store(before_ns + by_ns, std::memory_order_relaxed);
  owed_at_ns_.store(at_ns, std::memory_order_release);
}

int64_t JobWatch::owed_ns(int64_t now_ns) const {
  const int64_t at_ns = owed_at_ns_.load(std::memory_order_acquire);
  return now_ns - at_ns > StolenTime::kWindow_ns ? 0 : owed_ns_.load(std::memory_order_relaxed);
}

TAKT_HOT void JobWatch::falls_asleep() {
  Wake awake = Wake::awake;
  while (!wake_.compare_exchange_weak(awake, Wake::asleep, std::memory_order_acq_rel)) awake = Wake::awake;
}

std::optional<JobWatch::Place> JobWatch::claim_place() {
  Place had = place();
  if (had == Place::moving || !place_.compare_exchange_strong(had, Place::moving, std::memory_order_acq_rel))
    return std::nullopt;
  return had;
}

/// Takes the reservation back once nothing is owed any more. Refused while the kernel has not given its bandwidth back,
/// or the watchdog moves the thread: then after the next job.
void JobWatch::settle_down() {
  if (MonotonicClock().now_ns() < lifted_until_ns_.load(std::memory_order_relaxed)) return;
  const std::optional<Place> had = claim_place();
  if (!had) return;
  const bool back = restore_thread(has_);
  if (!back) refusals_.fetch_add(1, std::memory_order_acq_rel);
  const Place now = back ? Place::own : *had;
  Place moving = Place::moving;  // no longer, if it was rescued meanwhile
  place_.compare_exchange_strong(moving, now, std::memory_order_acq_rel);
}

JobWatch::Running JobWatch::running() const {
  Running seen;
  const uint64_t state = state_.load(std::memory_order_acquire);
  if (state % kPhases == idle) return seen;
  seen.serial = state / kPhases;
  seen.acted = state % kPhases != at_work;
  seen.member = member_.load(std::memory_order_acquire);
  seen.index = index_.load(std::memory_order_acquire);
  seen.release_ns = release_ns_.load(std::memory_order_acquire);
  seen.cpu_limit_ns = cpu_limit_ns_.load(std::memory_order_acquire);
  // If it has ended, the words above may be the next job's already, though that one has no serial yet.
  const uint64_t after = state_.load(std::memory_order_acquire);
  return after / kPhases == seen.serial && after % kPhases != idle ? seen : Running{};
}

int64_t JobWatch::cpu_ns() const {
  timespec used{};
  if (clock_gettime(clock_.load(std::memory_order_acquire), &used) != 0) return -1;
  return int64_t{used.tv_sec} * 1'000'000'000 + used.tv_nsec;
}

bool JobWatch::advance(uint64_t serial, Phase from, Phase to) {
  uint64_t state = serial * kPhases + from;
  return state_.compare_exchange_strong(state, serial * kPhases + to, std::memory_order_acq_rel);
}

bool JobWatch::demote(uint64_t serial) {
  const Phase before = advance(serial, at_work, acting) ? at_work : told;
  if (before == told && !advance(serial, told, acting)) return false;
  const bool done = demote_thread(thread_.load(std::memory_order_acquire));
  state_.store(serial * kPhases + (done ? demoted : before), std::memory_order_release);
  return done;
}

JobWatch::Lift JobWatch::lift(int64_t now_ns, int64_t owed_ns, bool behind) {
  const int thread = thread_.load(std::memory_order_acquire);
  const int64_t runtime_ns = this->runtime_ns();
  if (runtime_ns <= 0) return Lift::refused;
  const std::optional<Place> had = claim_place();
  if (!had) return Lift::refused;
  Wake awake = Wake::awake;
  const bool held = wake_.compare_exchange_strong(awake, Wake::held, std::memory_order_acq_rel);
  const bool may = held && runnable(thread);  // it may sleep in its node
  const bool raised = may && lift_thread(thread, behind ? kLowestPriority : kHighestPriority);
  const bool done = raised || (may && behind && demote_thread(thread));
  const bool slept = done && !runnable(thread);
  if (held) wake_.store(Wake::awake, std::memory_order_release);
  if (done) {
    // One period for each budget that is owed, the one under way, and one to be sure.
    constexpr int64_t kLongest_ns = 30'000'000'000;
    const int64_t lapse_ns = (owed_ns / runtime_ns + 2) * has_.period_ns;
    lifted_until_ns_.store(now_ns + std::min(lapse_ns, kLongest_ns), std::memory_order_release);
  }
  const Place now = !raised ? Place::ordinary : behind ? Place::behind : Place::first;
  place_.store(done ? now : *had, std::memory_order_release);
  return !done ? Lift::refused : slept ? Lift::slept : Lift::done;
}

JobWatch::Lift JobWatch::rescue(int64_t now_ns, bool behind) {
  const int thread = thread_.load(std::memory_order_acquire);
  if (!runnable(thread) || !lift_thread(thread, behind ? kLowestPriority : kHighestPriority)) return Lift::refused;
  lifted_until_ns_.store(now_ns + 2 * has_.period_ns, std::memory_order_release);
  // It runs again already, and may be through with taking its reservation back: what it noted of that is out of date.
  place_.store(behind ? Place::behind : Place::first, std::memory_order_release);
  return runnable(thread) ? Lift::done : Lift::slept;
}

void JobWatch::drop() {
  const std::optional<Place> had = claim_place();
  if (!had) return;
  const bool done = *had != Place::own && demote_thread(thread_.load(std::memory_order_acquire));
  place_.store(done ? Place::ordinary : *had, std::memory_order_release);
}

// In one step: nobody ever waits for a watchdog that only tells. Under `deadline` the workers go before it, so a wait
// could last as long as their budget does.
bool JobWatch::tell(uint64_t serial) { return advance(serial, at_work, told); }

}  // namespace takt
