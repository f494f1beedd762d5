// SPDX-License-Identifier: Apache-2.0
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <csignal>
#include <thread>

#include "rt/machine/child.hpp"
#include "rt/machine/facts.hpp"
#include "rt/machine/measure.hpp"
#include "rt/machine/measure_support.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/sched/grant.hpp"

namespace takt::machine {
namespace {

constexpr int64_t kMs = 1'000'000, kPeriod = 10 * kMs;
constexpr int64_t kPatience = 20'000 * kMs;

struct Answer {
  bool granted = false;
  Spread overrun{};
};

std::optional<Spread> granted(const std::optional<Answer>& answer) {
  return answer && answer->granted && answer->overrun.samples > 0 ? std::optional(answer->overrun) : std::nullopt;
}

/// Spins until the kernel takes the CPU away for longer than any preemption should last; the CPU time used till then.
/// A hole before the budget is used up is somebody else's. The CPU clock is read behind holes only: reading it makes
/// the kernel account the thread, and so enforce the budget, at once.
int64_t spin_until_throttled() {
  constexpr int64_t kThrottled = 2 * kMs, kGiveUp = 500 * kMs;
  const int64_t begin = read_ns(CLOCK_THREAD_CPUTIME_ID), give_up = now_ns() + kGiveUp;
  for (int64_t last = now_ns();;) {
    const int64_t now = now_ns();
    if (now - last > kThrottled || now > give_up) {
      const int64_t used = read_ns(CLOCK_THREAD_CPUTIME_ID) - begin;
      if (used > kEnforcedBudget_ns / 10 * 9 || now > give_up) return used;
    }
    last = now;
  }
}

Answer reservation_overrun() {
  // Samples begin at ever other phases of the tick; between them lies more than a period, so that each has its budget
  // whole (a reservation that wakes up behind its deadline is filled anew).
  constexpr int kSamples = 100;
  constexpr int64_t kRest = 17 * kMs, kStep = 617'000, kTick = 4 * kMs;
  prepare_process_memory();
  Reservation wanted;
  wanted.policy = Policy::deadline;
  wanted.runtime_ns = kEnforcedBudget_ns;
  wanted.deadline_ns = wanted.period_ns = kPeriod;
  Answer answer;
  answer.granted = apply(wanted).verified;
  if (!answer.granted) return answer;
  std::vector<int64_t> overrun;
  for (int i = 0; i < kSamples; ++i) {
    sleep_until(now_ns() + kRest + (i * kStep) % kTick);
    overrun.push_back(spin_until_throttled() - kEnforcedBudget_ns);
  }
  answer.overrun = Spread::of(std::move(overrun));
  return answer;
}

/// The thread that is watched: spins from `go` until `stop`, again and again.
class Spinner {
 public:
  explicit Spinner(int priority) : thread_([this] { work(); }) {
    wait_while(ready_, 0);
    const sched_param param{priority};
    raised_ = pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &param) == 0;
    pthread_getcpuclockid(thread_.native_handle(), &clock_);
  }
  ~Spinner() {
    stop_.store(true);
    set_and_wake(go_, kEnd);
    thread_.join();
  }
  Spinner(const Spinner&) = delete;
  Spinner& operator=(const Spinner&) = delete;

  bool raised() const { return raised_; }
  int64_t used_ns() const { return read_ns(clock_); }
  void set_policy(int policy, int priority) {
    const sched_param param{priority};
    pthread_setschedparam(thread_.native_handle(), policy, &param);
  }
  void start() {
    stop_.store(false);
    ready_.store(0);
    set_and_wake(go_, kSpin);
  }
  void stop_and_wait() {
    stop_.store(true);
    wait_while(ready_, 0);
  }

 private:
  static constexpr uint32_t kWait = 0, kSpin = 1, kEnd = 2;
  void work() {
    while (true) {
      set_and_wake(ready_, 1);
      wait_while(go_, kWait);
      if (go_.load() == kEnd) return;
      go_.store(kWait);
      while (!stop_.load(std::memory_order_relaxed)) {
      }
    }
  }

  std::atomic<uint32_t> ready_{0}, go_{kWait};
  std::atomic<bool> stop_{false};
  std::thread thread_;
  clockid_t clock_{};
  bool raised_ = false;
};

Answer watchdog_overrun() {
  constexpr int kSamples = 300, kWatched = 40, kWatching = 60;
  prepare_process_memory();
  const CpuLatencyHold latency = hold_cpu_dma_latency();
  Answer answer;
  answer.granted = apply(fixed_reservation(kWatching)).policy == Policy::fixed;
  if (!answer.granted) return answer;
  Spinner spinner(kWatched);
  answer.granted = spinner.raised();
  std::vector<int64_t> overrun;
  for (int i = 0; answer.granted && i < kSamples; ++i) {
    const int64_t end = spinner.used_ns() + kEnforcedBudget_ns;
    spinner.start();
    for (int64_t left = kEnforcedBudget_ns; left > 0; left = end - spinner.used_ns()) sleep_until(now_ns() + left);
    spinner.set_policy(SCHED_OTHER, 0);
    overrun.push_back(spinner.used_ns() - end);
    spinner.stop_and_wait();
    spinner.set_policy(SCHED_FIFO, kWatched);
    sleep_until(now_ns() + kMs);  // leaves the CPU to others
  }
  answer.overrun = Spread::of(std::move(overrun));
  return answer;
}

/// The holes that looks make in the time of a thread on the same CPU.
class LookedAt {
 public:
  LookedAt(int looks, int priority, int core)
      : thread_([this, looks, priority, core] { work(looks, priority, core); }) {
    wait_while(ready_, 0);
  }
  ~LookedAt() { thread_.join(); }
  LookedAt(const LookedAt&) = delete;
  LookedAt& operator=(const LookedAt&) = delete;

