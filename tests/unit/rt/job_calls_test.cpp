// SPDX-License-Identifier: Apache-2.0
#include "rt/memory/job_calls.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <mutex>
#include <string>
#include <thread>

#include "rt/memory/sanitized.hpp"
#include "tests/unit/rt/offences.hpp"

using namespace takt;
using namespace takt::test;

namespace {

struct Watched {
  std::array<uint64_t, kJobCalls> counts{};
  JobCalls calls;
  Watched() {
    calls.node = "tested";
    calls.counts = counts.data();
  }
  uint64_t count(JobCall call) const { return counts[static_cast<size_t>(call)]; }
  uint64_t total() const {
    uint64_t sum = 0;
    for (const uint64_t count : counts) sum += count;
    return sum;
  }
};

/// Only a program under a sanitizer may be blind.
bool cannot_watch() {
#if defined(TAKT_SANITIZED)
  MESSAGE("NOT RUN: under a sanitizer this program does not see calls");
  return true;
#else
  REQUIRE(watching_job_calls());
  return false;
#endif
}

/// What a process says that makes this call in a strict job, and is ended for it.
std::string last_words_of_strict_job(const Offence& offence) {
  std::array<int, 2> ends{};
  REQUIRE(pipe(ends.data()) == 0);
  std::fflush(nullptr);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    signal(SIGABRT, SIG_DFL);
    dup2(ends[1], STDERR_FILENO);
    Watched watched;
    watched.calls.strict = true;
    const JobScope scope(watched.calls);
    offence.make();
    _exit(0);
  }
  close(ends[1]);
  std::string said;
  std::array<char, 256> part{};
  for (ssize_t got = 0; (got = read(ends[0], part.data(), part.size())) > 0;)
    said.append(part.data(), static_cast<size_t>(got));
  close(ends[0]);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
  CHECK(WTERMSIG(status) == SIGABRT);
  return said;
}

void sleep_a_moment() {
  const timespec moment{0, 1000};
  nanosleep(&moment, nullptr);
}

}  // namespace

TEST_CASE("each kind of call is counted inside a job and not outside") {
  if (cannot_watch()) return;
  Watched watched;
  std::mutex mutex;
  std::condition_variable condition;
  FILE* null = std::fopen("/dev/null", "w");
  REQUIRE(null != nullptr);
  const auto calls = [&] {
    call_free(call_malloc(10));
    void* block = mmap(nullptr, 4096, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    munmap(block, 4096);
    const int file = open("/dev/null", O_WRONLY);
    const bool written = write(file, "x", 1) == 1;
    close(file);
    std::fputs("x", null);
    std::fprintf(null, "%d %s", 1, "x");
    close(socket(AF_UNIX, SOCK_STREAM, 0));
    sleep_a_moment();
    sched_yield();
    std::unique_lock lock(mutex);
    condition.wait_for(lock, std::chrono::microseconds(10));
    return written;
  };
  calls();
  CHECK(watched.total() == 0);
  bool written = false;
  {
    const JobScope scope(watched.calls);
    written = calls();
  }
  CHECK(written);
  CHECK(watched.count(JobCall::malloc) == 1);
  CHECK(watched.count(JobCall::mmap) == 2);
  CHECK(watched.count(JobCall::file) == 4);
  CHECK(watched.count(JobCall::stdio) == 2);
  CHECK(watched.count(JobCall::socket) == 1);
  CHECK(watched.count(JobCall::sleep) == 2);
  CHECK(watched.count(JobCall::wait) == 1);
  CHECK(watched.count(JobCall::lock) == 0);
  CHECK(watched.count(JobCall::thread) == 0);
  const uint64_t before = watched.total();
  calls();
  CHECK(watched.total() == before);
  std::fclose(null);
}

TEST_CASE("a mutex counts only if the job would have to wait for it; threads of others are not the job's") {
  if (cannot_watch()) return;
  Watched watched;
  std::mutex mutex;
  std::atomic<bool> held{false};
  std::thread other([&] {
    const std::lock_guard lock(mutex);
    call_free(call_malloc(10));
    held.store(true);
    while (watched.count(JobCall::lock) == 0) std::this_thread::yield();
  });
  while (!held.load()) std::this_thread::yield();
  {
    const JobScope scope(watched.calls);
    const std::lock_guard lock(mutex);
  }
  other.join();
  CHECK(watched.count(JobCall::lock) == 1);
  {
    const JobScope scope(watched.calls);
    const std::lock_guard lock(mutex);
  }
  CHECK(watched.total() == 1);
  {
    const JobScope scope(watched.calls);
    pthread_t thread{};
    const int made = pthread_create(
        &thread, nullptr, [](void*) -> void* { return nullptr; }, nullptr);
    if (made == 0) pthread_join(thread, nullptr);
  }
  CHECK(watched.count(JobCall::thread) == 1);
  CHECK(watched.count(JobCall::wait) == 1);
}

TEST_CASE("what a node declares, and the first jobs, are not counted") {
  if (cannot_watch()) return;
  Watched watched;
  watched.calls.allowed = bit(JobCall::sleep);
  {
    const JobScope scope(watched.calls);
    sleep_a_moment();
  }
  CHECK(watched.total() == 0);
  watched.calls.allowed = bit(JobCall::file);
  watched.calls.warm = true;
  {
    const JobScope scope(watched.calls);
    sleep_a_moment();
  }
  CHECK(watched.total() == 0);
}

TEST_CASE("a job gets no more memory than its node may have, and what it gives back counts again") {
  if (cannot_watch()) return;
  Watched watched;
  watched.calls.heap_limit = 1'000'000;
  void *kept = nullptr, *refused = nullptr, *mapped = nullptr, *overflow = nullptr, *grown = nullptr, *again = nullptr;
  {
    const JobScope scope(watched.calls);
    kept = call_malloc(600'000);
    refused = call_malloc(600'000);
    mapped = mmap(nullptr, 600'000, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    overflow = call_calloc(SIZE_MAX / 2, 4);
    grown = call_realloc(kept, 2'000'000);
    call_free(kept);
    again = call_malloc(900'000);
    call_free(again);
  }
  CHECK(kept != nullptr);
  CHECK(refused == nullptr);
  CHECK(mapped == MAP_FAILED);
  CHECK(overflow == nullptr);
  CHECK(grown == nullptr);
  CHECK(again != nullptr);
  CHECK(watched.calls.heap_bytes == 0);
  CHECK(watched.calls.heap_refused > 1'200'000);
  call_free(call_malloc(2'000'000));  // outside of jobs there is no bound
}

TEST_CASE("every call that no job should make is counted, and ends a strict job, by its name") {
  if (cannot_watch()) return;
  const Offences offences;
  for (const Offence& offence : offences.all) {
    CAPTURE(offence.name);
    Watched watched;
    {
      const JobScope scope(watched.calls);
      offence.make();
    }
    CHECK(watched.count(offence.kind) == 1);
    const std::string said = last_words_of_strict_job(offence);
    const std::string wanted =
        "node tested called " + std::string(offence.name) + " (" + std::string(to_string(offence.kind)) + ") in job 0";
    CHECK_MESSAGE(said.find(wanted) != std::string::npos, said);
  }
}
