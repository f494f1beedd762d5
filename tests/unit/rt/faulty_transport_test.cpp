// SPDX-License-Identifier: Apache-2.0
// Each kind of message fault over the local transport: what a reader gets, and what is counted.
#include "rt/faults/faulty_transport.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>

#include "rt/faults/damage.hpp"
#include "rt/memory/aligned_bytes.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/text_status.hpp"
#include "tests/unit/rt/epoch.hpp"

namespace {

using namespace takt;
using namespace takt::faults;
using test::kEpoch, test::kMs;

/// One output of texts and one reader; message n is "n" twenty times, stamped and published n * 10 ms after the epoch.
struct FaultBench {
  std::vector<PortPlan> ports;
  VirtualClock clock{kEpoch};
  std::atomic<int64_t> epoch{kEpoch};
  std::vector<MessageFaultCount> counts;
  std::array<std::atomic<uint64_t>, 1> offered{};
  std::unique_ptr<FaultyTransport> transport;
  std::unique_ptr<Writer> writer;
  std::unique_ptr<Reader> reader;
  uint64_t made = 0;

  explicit FaultBench(std::vector<MessageFault> faults, uint32_t history = 8) : counts(faults.size()) {
    ports.push_back({"node", "text", &MessageType::of<TextStatus>(), {.count = 64}, history, 2, 1});
    const double rate = 100;
    make_room(ports, faults, std::span(&rate, 1));
    transport = std::make_unique<FaultyTransport>(make_local_transport(ports), ports, std::move(faults), clock, epoch,
                                                  counts, offered);
    writer = transport->make_writer(0);
    reader = transport->make_reader(0);
  }
  static int64_t at(uint64_t n) { return kEpoch + static_cast<int64_t>(n) * 10 * kMs; }

  /// False if there was no chunk.
  bool publish() {
    const int64_t now = at(++made);
    clock.advance_to(now);
    MessageHeader* header = writer->loan();
    if (header == nullptr) return false;
    auto* message = reinterpret_cast<TextStatus*>(header + 1);
    for (int i = 0; i < 20; ++i) message->text.push_back(static_cast<char>('0' + made));
    writer->publish(now, now, now);
    return true;
  }
  void publish_to(uint64_t last) {
    while (made < last) CHECK(publish());
  }
  /// What is visible then, oldest first: its first character, its stamp in steps of 10 ms after the epoch.
  std::vector<std::pair<char, int64_t>> seen(int64_t limit_ns = kForever) {
    std::array<Candidate, 64> candidates;
    std::vector<std::pair<char, int64_t>> out;
    for (size_t i = reader->list(limit_ns, candidates); i-- > 0;) {
      Held held = reader->take(candidates[i].sequence);
      const auto* message = static_cast<const TextStatus*>(held.message());
      out.emplace_back(message->text.empty() ? ' ' : message->text[0], (held.stamp_ns - kEpoch) / (10 * kMs));
      reader->release(held);
    }
    return out;
  }
};

/// In the window of messages 2 and 3.
MessageFault fault(MessageFaultKind kind, int64_t by_ns = 0) {
  MessageFault f;
  f.kind = kind;
  f.from_ns = 20 * kMs;
  f.to_ns = 40 * kMs;
  f.by_ns = by_ns;
  f.seed = 1;
  return f;
}

using SeenTexts = std::vector<std::pair<char, int64_t>>;

}  // namespace

TEST_CASE("drop: messages of the window are not there, and are counted") {
  FaultBench bench({fault(MessageFaultKind::drop)});
  bench.publish_to(5);
  CHECK(bench.seen() == SeenTexts{{'1', 1}, {'4', 4}, {'5', 5}});
  CHECK(bench.counts[0].struck == 2);
  CHECK(bench.counts[0].withheld == 2);
  CHECK(bench.offered[0] == 5);
  CHECK(bench.writer->statistics().sent == 3);
  CHECK_MESSAGE(bench.writer->statistics().in_use == 3, "a dropped message gives its chunk back");
}

TEST_CASE("nothing strikes before the run has an epoch") {
  FaultBench bench({fault(MessageFaultKind::drop)});
  bench.epoch = 0;
  bench.publish_to(5);
  CHECK(bench.seen().size() == 5);
  CHECK(bench.counts[0].struck == 0);
}

