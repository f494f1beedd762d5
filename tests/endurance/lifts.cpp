// SPDX-License-Identifier: Apache-2.0
// What the kernel grants to SCHED_DEADLINE before and after threads were taken out of their reservations: lifts [COUNT]
// At random instants the watchdog's way (JobWatch::lift), COUNT times each (default 1000), of a thread whose jobs
// compute, sleep as Takt does between jobs, or block in read(). Where the kernel forgets the thread (docs/limits.md) it
// is rescued as the watchdog does it. Prints a line for each. Exit 1 if a thread never went on, or bandwidth was lost:
// where a job blocks, if a lift did not tell it, or the command that is told then does not bring it back. 77 without
// the right to SCHED_DEADLINE. Nobody else should take or leave reservations meanwhile.
#include <unistd.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <thread>

#include "rt/memory/memory_use.hpp"
#include "rt/sched/bandwidth.hpp"
#include "rt/sched/grant.hpp"
#include "rt/sched/job_watch.hpp"
#include "rt/sched/watch_rules.hpp"
#include "rt/time/clock.hpp"

namespace {

using namespace takt;

constexpr int64_t kMs = 1'000'000, kPeriod_ns = 20 * kMs;

void pause(int64_t ns) {
  const timespec rest{ns / 1'000'000'000, ns % 1'000'000'000};
  nanosleep(&rest, nullptr);
}

enum class Work : uint8_t { computes, sleeps, reads };

/// A thread with a reservation of 1 ms in 10 that always wants more, and takes it back when it has been lifted.
class Worker {
 public:
  Worker(Work work, int pipe_end) : work_(work), pipe_end_(pipe_end), thread_([this] { run(); }) {
    while (!ready_.load()) pause(kMs);
  }
  ~Worker() { end(); }
  /// False if the thread had to be let go as the supervisor does it (hasten_end).
  bool end() {
    end_.store(true);
    constexpr int kPatience = 500;  // of 10 ms
    for (int waited = 0; !ended_.load() && waited < kPatience; ++waited) {
      pause(10 * kMs);
      rescue_if_forgotten();
    }
    const bool stuck = !ended_.load();
    while (!ended_.load()) {
      take_from_reservation(id_.load());
      pause(10 * kMs);
    }
    if (thread_.joinable()) thread_.join();
    return !stuck;
  }
  bool granted() const { return granted_; }
  JobWatch& watch() { return watch_; }
  int rescues() const { return rescues_; }
  /// To be called often.
  void rescue_if_forgotten() {
    const int64_t now_ns = MonotonicClock().now_ns(), cpu_ns = watch_.cpu_ns();
    if (cpu_ns != stood_cpu_ns_) stood_since_ns_ = now_ns;
    stood_cpu_ns_ = cpu_ns;
    if (now_ns - stood_since_ns_ <= 4 * kPeriod_ns + kForgotten_ns) return;
    rescues_ += watch_.rescue(now_ns, false) != JobWatch::Lift::refused;
    stood_since_ns_ = now_ns;
  }

 private:
  void run() {
    id_.store(gettid());
    has_ = deadline_reservation(kMs, 10 * kMs, kPeriod_ns);
    granted_ = apply(has_).verified;
    watch_.bind(has_);
    ready_.store(true);
    const MonotonicClock clock;
    for (uint64_t job = 0; granted_ && !end_.load(); ++job) {
      watch_.begin(0, job, clock.now_ns(), thread_cpu_ns() + kMs);
      one_job();
      watch_.end();
      watch_.rest(thread_cpu_ns());
      if (work_ != Work::sleeps) continue;
      watch_.falls_asleep();
      pause(2 * kMs);
      watch_.awakes();
    }
    ended_.store(true);
  }
  void one_job() {
    const int64_t until_ns = thread_cpu_ns() + (work_ == Work::computes ? 3 * kMs : kMs / 5);
    while (thread_cpu_ns() < until_ns) {
    }
    char byte = 0;
    if (work_ == Work::reads) static_cast<void>(!read(pipe_end_, &byte, 1));
  }

