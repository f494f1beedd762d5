// SPDX-License-Identifier: Apache-2.0
// How long a real-time thread waits for memory next to ordinary threads that allocate: allocations [SECONDS]
// On each CPU an ordinary thread (nice 0 on even ones, 19 on odd ones) takes and frees blocks of 16 B to 64 kB without
// pause, and a hog of SCHED_FIFO 50 preempts it for 10 ms at a time. About every millisecond a job of SCHED_FIFO 80,
// then of SCHED_DEADLINE, takes one such block and frees another: its own, or (across) one that any of the threads
// took. SECONDS (default 8) for each row: with the C library's heap, one arena, and with the program's. Exit 1 if with
// the latter a p99 is above 50 us or a job faults a page in; 77 without the right to real-time policies.
#include <dlfcn.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "rt/memory/job_calls.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/sched/grant.hpp"
#include "rt/time/clock.hpp"

namespace {

using namespace takt;

constexpr int64_t kMs = 1'000'000;
constexpr double kBound_us = 50;

struct Heap {
  const char* name;
  void* (*take)(size_t);
  void (*free)(void*);
};

/// Its own functions, in front of which this program's malloc and free stand.
Heap c_library() {
  void* library = dlopen("libc.so.6", RTLD_NOW | RTLD_NOLOAD);
  Heap heap{"C library", nullptr, nullptr};
  void* take = library != nullptr ? dlsym(library, "malloc") : nullptr;
  void* free = library != nullptr ? dlsym(library, "free") : nullptr;
  std::memcpy(&heap.take, &take, sizeof take);
  std::memcpy(&heap.free, &free, sizeof free);
  return heap;
}

int64_t now_ns() { return MonotonicClock().now_ns(); }

void pause(std::mt19937& random, int64_t from_ns, int64_t to_ns) {
  const timespec rest{0, std::uniform_int_distribution<long>(from_ns, to_ns)(random)};
  nanosleep(&rest, nullptr);
}

struct Calls {
  std::vector<int64_t> take_ns, free_ns;
  uint64_t page_faults = 0;
};

using Slots = std::array<std::atomic<void*>, 512>;

/// A thread that takes a block and frees another: one of its own 64, or one of those that all threads put there.
class User {
 public:
  User(const Heap& heap, Slots* shared, unsigned seed) : heap_(heap), shared_(shared), random_(seed) {}
  ~User() {
    for (void* block : own_) heap_.free(block);
  }
  User(const User&) = delete;
  User& operator=(const User&) = delete;

  void step(Calls* calls = nullptr) {
    const auto bytes = static_cast<size_t>(std::exp2(std::uniform_real_distribution(4.0, 16.0)(random_)));
    const int64_t before = now_ns();
    void* block = heap_.take(bytes);
    const int64_t taken = now_ns();
    if (block == nullptr) std::abort();
    *static_cast<volatile char*>(block) = 1;
    void* old = shared_ != nullptr ? (*shared_)[random_() % shared_->size()].exchange(block)
                                   : std::exchange(own_[random_() % own_.size()], block);
    const int64_t between = now_ns();
    heap_.free(old);
    if (calls == nullptr) return;
    calls->free_ns.push_back(now_ns() - between);
    calls->take_ns.push_back(taken - before);
  }
  std::mt19937& random() { return random_; }

 private:
  const Heap& heap_;
  Slots* shared_;
  std::array<void*, 64> own_{};
  std::mt19937 random_;
};

/// On one CPU, while they live: the ordinary thread, and the hog that preempts it.
class Disturbance {
 public:
  Disturbance(const Heap& heap, Slots* shared, int cpu, std::atomic<bool>& refused)
      : ordinary_([&heap, shared, cpu, this] {
          Reservation any;
          any.core = cpu;
          apply(any);
          if (cpu % 2 == 1) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 19);
          User user(heap, shared, static_cast<unsigned>(cpu));
          while (!end_.load()) user.step();
        }),
        hog_([cpu, &refused, this] {
          if (!apply(fixed_reservation(50, cpu)).verified) refused = true;
          std::mt19937 random(static_cast<unsigned>(cpu));
          while (!end_.load()) {
            pause(random, kMs, 12 * kMs);
            const int64_t until = now_ns() + 10 * kMs;
            while (now_ns() < until && !end_.load()) {
            }
          }
        }) {}
  ~Disturbance() {
    end_ = true;
    ordinary_.join();
    hog_.join();
  }
  Disturbance(const Disturbance&) = delete;
  Disturbance& operator=(const Disturbance&) = delete;

