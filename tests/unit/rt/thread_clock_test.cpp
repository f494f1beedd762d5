// SPDX-License-Identifier: Apache-2.0
// The CPU clock that is mostly read without a system call: as right as the kernel's, whoever takes the CPU meanwhile.
#include "rt/time/thread_clock.hpp"

#include <doctest/doctest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <thread>
#include <vector>

#include "rt/time/clock.hpp"

using namespace takt;

namespace {

/// This thread and all that it starts, on one CPU.
class OneCpu {
 public:
  OneCpu() {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    for (int cpu = 0; CPU_COUNT(&one) == 0; ++cpu)
      if (CPU_ISSET(cpu, &before_)) CPU_SET(cpu, &one);
    sched_setaffinity(0, sizeof one, &one);
  }
  OneCpu(const OneCpu&) = delete;
  OneCpu& operator=(const OneCpu&) = delete;
  ~OneCpu() { sched_setaffinity(0, sizeof before_, &before_); }

 private:
  cpu_set_t before_{};
};

/// How far readings were above the clock that was asked just after them, ns, sorted. What a host takes between two
/// looks reaches some of them.
template <class Meanwhile>
std::vector<int64_t> excesses(int rounds, const Meanwhile& meanwhile) {
  std::vector<int64_t> all;
  for (int round = 0; round < rounds; ++round) {
    const int64_t before = thread_cpu_fast_ns();
    meanwhile();
    const int64_t after = thread_cpu_fast_ns();
    all.push_back(after - thread_cpu_ns());
    CHECK(after >= before);
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

TEST_CASE("thread clock: follows the CPU time of a thread that computes") {
  const auto compute = [] {
    for (int i = 0; i < 3000; ++i) {
      asm volatile("");
    }
  };
  const std::vector<int64_t> off = excesses(2000, compute);
  CHECK(off[off.size() * 9 / 10] <= 0);
  // Behind by what lies between the two readings.
  CHECK(off[off.size() / 2] > -20'000);
}

TEST_CASE("thread clock: what another thread takes meanwhile does not count") {
  const OneCpu one;
  std::atomic<bool> ends{false};
  std::atomic<int> turns{0};
  std::thread other([&] {
    // 10 us a turn: less than the time for which the clock needs no call.
    while (!ends) {
      for (int i = 0; i < 10'000; ++i) {
        asm volatile("");
      }
      ++turns;
      sched_yield();
    }
  });
  const std::vector<int64_t> off = excesses(2000, [] { sched_yield(); });
  ends = true;
  other.join();
  REQUIRE(turns > 100);
  CHECK(off[off.size() * 9 / 10] <= 1000);
}

TEST_CASE("thread clock: begins anew in a child that was forked") {
  while (thread_cpu_fast_ns() < 20'000'000) {
  }
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const int64_t begin = thread_cpu_ns(), first = thread_cpu_fast_ns();
    while (thread_cpu_ns() < begin + 2'000'000) {
    }
    _exit(thread_cpu_fast_ns() >= 2'000'000 && thread_cpu_fast_ns() < first + 15'000'000 ? 0 : 1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  CHECK(status == 0);
}

TEST_CASE("thread clock: each thread has its own, and signals do no harm") {
  static std::atomic<int> signals{0};
  struct sigaction action {
  }, before{};
  action.sa_handler = [](int) { ++signals; };
  sigaction(SIGUSR2, &action, &before);
  std::thread([&] {
    CHECK(thread_cpu_fast_ns() < 1'000'000'000);
    const std::vector<int64_t> off = excesses(2000, [] { raise(SIGUSR2); });
    CHECK(off[off.size() * 9 / 10] <= 1000);
  }).join();
  sigaction(SIGUSR2, &before, nullptr);
  CHECK(signals == 2000);
}
