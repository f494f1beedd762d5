// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "rt/trace/collector.hpp"
#include "rt/trace/rings.hpp"

using namespace takt::trace;

TEST_CASE("a ring hands events on in order, and counts those that found no room") {
  const auto ring = std::make_unique<Ring>();
  for (size_t i = 0; i < Ring::kEvents + 5; ++i) ring->push({static_cast<int64_t>(i)});
  CHECK(ring->lost() == 5);
  int64_t expected = 0;
  ring->drain([&](const Event& event) { CHECK(event.at_ns == expected++); });
  CHECK(expected == static_cast<int64_t>(Ring::kEvents));
  ring->push({77});
  ring->drain([&](const Event& event) {
    CHECK(event.at_ns == 77);
    ++expected;
  });
  CHECK(expected == static_cast<int64_t>(Ring::kEvents) + 1);
  CHECK(ring->lost() == 5);
}

TEST_CASE("writer and reader at once: every event arrives once and in order, or is counted") {
  Rings rings(1);
  constexpr int64_t kCount = 200'000;
  std::atomic<bool> done{false};
  std::thread writer([&] {
    const Thread traced(&rings, "a thread with a long name");
    REQUIRE(on());
    for (int64_t i = 1; i <= kCount; ++i) record({i, -i});
    done.store(true);
  });
  int64_t last = 0, taken = 0;
  bool in_order = true;
  const auto drain = [&] {
    if (rings.claimed() == 0) return;
    rings.ring(0).drain([&](const Event& event) {
      in_order = in_order && event.at_ns > last && event.value == -event.at_ns;
      last = event.at_ns;
      ++taken;
    });
  };
  while (!done.load()) drain();
  writer.join();
  drain();
  CHECK(in_order);
  CHECK(taken + static_cast<int64_t>(rings.ring(0).lost()) == kCount);
  CHECK(std::string(rings.ring(0).name.data()) == "a thread with a");
}

TEST_CASE("a thread without a ring notes nothing; one too many is counted") {
  Rings rings(1);
  {
    const Thread none(nullptr, "x");
    CHECK_FALSE(on());
  }
  const Thread first(&rings, "first");
  CHECK(on());
  std::thread([&] {
    const Thread second(&rings, "second");
    CHECK_FALSE(on());
    record({1});
  }).join();
  CHECK(rings.claimed() == 1);
  CHECK(rings.refused() == 1);
}

TEST_CASE("what a killed process noted is still there") {
  Rings rings(2);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const Thread traced(&rings, "child");
    level_change(3, 8, 1, 1234);
    record({1300, 2, 0, 0, kNoTask, Kind::mode, 0});
    raise(SIGKILL);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
  REQUIRE(rings.claimed() == 1);
  CHECK(rings.ring(0).writer.load() == child);
  std::vector<Event> events;
  rings.ring(0).drain([&](const Event& event) { events.push_back(event); });
  REQUIRE(events.size() == 2);
  CHECK(events[0].kind == Kind::level);
  CHECK(events[0].task == 3);
  CHECK(events[0].value == 1);
  CHECK(events[1].kind == Kind::mode);
  CHECK(events[1].task == kNoTask);
}

TEST_CASE("who takes a dead thread's ring is another thread of the recording") {
  Rings rings(2);
  Collector collector(rings, {.best = Source::none, .by_caller = true});
  pid_t children[2];
  for (const pid_t& child : children) {
    const auto index = static_cast<uint16_t>(&child - children);
    REQUIRE((children[index] = fork()) >= 0);
    if (child == 0) {
      const Thread traced(&rings, "child");
      level_change(index, 0, 0, 1000 + index);
      raise(SIGKILL);
    }
    REQUIRE(waitpid(child, nullptr, 0) == child);
    collector.drain();
  }
  CHECK(rings.claimed() == 1);
  const Recording recording = collector.finish();
  REQUIRE(recording.threads.size() == 2);
  REQUIRE(recording.events.size() == 2);
  for (size_t i = 0; i < 2; ++i) {
    CHECK(recording.threads[i].id == children[i]);
    CHECK(recording.events[i].thread == children[i]);
    CHECK(recording.events[i].event.task == i);
  }
}