 private:
  std::atomic<bool> end_{false};
  std::thread ordinary_, hog_;
};

/// The job's calls; none if the policy is refused.
Calls measure(const Heap& heap, const Reservation& urgent, bool across, int seconds) {
  Slots slots{};
  Slots* shared = across ? &slots : nullptr;
  Calls calls;
  const auto room = static_cast<size_t>(seconds) * 4000;
  calls.take_ns.reserve(room);
  calls.free_ns.reserve(room);
  {
    std::atomic<bool> refused{false};
    std::vector<std::unique_ptr<Disturbance>> disturbances;
    for (int cpu = 0; cpu < static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN)); ++cpu)
      disturbances.push_back(std::make_unique<Disturbance>(heap, shared, cpu, refused));
    std::thread([&] {
      if (!apply(urgent, 5000 * kMs).verified) return;  // others may have the bandwidth
      JobCalls job;
      job.allowed = bit(JobCall::malloc);
      const JobScope scope(job);
      User user(heap, shared, 99);
      for (int warm = 0; warm < 2000; ++warm) user.step();
      const uint64_t before = thread_memory_use().page_faults;
      for (const int64_t until = now_ns() + seconds * 1000 * kMs; now_ns() < until && !refused.load();) {
        pause(user.random(), kMs / 3, 5 * kMs / 3);
        user.step(&calls);
      }
      calls.page_faults = thread_memory_use().page_faults - before;
    }).join();
    if (refused) calls.take_ns.clear();
  }
  for (std::atomic<void*>& slot : slots) heap.free(slot);
  return calls;
}

/// Sorts them. Prints p50, p99 and maximum, and returns p99, us.
double print(const char* call, std::vector<int64_t>& ns) {
  std::sort(ns.begin(), ns.end());
  const auto at = [&](double share) {
    return static_cast<double>(ns[static_cast<size_t>(share * static_cast<double>(ns.size() - 1))]) * 1e-3;
  };
  std::printf("  %s p50 %5.2f p99 %8.2f max %8.2f us", call, at(0.5), at(0.99), at(1));
  return at(0.99);
}

}  // namespace

int main(int argc, char** argv) {
  const int seconds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 8;
  if (!counting_allocations()) {
    std::puts("NOT RUN: a sanitizer has a heap of its own");
    return 77;
  }
  const ProcessMemory memory = prepare_process_memory();
  for (const std::string& lack : memory.lacks) std::printf("not granted: %s\n", lack.c_str());
  const Heap theirs = c_library();
  // Not std::malloc and std::free by name: the compiler would know what they do.
  const Heap ours{"Takt", [](size_t bytes) { return std::malloc(bytes); }, [](void* block) { std::free(block); }};
  bool good = true;
  for (const auto& [policy, urgent] : {std::pair{"SCHED_FIFO 80", fixed_reservation(80)},
                                       {"SCHED_DEADLINE", deadline_reservation(kMs, 5 * kMs, 10 * kMs)}})
    for (const bool across : {false, true})
      for (const Heap* heap : {&theirs, &ours}) {
        Calls calls = measure(*heap, urgent, across, seconds);
        if (calls.take_ns.empty()) {
          std::puts("NOT RUN: real-time policies are refused to this user");
          return 77;
        }
        std::printf("%-14s %-6s %-9s", policy, across ? "across" : "own", heap->name);
        const double take_us = print("malloc", calls.take_ns), free_us = print("free", calls.free_ns);
        std::printf("  %zu jobs, %llu page faults\n", calls.take_ns.size(),
                    static_cast<unsigned long long>(calls.page_faults));
        std::fflush(stdout);
        if (heap != &ours || (std::max(take_us, free_us) <= kBound_us && (!memory.mlock || calls.page_faults == 0)))
          continue;
        std::printf("FAILED: p99 above %.0f us, or a page fault\n", kBound_us);
        good = false;
      }
  return good ? 0 : 1;
}
