// SPDX-License-Identifier: Apache-2.0
// Stops and modes that the processes of a run ask for, each in words of its own; stray stores into them.
#include <doctest/doctest.h>

#include <cstring>
#include <memory>
#include <random>

#include "rt/sched/modes.hpp"
#include "rt/sched/stop_signal.hpp"

using namespace takt;

namespace {

constexpr int64_t kNever = std::numeric_limits<int64_t>::max();
constexpr size_t kProcesses = 3;

/// The modes of a run as its supervisor and its processes see them.
struct SharedModes {
  ModeLog log;
  std::array<ModeRequests, kProcesses> requests;
  std::array<EnteredRequests, kProcesses> entered;
  Modes supervisor{log, words(requests), words(entered)};
  std::array<Modes, kProcesses> of{Modes{log, words(requests), words(entered)},
                                   Modes{log, words(requests), words(entered)},
                                   Modes{log, words(requests), words(entered)}};
  SharedModes() {
    for (size_t p = 0; p < kProcesses; ++p) of[p].speak_as(p);
  }
  template <class T>
  static std::vector<T*> words(std::array<T, kProcesses>& of_each) {
    std::vector<T*> all;
    for (T& one : of_each) all.push_back(&one);
    return all;
  }
};

}  // namespace

TEST_CASE("whatever the supervisor has entered yet, every process sees the same modes") {
  std::mt19937 random(17);
  for (int round = 0; round < 30; ++round) {
    const auto shared = std::make_unique<SharedModes>();
    int64_t now = 1000;
    for (int step = 0; step < 60; ++step) {
      now += random() % 100;
      const uint32_t mode = random() % 4;
      const size_t who = random() % (kProcesses + 1);
      Modes& asks = who == kProcesses ? shared->supervisor : shared->of[who];
      const int64_t lead = static_cast<int64_t>(random() % 3) * 50;
      const bool done =
          random() % 2 == 0 ? asks.request(mode, now + lead, "person") : asks.request_by_rule(mode, now + lead, "rule");
      CHECK(done);
      CHECK(asks.newest() == mode);
      CHECK(asks.in_force().mode == mode);
      const ModeInForce before = shared->supervisor.in_force();
      std::vector<uint32_t> seen;
      for (int64_t at = 900; at < now + 200; at += 7) seen.push_back(shared->supervisor.at(at));
      const auto same = [&](const Modes& other) {
        const ModeInForce after = other.in_force();
        CHECK(after.mode == before.mode);
        CHECK(after.origin == before.origin);
        CHECK(after.before == before.before);
        size_t i = 0;
        for (int64_t at = 900; at < now + 200; at += 7) REQUIRE(other.at(at) == seen[i++]);
        int64_t covered = 900;
        other.for_each_part(900, now + 200, [&](uint32_t part, int64_t from_ns, int64_t to_ns) {
          CHECK(from_ns == covered);
          covered = to_ns;
          CHECK(other.at(from_ns) == part);
          CHECK(other.at(to_ns - 1) == part);
        });
        CHECK(covered == now + 200);
      };
      for (const Modes& other : shared->of) same(other);
      if (random() % 3 > 0) continue;
      shared->supervisor.gather();
      same(shared->supervisor);
      for (const Modes& other : shared->of) same(other);
    }
  }
}

TEST_CASE("a safe stop that is asked for at the same time as a rule's mode stays") {
  for (const bool entered_first : {false, true}) {
    const auto shared = std::make_unique<SharedModes>(), other = std::make_unique<SharedModes>();
    REQUIRE(other->of[0].request_by_rule(1, 1000, "camera lost"));  // does not know of what is asked for here
    REQUIRE(shared->of[1].request(3, 1001, "guard: deadline missed"));
    if (entered_first) shared->supervisor.gather();
    std::memcpy(static_cast<void*>(&shared->requests[0]), &other->requests[0], sizeof(ModeRequests));
    CHECK(shared->of[2].at(5000) == 3);
    shared->supervisor.gather();
    CHECK(shared->of[2].at(5000) == 3);
    CHECK(shared->log.size() == (entered_first ? 1 : 2));
  }
}

TEST_CASE("stray stores into a process's words ask for no mode and no stop") {
  std::mt19937_64 random(3);
  const auto shared = std::make_unique<SharedModes>();
  REQUIRE(shared->of[0].request(2, 1000, "asked"));
  shared->supervisor.gather();
  StopWord first, second;
  StopSignal stop({&first, &second});
  stop.set_planned_end(90'000);
  for (int round = 0; round < 10'000; ++round) {
    for (ModeRequests::Request& request : shared->requests[1].requests) {
      request.word.store(random());
      request.from_ns.store(static_cast<int64_t>(random() % 10'000));
    }
    shared->requests[1].count.store(random());
    second.asked.store(random() | 1);
    if (round % 100 == 0) shared->supervisor.gather();
    REQUIRE(shared->of[0].at(5000) == 2);
    // One store in 65,536 passes for an instant, and that is as good as never one before the planned end.
    REQUIRE(stop.end_ns() == 90'000);
  }
  CHECK(shared->log.size() == 1);
  CHECK(shared->of[1].request(3, 2000, "asked"));  // over what the store left
  CHECK(shared->supervisor.at(3000) == 3);
  stop.speak_as(1);
  stop.raise(50'500);
  CHECK(stop.end_ns() == 50'000);
  stop.raise(70'000);
  CHECK(stop.end_ns() == 50'000);
}

TEST_CASE("a stop of one process is seen by all; the end that was planned is the first one's") {
  StopWord first, second;
  StopSignal one({&first, &second}), two({&first, &second});
  two.speak_as(1);
  CHECK(one.end_ns() == kNever);
  two.set_planned_end(5'000);
  CHECK(one.end_ns() == kNever);
  one.set_planned_end(9'000'000);
  CHECK(two.end_ns() == 9'000'000);
  two.raise(4'000'999);
  CHECK(one.end_ns() == 4'000'000);
  one.raise(3'000'000);
  CHECK(two.end_ns() == 3'000'000);
}