TEST_CASE("delay: visible that much later, behind its successors") {
  FaultBench bench({fault(MessageFaultKind::delay, 25 * kMs)});
  bench.publish_to(5);
  CHECK(bench.seen(FaultBench::at(4)) == SeenTexts{{'1', 1}, {'4', 4}});
  CHECK(bench.seen(FaultBench::at(2) + 25 * kMs - 1) == SeenTexts{{'1', 1}, {'4', 4}});
  CHECK(bench.seen(FaultBench::at(2) + 25 * kMs) == SeenTexts{{'1', 1}, {'2', 2}, {'4', 4}});
  CHECK(bench.seen(FaultBench::at(3) + 25 * kMs).size() == 5);
  CHECK(bench.counts[0].struck == 2);
}

TEST_CASE("a delayed message is still there when it becomes visible, however long that takes") {
  MessageFault all = fault(MessageFaultKind::delay, 200 * kMs);
  all.from_ns = 0;
  all.to_ns = kForever;
  FaultBench bench({all}, 2);
  for (uint64_t n = 1; n <= 60; ++n) {
    CHECK(bench.publish());
    const SeenTexts seen = bench.seen(FaultBench::at(n));
    if (n > 20) {
      REQUIRE_FALSE(seen.empty());
      CHECK(seen.back().second == static_cast<int64_t>(n - 20));
    }
  }
}

TEST_CASE("duplicate: published twice with one stamp") {
  FaultBench bench({fault(MessageFaultKind::duplicate)});
  bench.publish_to(4);
  CHECK(bench.seen() == SeenTexts{{'1', 1}, {'2', 2}, {'2', 2}, {'3', 3}, {'3', 3}, {'4', 4}});
  CHECK(bench.counts[0].struck == 2);
  CHECK(bench.counts[0].added == 2);
  CHECK(bench.writer->statistics().sent == 6);
}

TEST_CASE("freeze: the first content of the window under new stamps") {
  MessageFault frozen = fault(MessageFaultKind::freeze);
  frozen.to_ns = 50 * kMs;
  FaultBench bench({frozen});
  bench.publish_to(6);
  CHECK(bench.seen() == SeenTexts{{'1', 1}, {'2', 2}, {'2', 3}, {'2', 4}, {'5', 5}, {'6', 6}});
  CHECK_MESSAGE(bench.counts[0].struck == 2, "the first one is as it was");
}

TEST_CASE("reorder: neighbours change places, with their stamps") {
  MessageFault swapped = fault(MessageFaultKind::reorder);
  swapped.to_ns = 50 * kMs;
  FaultBench bench({swapped});
  bench.publish_to(6);
  CHECK(bench.seen() == SeenTexts{{'1', 1}, {'3', 3}, {'2', 2}, {'5', 5}, {'4', 4}, {'6', 6}});
  CHECK(bench.counts[0].struck == 2);
  CHECK(bench.offered[0] + bench.counts[0].added - bench.counts[0].withheld == 6);
}

TEST_CASE("reorder: what is held back at the end of the window follows all the same") {
  MessageFault swapped = fault(MessageFaultKind::reorder);
  swapped.to_ns = 30 * kMs;
  FaultBench bench({swapped});
  bench.publish_to(4);
  CHECK(bench.seen() == SeenTexts{{'1', 1}, {'3', 3}, {'2', 2}, {'4', 4}});
}

TEST_CASE("clock_step: stamps are off in the window, and right again after it") {
  FaultBench bench({fault(MessageFaultKind::clock_step, -50 * kMs)});
  bench.publish_to(4);
  CHECK(bench.seen() == SeenTexts{{'1', 1}, {'2', -3}, {'3', -2}, {'4', 4}});
}

TEST_CASE("truncate: arrays are shorter, never longer") {
  FaultBench bench({fault(MessageFaultKind::truncate)});
  bench.publish_to(4);
  std::array<Candidate, 8> candidates;
  const size_t listed = bench.reader->list(kForever, candidates);
  REQUIRE(listed == 4);
  for (size_t i = 0; i < listed; ++i) {
    Held held = bench.reader->take(candidates[i].sequence);
    const uint32_t size = static_cast<const TextStatus*>(held.message())->text.size;
    const bool struck = held.sequence == 2 || held.sequence == 3;
    CHECK((struck ? size < 20 : size == 20));
    bench.reader->release(held);
  }
  CHECK(bench.counts[0].struck == 2);
}

TEST_CASE("corrupt: content changes, size does not") {
  FaultBench bench({fault(MessageFaultKind::corrupt)});
  bench.publish_to(4);
  std::array<Candidate, 8> candidates;
  const size_t listed = bench.reader->list(kForever, candidates);
  for (size_t i = 0; i < listed; ++i) {
    Held held = bench.reader->take(candidates[i].sequence);
    const auto& text = static_cast<const TextStatus*>(held.message())->text;
    REQUIRE(text.size == 20);
    const auto right = std::count(text.data(), text.data() + 20, static_cast<char>('0' + held.sequence));
    const bool struck = held.sequence == 2 || held.sequence == 3;
    CHECK(right == (struck ? 19 : 20));
    bench.reader->release(held);
  }
}

