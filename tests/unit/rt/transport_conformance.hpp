// SPDX-License-Identifier: Apache-2.0
// What every transport promises, checked through the interface only. A back end runs all of it with
//   auto transport = make_...(takt::test::conformance_ports()); takt::test::transport_conformance(*transport);
#pragma once
#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "rt/msg/image.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/shm/transport.hpp"

namespace takt::test {

constexpr int64_t kEver = std::numeric_limits<int64_t>::max();

/// One output for each check, so that one transport (and one daemon start) serves them all.
enum ConformancePort : size_t {
  basic,
  limits,
  eviction,
  slow,
  greedy,
  repeats,
  many_repeats,
  discarding,
  late,
  model_1,
  model_5,
  deep,
  stress,
  conformance_port_count
};

inline PortPlan conformance_port(const char* name, uint32_t history, uint32_t held, uint32_t readers) {
  return {"node", name, &MessageType::of<Image>(), {.width = 16, .height = 4, .channels = 3}, history, held, readers};
}

inline std::vector<PortPlan> conformance_ports() {
  std::vector<PortPlan> ports(conformance_port_count);
  ports[basic] = conformance_port("basic", 2, 1, 1);
  ports[limits] = conformance_port("limits", 4, 1, 1);
  ports[eviction] = conformance_port("eviction", 3, 0, 1);
  ports[slow] = conformance_port("slow", 2, 3, 3);
  ports[greedy] = conformance_port("greedy", 1, 1, 1);
  ports[repeats] = conformance_port("repeats", 3, 2, 1);
  ports[many_repeats] = conformance_port("many_repeats", 1, 2, 1);
  ports[discarding] = conformance_port("discarding", 2, 1, 1);
  ports[late] = conformance_port("late", 4, 1, 2);
  ports[model_1] = conformance_port("model_1", 1, 2, 2);
  ports[model_5] = conformance_port("model_5", 5, 4, 2);
  ports[deep] = conformance_port("deep", 40, 1, 1);
  ports[stress] = conformance_port("stress", 3, 2, 2);
  // Unequal sizes too: twice as large, and one so small that it is nothing but a header.
  ports[slow].capacity.width = 640;
  ports[slow].capacity.height = 480;
  ports[late].type = &MessageType::of<Odometry>();
  ports[late].capacity = {};
  return ports;
}

/// Fills the loaned image with a value that its readers can check.
inline Image* fill(MessageHeader* header, uint64_t value) {
  REQUIRE(header != nullptr);
  auto* image = reinterpret_cast<Image*>(header + 1);
  image->width = static_cast<int32_t>(value);
  image->pixels.resize(image->pixels.capacity);
  std::memset(image->pixels.data(), static_cast<int>(value & 0xff), image->pixels.size);
  return image;
}

inline bool intact(const Held& held, uint64_t value) {
  const auto* image = static_cast<const Image*>(held.message());
  if (image->width != static_cast<int32_t>(value) || image->pixels.size != image->pixels.capacity) return false;
  for (uint8_t pixel : image->pixels.items())
    if (pixel != (value & 0xff)) return false;
  return true;
}

inline void publish(Writer& writer, uint64_t value, int64_t stamp_ns, int64_t visible_at_ns) {
  fill(writer.loan(), value);
  writer.publish(stamp_ns, stamp_ns, visible_at_ns);
}

inline std::vector<Candidate> listed(Reader& reader, int64_t limit_ns, size_t most = 64) {
  std::vector<Candidate> out(most);
  out.resize(reader.list(limit_ns, out));
  return out;
}

inline std::vector<uint64_t> sequences(Reader& reader, int64_t limit_ns, size_t most = 64) {
  std::vector<uint64_t> out;
  for (const Candidate& candidate : listed(reader, limit_ns, most)) out.push_back(candidate.sequence);
  return out;
}

using Sequences = std::vector<uint64_t>;

constexpr uint64_t kAcrossProcesses = 50;

/// One side of a test with two processes: publishes 50 messages, each after the one before was acknowledged. False if
/// the pool ran empty: for the exit code, because nobody counts the checks of a forked process.
[[nodiscard]] inline bool publish_until_acknowledged(Transport& transport) {
  const auto writer = transport.make_writer(basic);
  const auto acknowledged = transport.make_reader(limits);
  for (uint64_t i = 1; i <= kAcrossProcesses; ++i) {
    publish(*writer, i, static_cast<int64_t>(i), 0);
    while (listed(*acknowledged, kEver).empty() || listed(*acknowledged, kEver)[0].sequence < i)
      std::this_thread::yield();
  }
  return writer->statistics().pool_empty == 0;
}

/// The other side. What a writer has published goes with it, so the one returned must outlive the other process.
[[nodiscard]] inline std::unique_ptr<Writer> take_and_acknowledge(Transport& transport) {
  const auto reader = transport.make_reader(basic);
  auto writer = transport.make_writer(limits);
  for (uint64_t i = 1; i <= kAcrossProcesses; ++i) {
    Held held;
    while (!held) {
      std::array<Candidate, 1> newest;
      if (reader->list(kEver, newest) == 1 && newest[0].sequence == i) held = reader->take(i);
      if (!held) std::this_thread::yield();
    }
    CHECK(intact(held, i));  // take() has compared its place in shared memory with that of the loan
    reader->release(held);
    publish(*writer, i, 0, 0);
  }
  return writer;
}

inline void check_basic(Transport& transport) {
  auto writer = transport.make_writer(basic);
  auto reader = transport.make_reader(basic);
  CHECK(listed(*reader, kEver).empty());
  CHECK_FALSE(reader->take(1));

  MessageHeader* loaned = writer->loan();
  REQUIRE(loaned != nullptr);
  CHECK(reinterpret_cast<uintptr_t>(loaned) % 64 == 0);
  auto* image = reinterpret_cast<Image*>(loaned + 1);
  CHECK(image->pixels.size == 0);
  CHECK(image->pixels.capacity == 16 * 4 * 3);
  CHECK(writer->loan() == nullptr);  // one at a time: whoever floods an output takes no more of its pool
  CHECK_MESSAGE(listed(*reader, kEver).empty(), "a loaned message must not be seen before it is published");
  fill(loaned, 7);
  writer->publish(11, 12, 13);

  const auto candidates = listed(*reader, kEver);
  REQUIRE(candidates.size() == 1);
  CHECK(candidates[0].sequence == 1);
  CHECK(candidates[0].stamp_ns == 11);
  CHECK(candidates[0].visible_at_ns == 13);
  Held held = reader->take(1);
  REQUIRE(held);
  CHECK_MESSAGE(held.header == loaned, "the message must lie where it was written");
  CHECK(held.header->stamp_ns == 11);
  CHECK(held.header->published_ns == 12);
  CHECK(held.header->visible_at_ns == 13);
  CHECK(held.header->sequence == 1);
  CHECK(intact(held, 7));
  reader->release(held);
  CHECK_FALSE(held);
  CHECK_FALSE(reader->take(2));
  CHECK(writer->statistics().sent == 1);
  CHECK(writer->statistics().pool_empty == 1);  // the second loan above
}

inline void check_limits(Transport& transport) {
  auto reader = transport.make_reader(limits);
  auto writer = transport.make_writer(limits);
  for (uint64_t i = 1; i <= 3; ++i) publish(*writer, i, static_cast<int64_t>(i), static_cast<int64_t>(100 * i));
  CHECK(sequences(*reader, 99).empty());
  CHECK(sequences(*reader, 100) == Sequences{1});
  CHECK(sequences(*reader, 299) == Sequences{2, 1});
  CHECK(sequences(*reader, 300) == Sequences{3, 2, 1});
  CHECK(sequences(*reader, 300, 2) == Sequences{3, 2});
  // Nothing is lost by having been asked for too early.
  CHECK(sequences(*reader, 100) == Sequences{1});
  // A later message may become visible before an earlier one.
  publish(*writer, 4, 4, 50);
  CHECK(sequences(*reader, 50) == Sequences{4});
  CHECK(sequences(*reader, 100) == Sequences{4, 1});
}

inline void check_eviction(Transport& transport) {
  auto writer = transport.make_writer(eviction);
  auto reader = transport.make_reader(eviction);
  for (uint64_t i = 1; i <= 10; ++i) publish(*writer, i, 0, 0);
  CHECK(sequences(*reader, kEver) == Sequences{10, 9, 8});
  CHECK_FALSE(reader->take(7));
  // What becomes visible late has to be among the kept ones to be seen at all.
  publish(*writer, 11, 0, 1000);
  publish(*writer, 12, 0, 1000);
  publish(*writer, 13, 0, 1000);
  CHECK(sequences(*reader, 10).empty());
  CHECK(sequences(*reader, 1000) == Sequences{13, 12, 11});
  CHECK(writer->statistics().in_use <= 3);
}

inline void check_slow_readers(Transport& transport) {
  auto writer = transport.make_writer(slow);
  auto a = transport.make_reader(slow), b = transport.make_reader(slow), c = transport.make_reader(slow);
  publish(*writer, 1, 0, 0);
  CHECK(sequences(*a, kEver) == Sequences{1});
  Held first = a->take(1);
  publish(*writer, 2, 0, 0);
  publish(*writer, 3, 0, 0);
  CHECK(sequences(*b, kEver) == Sequences{3, 2});
  Held second = b->take(2);
  // a and b now sleep on what they hold, c never asks at all: a writer that starved or waited would fail here.
  for (uint64_t i = 4; i <= 300; ++i) publish(*writer, i, 0, 0);
  CHECK(writer->statistics().pool_empty == 0);
  REQUIRE(first);
  REQUIRE(second);
  CHECK(intact(first, 1));
  CHECK(intact(second, 2));
  a->release(first);
  b->release(second);
  for (Reader* reader : {a.get(), b.get(), c.get()}) CHECK(sequences(*reader, kEver) == Sequences{300, 299});
  CHECK_MESSAGE(writer->statistics().in_use <= 2, "only the kept messages may still be in use");
}

inline void check_greedy_reader(Transport& transport) {
  auto writer = transport.make_writer(greedy);
  auto reader = transport.make_reader(greedy);
  std::vector<Held> held;
  std::vector<uint64_t> values;
  uint64_t published = 0;
  for (uint64_t i = 1; i <= 20; ++i) {
    MessageHeader* loaned = writer->loan();
    if (loaned == nullptr) break;
    fill(loaned, i);
    writer->publish(0, 0, 0);
    ++published;
    for (uint64_t s : sequences(*reader, kEver))
      if (Held taken = reader->take(s)) {
        held.push_back(taken);
        values.push_back(s);
      }
  }
  CHECK(held.size() >= 1);
  for (size_t i = 0; i < held.size(); ++i) CHECK_MESSAGE(intact(held[i], values[i]), "a held message was overwritten");
  CHECK((published == 20 || writer->statistics().pool_empty == 1));
  for (Held& h : held) reader->release(h);
  MessageHeader* loaned = writer->loan();
  CHECK_MESSAGE(loaned != nullptr, "released messages must be available again");
  writer->discard();
}

inline void check_repeats(Transport& transport) {
  auto writer = transport.make_writer(repeats);
  auto reader = transport.make_reader(repeats);
  CHECK_FALSE(writer->repeat(1, 1));
  publish(*writer, 5, 70, 10);
  CHECK(writer->repeat(20, 30));
  CHECK(sequences(*reader, 29) == Sequences{1});
  const auto candidates = listed(*reader, 30);
  REQUIRE(candidates.size() == 2);
  CHECK(candidates[0].sequence == 2);
  CHECK(candidates[0].stamp_ns == 70);
  CHECK(candidates[0].visible_at_ns == 30);
  Held again = reader->take(2), original = reader->take(1);
  REQUIRE(again);
  REQUIRE(original);
  CHECK(again.sequence == 2);
  CHECK(again.stamp_ns == 70);
  CHECK(again.visible_at_ns == 30);
  CHECK(original.visible_at_ns == 10);
  CHECK_MESSAGE(again.message() == original.message(), "a repeated message must not be copied");
  reader->release(original);
  CHECK(intact(again, 5));
  reader->release(again);
  publish(*writer, 6, 80, 40);
  CHECK(writer->repeat(50, 60));
  CHECK(sequences(*reader, kEver) == Sequences{4, 3, 2});
  Held newest = reader->take(4);
  REQUIRE(newest);
  CHECK(intact(newest, 6));
  reader->release(newest);
  CHECK(writer->statistics().sent == 4);
}

inline void check_many_repeats(Transport& transport) {
  auto writer = transport.make_writer(many_repeats);
  auto reader = transport.make_reader(many_repeats);
  publish(*writer, 9, 3, 0);
  for (int i = 0; i < 500; ++i) REQUIRE(writer->repeat(i, i));
  CHECK(sequences(*reader, kEver) == Sequences{501});
  Held held = reader->take(501);
  REQUIRE(held);
  CHECK(held.stamp_ns == 3);
  CHECK(intact(held, 9));
  publish(*writer, 10, 4, 0);
  CHECK(sequences(*reader, kEver) == Sequences{502});
  CHECK(intact(held, 9));
  reader->release(held);
}

inline void check_discard(Transport& transport) {
  auto writer = transport.make_writer(discarding);
  auto reader = transport.make_reader(discarding);
  for (int i = 0; i < 50; ++i) {
    fill(writer->loan(), 99);
    writer->discard();
  }
  writer->discard();
  writer->publish(1, 1, 1);  // nothing loaned: no effect
  CHECK(listed(*reader, kEver).empty());
  CHECK(writer->statistics().in_use == 0);
  publish(*writer, 1, 0, 0);
  CHECK(sequences(*reader, kEver) == Sequences{1});
  CHECK(writer->statistics().in_use == 1);
}

inline void check_late_reader(Transport& transport) {
  auto writer = transport.make_writer(late);
  for (int i = 1; i <= 6; ++i) {
    MessageHeader* loaned = writer->loan();
    REQUIRE(loaned != nullptr);
    reinterpret_cast<Odometry*>(loaned + 1)->x_m = i;
    writer->publish(i, i, i);
  }
  auto reader = transport.make_reader(late);
  CHECK(sequences(*reader, kEver) == Sequences{6, 5, 4, 3});
  Held held = reader->take(3);
  REQUIRE(held);
  CHECK(static_cast<const Odometry*>(held.message())->x_m == 3);
  reader->release(held);
}

/// More kept messages than iceoryx keeps for late subscribers.
inline void check_deep(Transport& transport) {
  auto writer = transport.make_writer(deep);
  auto reader = transport.make_reader(deep);
  for (uint64_t i = 1; i <= 100; ++i) publish(*writer, i, 0, 0);
  const auto all = sequences(*reader, kEver);
  REQUIRE(all.size() == 40);
  for (size_t i = 0; i < all.size(); ++i) CHECK(all[i] == 100 - i);
}

/// The obvious reference: all that was ever announced; the newest `history` of it are listed.
struct TransportModel {
  struct Entry {
    Candidate candidate;
    uint64_t value;
  };
  size_t history;
  std::vector<Entry> entries;
  uint64_t last_value = 0;
  int64_t last_stamp_ns = 0;