  bool granted() const { return granted_; }
  void look() {
    static_cast<void>(read_ns(clock_));
    looks_.fetch_add(1, std::memory_order_relaxed);
  }
  /// After the last look.
  std::vector<int64_t> holes_ns() {
    wait_while(ready_, 1);
    return std::move(holes_ns_);
  }

 private:
  void work(int looks, int priority, int core) {
    granted_ = apply(fixed_reservation(priority, core)).verified && pthread_getcpuclockid(pthread_self(), &clock_) == 0;
    holes_ns_.reserve(static_cast<size_t>(looks));
    set_and_wake(ready_, 1);
    int seen = 0;
    // A look between the count and the clock is seen with the next count: its hole is the one before.
    for (int64_t last = now_ns(), hole_before = 0; granted_ && seen < looks;) {
      const int count = looks_.load(std::memory_order_relaxed);
      const int64_t now = now_ns(), hole = now - last;
      if (count != seen) holes_ns_.push_back(std::max(hole, hole_before));
      seen = count;
      hole_before = hole;
      last = now;
    }
    set_and_wake(ready_, 2);
  }

  std::atomic<uint32_t> ready_{0};
  std::atomic<int> looks_{0};
  clockid_t clock_{};
  bool granted_ = false;
  std::vector<int64_t> holes_ns_;
  std::thread thread_;  ///< last: it uses all of the above
};

Answer watchdog_look() {
  constexpr int kSamples = 300, kWatched = 40, kWatching = 60;
  prepare_process_memory();
  const CpuLatencyHold latency = hold_cpu_dma_latency();
  const int core = sched_getcpu();
  Answer answer;
  answer.granted = apply(fixed_reservation(kWatching, core)).verified;
  if (!answer.granted) return answer;
  LookedAt watched(kSamples, kWatched, core);
  answer.granted = watched.granted();
  for (int i = 0; answer.granted && i < kSamples; ++i) {
    sleep_until(now_ns() + kMs);
    watched.look();
  }
  if (answer.granted) answer.overrun = Spread::of(watched.holes_ns());
  return answer;
}

std::atomic<int64_t> g_expired_ns{0};
extern "C" void cpu_timer_expired(int) { g_expired_ns.store(read_ns(CLOCK_THREAD_CPUTIME_ID)); }

Answer cpu_timer_overrun() {
  constexpr int kSamples = 300;
  constexpr int64_t kGiveUp = 200 * kMs;
  prepare_process_memory();
  struct sigaction action {};
  action.sa_handler = cpu_timer_expired;
  sigaction(SIGRTMIN, &action, nullptr);
  sigevent event{};
  event.sigev_notify = SIGEV_SIGNAL;
  event.sigev_signo = SIGRTMIN;
  timer_t timer{};
  Answer answer;
  answer.granted = timer_create(CLOCK_THREAD_CPUTIME_ID, &event, &timer) == 0;
  std::vector<int64_t> overrun;
  for (int i = 0; answer.granted && i < kSamples; ++i) {
    g_expired_ns.store(0);
    const int64_t begin = read_ns(CLOCK_THREAD_CPUTIME_ID), due = begin + kEnforcedBudget_ns;
    itimerspec when{};
    when.it_value.tv_nsec = kEnforcedBudget_ns;
    timer_settime(timer, 0, &when, nullptr);
    while (g_expired_ns.load() == 0 && read_ns(CLOCK_THREAD_CPUTIME_ID) - begin < kGiveUp) {
    }
    overrun.push_back((g_expired_ns.load() == 0 ? read_ns(CLOCK_THREAD_CPUTIME_ID) : g_expired_ns.load()) - due);
  }
  answer.overrun = Spread::of(std::move(overrun));
  return answer;
}

}  // namespace

std::optional<Spread> measure_reservation_overrun() {
  return granted(in_child<Answer>(reservation_overrun, kPatience));
}
std::optional<Spread> measure_watchdog_overrun() { return granted(in_child<Answer>(watchdog_overrun, kPatience)); }
std::optional<Spread> measure_watchdog_look() { return granted(in_child<Answer>(watchdog_look, kPatience)); }
std::optional<Spread> measure_cpu_timer_overrun() { return granted(in_child<Answer>(cpu_timer_overrun, kPatience)); }

}  // namespace takt::machine