TEST_CASE("exhaust: once every chunk is held there is none to write into, until the window ends") {
  MessageFault hoarded = fault(MessageFaultKind::exhaust);
  hoarded.to_ns = 300 * kMs;
  FaultBench bench({hoarded});
  uint64_t refused = 0;
  while (bench.made < 29) refused += bench.publish() ? 0 : 1;
  CHECK(refused > 10);
  CHECK(bench.counts[0].struck == refused);
  CHECK(bench.writer->statistics().in_use == bench.ports[0].chunks());
  for (int i = 0; i < 5; ++i) CHECK(bench.publish());
  CHECK(bench.counts[0].struck == refused);
}

TEST_CASE("several faults strike in their order; a withheld message is struck no more") {
  FaultBench bench({fault(MessageFaultKind::drop), fault(MessageFaultKind::duplicate)});
  bench.publish_to(4);
  CHECK(bench.seen() == SeenTexts{{'1', 1}, {'4', 4}});
  CHECK(bench.counts[1].struck == 0);
}

TEST_CASE("a repeated message is dropped and delayed like one of the node's own") {
  FaultBench bench({fault(MessageFaultKind::drop)});
  bench.publish_to(1);
  CHECK_FALSE(bench.writer->repeat(FaultBench::at(2), FaultBench::at(2)));
  CHECK(bench.writer->repeat(FaultBench::at(4), FaultBench::at(4)));
  CHECK(bench.seen() == SeenTexts{{'1', 1}, {'1', 1}});
  CHECK(bench.offered[0] - bench.counts[0].withheld == bench.writer->statistics().sent);
}

TEST_CASE("whether a message is struck depends on seed, port and number alone, and as often as asked") {
  MessageFault half = fault(MessageFaultKind::drop);
  half.probability = 0.5;
  uint64_t struck = 0, differing = 0;
  MessageFault other = half;
  other.seed = 2;
  for (uint64_t n = 1; n <= 10'000; ++n) {
    struck += strikes(half, n) ? 1 : 0;
    differing += strikes(half, n) != strikes(other, n) ? 1 : 0;
    CHECK(strikes(half, n) == strikes(half, n));
  }
  CHECK(struck > 4'800);
  CHECK(struck < 5'200);
  CHECK(differing > 4'000);
  half.probability = 0;
  CHECK_FALSE(strikes(half, 1));
  half.probability = 1;
  CHECK(strikes(half, 1));
}

TEST_CASE("no fault allocates while it strikes") {
  std::vector<MessageFault> all;
  for (const auto kind : {MessageFaultKind::drop, MessageFaultKind::delay, MessageFaultKind::duplicate,
                          MessageFaultKind::corrupt, MessageFaultKind::truncate, MessageFaultKind::freeze,
                          MessageFaultKind::reorder, MessageFaultKind::clock_step, MessageFaultKind::exhaust}) {
    all.push_back(fault(kind));
    all.back().to_ns = kForever;
    all.back().probability = 0.5;
    all.back().seed = all.size();
    if (kind == MessageFaultKind::exhaust) all.back().from_ns = 1'000 * kMs;  // nothing is published after it
  }
  FaultBench bench(all);
  take_thread_use();
  for (int i = 0; i < 200; ++i) bench.publish();
  CHECK(take_thread_use().allocations == 0);
  for (const MessageFaultCount& count : bench.counts) CHECK(count.struck > 0);
}

TEST_CASE("corrupt: beside an array no whole number changes, without one every field does") {
  const Capacity capacity{.width = 16, .height = 4, .channels = 3};
  const MessageType& image_type = MessageType::of<Image>();
  const AlignedBytes memory = aligned_bytes(image_type.bytes(capacity));
  image_type.place(memory.get(), capacity);
  auto* image = reinterpret_cast<Image*>(memory.get());
  image->width = 16;
  image->pixels.resize(192);
  std::fill_n(image->pixels.data(), 192, uint8_t{7});
  CHECK(corrupt(image_type, image, 5));
  CHECK(image->width == 16);
  CHECK(image->pixels.size == 192);
  CHECK(image->pixels.capacity == 192);
  CHECK(std::count(image->pixels.data(), image->pixels.data() + 192, uint8_t{7}) == 189);
  DigitalState lines{0, 0};
  CHECK(corrupt(MessageType::of<DigitalState>(), &lines, 5));
  CHECK(lines.levels != 0);
  CHECK(lines.changed != 0);
  CHECK_FALSE(truncate(MessageType::of<DigitalState>(), &lines, 5));
}