  const Work work_;
  const int pipe_end_;
  JobWatch watch_;
  Reservation has_;
  bool granted_ = false;
  std::atomic<bool> ready_{false}, end_{false}, ended_{false};
  std::atomic<int> id_{0};
  int64_t stood_cpu_ns_ = -1, stood_since_ns_ = 0;
  int rescues_ = 0;
  std::thread thread_;  // last: it uses all of the above
};

/// A byte every few milliseconds, so that a reader blocks in between.
class Feeder {
 public:
  Feeder() {
    if (pipe(ends_.data()) != 0) std::abort();
    thread_ = std::thread([this] {
      std::mt19937 random(1);
      while (!end_.load()) {
        pause(std::uniform_int_distribution<int64_t>(kMs / 10, 4 * kMs)(random));
        static_cast<void>(!write(ends_[1], "x", 1));
      }
    });
  }
  ~Feeder() {
    end_.store(true);
    thread_.join();
    close(ends_[0]);
    close(ends_[1]);
  }
  int reading_end() const { return ends_[0]; }

 private:
  std::array<int, 2> ends_{};
  std::atomic<bool> end_{false};
  std::thread thread_;
};

struct Lifted {
  int count = 0, rescues = 0;
  int told = 0;        ///< lifts that may have met a sleeping thread, and said so
  bool stuck = false;  ///< it never went on
};

Lifted lift_often(Work work, int count, std::mt19937& random) {
  constexpr int kMostRefused = 2000;  // in a row: some eight seconds
  const Feeder feeder;
  Worker worker(work, feeder.reading_end());
  Lifted lifted;
  for (int i = 0, refused = 0; worker.granted() && lifted.count < count && refused < kMostRefused; ++i) {
    pause(std::uniform_int_distribution<int64_t>(kMs / 10, 8 * kMs)(random));
    const auto lift = worker.watch().lift(MonotonicClock().now_ns(), 0, i % 2 == 0);
    refused = lift == JobWatch::Lift::refused ? refused + 1 : 0;
    lifted.count += lift != JobWatch::Lift::refused;
    lifted.told += lift == JobWatch::Lift::slept;
    worker.rescue_if_forgotten();
  }
  lifted.stuck = !worker.end();
  lifted.rescues = worker.rescues();
  return lifted;
}

constexpr double kShare = 0.1, kCounted = 0.001;  // cores: of a worker, and what is a difference

/// Runs the command that a loss is told with; whether all is free again.
bool counted_anew(double before) {
  std::string command = recount_command() + " >/dev/null";
  command.erase(0, command.find("sysctl"));  // as root already
  return std::system(command.c_str()) == 0 && std::abs(free_bandwidth().value_or(0) - before) < kCounted;
}

/// Prints what became of such lifts; whether that is as docs/limits.md has it.
bool holds(Work work, const char* name, int count, std::mt19937& random) {
  constexpr int64_t kReturned_ns = 100 * kMs;  // by then all that a thread left behind is given back
  const double before = free_bandwidth().value_or(0);
  const Lifted lifted = lift_often(work, count, random);
  pause(kReturned_ns);
  const double after = free_bandwidth().value_or(0), lost = before - after;
  const bool loses = std::abs(lost) >= kCounted, may = work == Work::reads && lost <= lifted.told * kShare + kCounted;
  const bool kept = lifted.count >= count && !lifted.stuck && (!loses || (may && counted_anew(before)));
  std::printf(
      "%-9s %5d lifts: %.4f cores free before, %.4f after; %d may have met a sleeping thread; forgotten and "
      "rescued %d times%s%s\n",
      name, lifted.count, before, after, lifted.told, lifted.rescues, lifted.stuck ? ", once never again" : "",
      !kept   ? "  FAILED"
      : loses ? "; all free again once the kernel counted anew"
              : "");
  return kept;
}

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 1000;
  const Reservation above = fixed_reservation(kHighestPriority + 1);
  if (!apply(above).verified || !free_bandwidth()) {
    std::puts("NOT RUN: real-time policies are refused to this user");
    return 77;
  }
  std::mt19937 random(7);
  bool good = true;
  for (const auto& [work, name] :
       {std::pair{Work::computes, "computes"}, {Work::sleeps, "sleeps"}, {Work::reads, "reads"}})
    good = holds(work, name, count, random) && good;
  return good ? 0 : 1;
}
