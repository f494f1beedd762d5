// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <iterator>
#include <memory>
#include <semaphore>
#include <string>
#include <thread>

#include "rt/time/clock.hpp"
#include "rt/trace/switch_source.hpp"

using namespace takt;
using namespace takt::trace;

namespace {

/// Null, and that is said, where the kernel refuses it.
std::unique_ptr<SwitchSource> perf_if_granted() {
  std::string why_not;
  auto source = open_perf(why_not);
  if (!source) MESSAGE("NOT RUN: " << why_not);
  return source;
}

}  // namespace

// Else its last time on a CPU would go on to the end of the recording, and be blamed for what others did there.
TEST_CASE("a thread that ends has no CPU from then on") {
  const auto source = perf_if_granted();
  if (!source) return;
  std::atomic<int32_t> id{0};
  std::binary_semaphore followed{0};
  std::thread thread([&] {
    id = static_cast<int32_t>(gettid());
    id.notify_one();
    followed.acquire();
    usleep(1);  // it is switched from and to once, its last time
  });
  id.wait(0);
  const int32_t ids[] = {id};
  source->follow(ids);
  followed.release();
  thread.join();
  const int64_t ended_ns = MonotonicClock().now_ns();
  Switches switches;
  source->drain(switches);
  source->finish(ended_ns + 1'000'000'000, switches);
  REQUIRE(!switches.slices.empty());
  for (const Slice& slice : switches.slices) {
    CHECK(slice.thread == ids[0]);
    CHECK(slice.to_ns <= ended_ns + 1'000'000);
    CHECK(slice.end != Slice::End::open);
  }
}

TEST_CASE("of a process that was killed nothing stays open") {
  const auto source = perf_if_granted();
  if (!source) return;
  const auto descriptors = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
  };
  const auto before = descriptors();
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    pause();
    _exit(0);
  }
  const int32_t ids[] = {child};
  source->follow(ids);
  Switches switches;
  source->drain(switches);
  CHECK(descriptors() == before + 1);
  REQUIRE(kill(child, SIGKILL) == 0);
  REQUIRE(waitpid(child, nullptr, 0) == child);
  source->drain(switches);
  CHECK(descriptors() == before);
  CHECK(source->lost() == 0);
}
