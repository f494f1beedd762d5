// SPDX-License-Identifier: Apache-2.0
// Whatever the plan of message faults: a reader never sees a message that is torn, one that was not written, or one
// whose arrays are not what they should be; every message is accounted for; the same seed gives the same run.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <random>

#include "rt/faults/faulty_transport.hpp"
#include "rt/msg/messages.hpp"

namespace {

using namespace takt;
using namespace takt::faults;
constexpr int64_t kMs = 1'000'000, kEpoch = 1'000 * kMs;
constexpr uint64_t kMessages = 150;

std::vector<MessageFault> random_plan(std::mt19937_64& random) {
  std::vector<MessageFault> plan(1 + random() % 5);
  for (MessageFault& fault : plan) {
    fault.kind = static_cast<MessageFaultKind>(random() % 9);
    fault.from_ns = static_cast<int64_t>(random() % 1'000) * kMs;
    fault.to_ns = fault.from_ns + static_cast<int64_t>(1 + random() % 800) * kMs;
    fault.probability = static_cast<double>(random() % 5) / 4;
    fault.by_ns = static_cast<int64_t>(random() % 100) * kMs;
    fault.seed = random();
  }
  return plan;
}

bool has(const std::vector<MessageFault>& plan, MessageFaultKind kind) {
  return std::any_of(plan.begin(), plan.end(), [&](const MessageFault& fault) { return fault.kind == kind; });
}

/// What readers saw, in order: sequence, stamp, length, first character.
using Story = std::vector<std::array<int64_t, 4>>;

struct Course {
  Story story;
  uint64_t refused = 0;
};

/// Message n: the text has 20 + n % 40 characters, all of them 'a' + n % 26.
Course run(const std::vector<MessageFault>& faults) {
  std::vector<PortPlan> ports{{"node", "text", &MessageType::of<TextStatus>(), {.count = 64}, 6, 3, 1}};
  const double rate = 100;
  make_room(ports, faults, std::span(&rate, 1));
  VirtualClock clock(kEpoch);
  const std::atomic<int64_t> epoch{kEpoch};
  std::vector<MessageFaultCount> counts(faults.size());
  FaultyTransport transport(make_local_transport(ports), ports, faults, clock, epoch, counts);
  const auto writer = transport.make_writer(0);
  const auto reader = transport.make_reader(0);
  const bool whole = !has(faults, MessageFaultKind::corrupt), long_enough = !has(faults, MessageFaultKind::truncate);
  Course course;
  uint64_t offered = 0;
  for (uint64_t n = 1; n <= kMessages; ++n) {
    const int64_t now = kEpoch + static_cast<int64_t>(n) * 10 * kMs;
    clock.advance_to(now);
    if (MessageHeader* header = writer->loan()) {
      auto& text = reinterpret_cast<TextStatus*>(header + 1)->text;
      CHECK_MESSAGE(text.empty(), "a loaned message is empty");
      text.resize(20 + n % 40);
      std::fill_n(text.data(), text.size, static_cast<char>('a' + n % 26));
      if (n % 17 == 0) {
        writer->discard();
      } else {
        writer->publish(now, now, now);
        ++offered;
      }
    } else {
      ++course.refused;
    }
    std::array<Candidate, 4> candidates;
    std::array<Held, 4> held;
    const size_t listed = reader->list(now, candidates);
    for (size_t i = 0; i < listed; ++i) {
      CHECK(candidates[i].visible_at_ns <= now);
      held[i] = reader->take(candidates[i].sequence);
      if (!held[i]) continue;
      const auto& text = static_cast<const TextStatus*>(held[i].message())->text;
      REQUIRE(text.capacity == 64);
      REQUIRE(text.size <= 64);
      if (long_enough) CHECK(text.size >= 20);
      if (whole)
        for (const char c : text.items()) REQUIRE(c == text[0]);
      course.story.push_back({static_cast<int64_t>(held[i].sequence), held[i].stamp_ns, int64_t{text.size},
                              text.empty() ? int64_t{0} : int64_t{text[0]}});
    }
    for (Held& message : held)
      if (message) reader->release(message);
  }
  uint64_t came = transport.offered(0), went = writer->statistics().sent;
  CHECK(came == offered);
  for (const MessageFaultCount& count : counts) {
    came += count.added;
    went += count.withheld;
  }
  CHECK(came == went);
  return course;
}

}  // namespace

TEST_CASE("random plans of message faults: readers see whole messages, and nothing is unaccounted for") {
  std::mt19937_64 random(31);
  uint64_t seen = 0, refused = 0;
  for (int i = 0; i < 300; ++i) {
    const auto plan = random_plan(random);
    CAPTURE(i);
    const Course course = run(plan);
    CHECK(run(plan).story == course.story);
    seen += course.story.size();
    refused += course.refused;
    if (!has(plan, MessageFaultKind::exhaust)) CHECK(course.refused == 0);
  }
  CHECK(seen > 100'000);
  CHECK(refused > 0);
}
