// SPDX-License-Identifier: Apache-2.0
// Whatever the plan of message faults: a reader never sees a message that is torn, one that was not written, or one
// whose arrays are not what they should be; every message is accounted for; the same seed gives the same run.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <random>

#include "rt/faults/faulty_transport.hpp"
#include "rt/msg/text_status.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/property_scale.hpp"

namespace {

using namespace takt;
using namespace takt::faults;
using test::kMs;
constexpr int64_t kEpoch = 1'000 * kMs;
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

/// Message n: the text has 20 + n % 40 characters, all of them 'a' + n % 26; every 17th is discarded.
class Course {
 public:
  explicit Course(const std::vector<MessageFault>& faults)
      : whole_(!has(faults, MessageFaultKind::corrupt)),
        long_enough_(!has(faults, MessageFaultKind::truncate)),
        counts_(faults.size()) {
    const double rate = 100;
    make_room(ports_, faults, std::span(&rate, 1));
    FaultyTransport transport(make_local_transport(ports_), ports_, faults, clock_, epoch_, counts_, handed_over_);
    const auto writer = transport.make_writer(0);
    const auto reader = transport.make_reader(0);
    for (uint64_t n = 1; n <= kMessages; ++n) {
      clock_.advance_to(kEpoch + static_cast<int64_t>(n) * 10 * kMs);
      publish(*writer, n);
      look(*reader);
    }
    CHECK(handed_over_[0] == offered_);
    uint64_t came = offered_, went = writer->statistics().sent;
    for (const MessageFaultCount& count : counts_) {
      came += count.added;
      went += count.withheld;
    }
    CHECK(came == went);
  }
  const Story& story() const { return story_; }
  uint64_t refused() const { return refused_; }

 private:
  void publish(Writer& writer, uint64_t n) {
    MessageHeader* header = writer.loan();
    if (header == nullptr) {
      ++refused_;
      return;
    }
    auto& text = reinterpret_cast<TextStatus*>(header + 1)->text;
    CHECK_MESSAGE(text.empty(), "a loaned message is empty");
    text.resize(20 + n % 40);
    std::fill_n(text.data(), text.size, static_cast<char>('a' + n % 26));
    if (n % 17 == 0) return writer.discard();
    writer.publish(clock_.now_ns(), clock_.now_ns(), clock_.now_ns());
    ++offered_;
  }

  void look(Reader& reader) {
    std::array<Candidate, 4> candidates;
    std::array<Held, 4> held;
    const size_t listed = reader.list(clock_.now_ns(), candidates);
    for (size_t i = 0; i < listed; ++i) {
      CHECK(candidates[i].visible_at_ns <= clock_.now_ns());
      held[i] = reader.take(candidates[i].sequence);
      if (held[i]) examine(held[i]);
    }
    for (Held& message : held) reader.release(message);
  }

  void examine(const Held& held) {
    const auto& text = static_cast<const TextStatus*>(held.message())->text;
    REQUIRE(text.capacity == 64);
    REQUIRE(text.size <= 64);
    if (long_enough_) CHECK(text.size >= 20);
    if (whole_) REQUIRE(std::count(text.data(), text.data() + text.size, text[0]) == text.size);
    story_.push_back({static_cast<int64_t>(held.sequence), held.stamp_ns, int64_t{text.size},
                      text.empty() ? int64_t{0} : int64_t{text[0]}});
  }

  const bool whole_, long_enough_;
  std::vector<PortPlan> ports_{{"node", "text", &MessageType::of<TextStatus>(), {.count = 64}, 6, 3, 1}};
  VirtualClock clock_{kEpoch};
  const std::atomic<int64_t> epoch_{kEpoch};
  std::vector<MessageFaultCount> counts_;
  Story story_;
  std::array<std::atomic<uint64_t>, 1> handed_over_{};
  uint64_t offered_ = 0, refused_ = 0;
};

}  // namespace

TEST_CASE("random plans of message faults: readers see whole messages, and nothing is unaccounted for") {
  std::mt19937_64 random(test::seed(31));
  uint64_t seen = 0, refused = 0;
  for (int i = 0; i < test::rounds(300); ++i) {
    const auto plan = random_plan(random);
    CAPTURE(i);
    const Course course(plan);
    CHECK(Course(plan).story() == course.story());
    seen += course.story().size();
    refused += course.refused();
    if (!has(plan, MessageFaultKind::exhaust)) CHECK(course.refused() == 0);
  }
  CHECK(seen >= test::at_scale(100'000));
  CHECK(refused >= test::at_scale(1));
}