  void announce(uint64_t value, int64_t stamp_ns, int64_t visible_at_ns) {
    entries.push_back({{entries.size() + 1, stamp_ns, visible_at_ns}, value});
    last_value = value;
    last_stamp_ns = stamp_ns;
  }
  std::vector<Candidate> list(int64_t limit_ns) const {
    std::vector<Candidate> out;
    for (size_t i = entries.size(); i > 0 && i + history > entries.size(); --i)
      if (entries[i - 1].candidate.visible_at_ns <= limit_ns) out.push_back(entries[i - 1].candidate);
    return out;
  }
};

inline void check_against_model(Transport& transport, size_t port, uint32_t seed) {
  const PortPlan plan = conformance_ports()[port];
  auto writer = transport.make_writer(port);
  std::vector<std::unique_ptr<Reader>> readers;
  for (uint32_t i = 0; i < plan.readers; ++i) readers.push_back(transport.make_reader(port));
  TransportModel model{plan.history, {}};
  struct Holding {
    Held held;
    uint64_t value;
  };
  std::vector<std::vector<Holding>> holding(readers.size());
  std::mt19937 random(seed);
  const auto below = [&](uint32_t n) { return static_cast<uint32_t>(random() % n); };
  const size_t may_hold = plan.held / plan.readers;
  for (int step = 0; step < 3000; ++step) {
    const auto now = static_cast<int64_t>(step);
    const uint32_t action = below(10);
    if (action < 3) {
      const auto visible = now + static_cast<int64_t>(below(20));
      publish(*writer, static_cast<uint64_t>(step), now, visible);
      model.announce(static_cast<uint64_t>(step), now, visible);
    } else if (action == 3) {
      const auto visible = now + static_cast<int64_t>(below(20));
      const bool repeated = writer->repeat(now, visible);
      REQUIRE(repeated == !model.entries.empty());
      if (repeated) model.announce(model.last_value, model.last_stamp_ns, visible);
    } else if (action == 4) {
      fill(writer->loan(), 0xdead);
      writer->discard();
    } else {
      const size_t r = below(static_cast<uint32_t>(readers.size()));
      const int64_t limit = now - 5 + static_cast<int64_t>(below(10));
      const auto got = listed(*readers[r], limit);
      const auto expected = model.list(limit);
      REQUIRE(got.size() == expected.size());
      for (size_t i = 0; i < got.size(); ++i) {
        REQUIRE(got[i].sequence == expected[i].sequence);
        REQUIRE(got[i].stamp_ns == expected[i].stamp_ns);
        REQUIRE(got[i].visible_at_ns == expected[i].visible_at_ns);
      }
      auto& mine = holding[r];
      if (!mine.empty() && (below(2) == 0 || mine.size() == may_hold)) {
        const size_t which = below(static_cast<uint32_t>(mine.size()));
        REQUIRE(intact(mine[which].held, mine[which].value));
        readers[r]->release(mine[which].held);
        mine.erase(mine.begin() + static_cast<std::ptrdiff_t>(which));
      } else if (!got.empty() && mine.size() < may_hold) {
        const uint64_t sequence = got[below(static_cast<uint32_t>(got.size()))].sequence;
        Held held = readers[r]->take(sequence);
        REQUIRE(held);
        REQUIRE(held.sequence == sequence);
        mine.push_back({held, model.entries[sequence - 1].value});
        REQUIRE(intact(held, mine.back().value));
      }
    }
  }
  CHECK(writer->statistics().pool_empty == 0);
  CHECK(writer->statistics().sent == model.entries.size());
  for (size_t r = 0; r < readers.size(); ++r)
    for (Holding& h : holding[r]) readers[r]->release(h.held);
  for (auto& reader : readers) reader->list(kEver, {});
  CHECK(writer->statistics().in_use <= plan.history);
}

inline void check_two_threads(Transport& transport) {
  auto writer = transport.make_writer(stress);
  auto reader = transport.make_reader(stress), second = transport.make_reader(stress);
  constexpr uint64_t kMessages = 30000;
  std::atomic<bool> done{false};
  std::atomic<uint64_t> starved{0};
  std::thread producer([&] {
    for (uint64_t i = 1; i <= kMessages; ++i) {
      MessageHeader* loaned = writer->loan();
      if (loaned == nullptr) {
        ++starved;
        continue;
      }
      auto* image = reinterpret_cast<Image*>(loaned + 1);
      image->width = static_cast<int32_t>(i);
      image->pixels.resize(image->pixels.capacity);
      std::memset(image->pixels.data(), static_cast<int>(i & 0xff), image->pixels.size);
      writer->publish(static_cast<int64_t>(i), 0, 0);
      if (i % 7 == 0) writer->repeat(0, 0);
    }
    done = true;
  });
  uint64_t newest = 0, taken = 0, torn = 0, backwards = 0;
  std::array<Candidate, 8> candidates;
  for (bool last = false; !last;) {
    last = done;
    const size_t count = reader->list(kEver, candidates);
    if (count == 0) continue;
    backwards += candidates[0].sequence < newest;
    newest = candidates[0].sequence;
    Held a = reader->take(candidates[0].sequence), b = reader->take(candidates[count - 1].sequence);
    for (Held* held : {&a, &b}) {
      if (!*held) continue;
      ++taken;
      torn += !intact(*held, static_cast<uint64_t>(held->stamp_ns));
      reader->release(*held);
    }
  }
  producer.join();
  CHECK(torn == 0);
  CHECK(backwards == 0);
  CHECK(taken > 0);
  CHECK_MESSAGE(starved == 0, "readers within their plan must never starve the writer");
  CHECK(writer->statistics().sent == kMessages + kMessages / 7);
  CHECK(newest == writer->statistics().sent);
  second->list(kEver, {});
  CHECK(writer->statistics().in_use <= 3);
}

inline void transport_conformance(Transport& transport) {
  CHECK(transport.shared_memory_bytes() > 0);
  check_basic(transport);
  check_limits(transport);
  check_eviction(transport);
  check_slow_readers(transport);
  check_greedy_reader(transport);
  check_repeats(transport);
  check_many_repeats(transport);
  check_discard(transport);
  check_late_reader(transport);
  check_deep(transport);
  check_against_model(transport, model_1, 1);
  check_against_model(transport, model_5, 2);
  check_two_threads(transport);
}

}  // namespace takt::test
