// SPDX-License-Identifier: Apache-2.0
// Two machines over a network in memory, each with a clock of its own.
#include "graph/machines/link.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "memory_wire.hpp"
#include "rt/msg/grid.hpp"
#include "rt/record/packed_message.hpp"

using namespace takt;
using namespace takt::machines;

namespace {

/// A machine's clock: `ahead_ns` of the real one.
struct OwnClock final : Clock {
  explicit OwnClock(int64_t ahead_ns) : ahead_ns(ahead_ns) {}
  int64_t now_ns() const override { return MonotonicClock().now_ns() + ahead_ns; }
  bool is_virtual() const override { return false; }
  const int64_t ahead_ns;
};

const MessageType& type() { return MessageType::of<Grid>(); }
constexpr Capacity kCapacity{4, 2, 1, 0};

struct Chunk {
  AlignedBytes memory = aligned_bytes(sizeof(MessageHeader) + type().bytes(kCapacity));
  MessageHeader* header() { return reinterpret_cast<MessageHeader*>(memory.get()); }
  Grid& grid() { return *reinterpret_cast<Grid*>(header() + 1); }
};

/// What a node of the sending machine publishes: a Reader of it, as a transport has them.
struct Publisher {
  std::mutex mutex;
  std::vector<std::unique_ptr<Chunk>> sent;
  Doorbell bell;
  void publish(int64_t stamp_ns, int64_t published_ns) {
    put(stamp_ns, published_ns);
    bell.ring();
  }
  void put(int64_t stamp_ns, int64_t published_ns) {
    const std::lock_guard lock(mutex);
    auto& chunk = *sent.emplace_back(std::make_unique<Chunk>());
    *chunk.header() = {};
    chunk.header()->stamp_ns = stamp_ns;
    chunk.header()->published_ns = published_ns;
    chunk.header()->sequence = sent.size();
    type().place(chunk.header() + 1, kCapacity);
    chunk.grid().cell_m = static_cast<double>(sent.size());
  }
};

struct PublishedReader final : Reader {
  explicit PublishedReader(Publisher& from) : from(from) {}
  size_t list(int64_t, std::span<Candidate> out) override {
    const std::lock_guard lock(from.mutex);
    size_t count = 0;
    for (size_t i = from.sent.size(); i-- > 0 && count < out.size();)
      out[count++] = {i + 1, from.sent[i]->header()->stamp_ns, 0};
    return count;
  }
  Held take(uint64_t sequence) override {
    const std::lock_guard lock(from.mutex);
    const MessageHeader* const header = from.sent[sequence - 1]->header();
    return {header, sequence, header->stamp_ns, 0, 0};
  }
  void release(Held&) override {}
  Publisher& from;
};

bool soon(const std::function<bool()>& true_now) {
  for (int i = 0; i < 2000 && !true_now(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return true_now();
}

constexpr int64_t kLatency_ns = 50'000'000, kClockError_ns = 20'000'000;

struct Pair {
  test::Network network;
  OwnClock there{0}, here{7'000'000'000};
  std::atomic<bool> set_up{true};
  Publisher publisher;
  Doorbell unrung;
  std::string same_here = "h", same_there = "h";
  std::vector<std::string> said;
  std::function<Json()> tells;
  std::function<Json(const Json&)> answer;
  std::unique_ptr<Link> vision, robot;
  std::unique_ptr<RemoteSource> source;

  void start_vision() {
    vision = std::make_unique<Link>(
        Link::Options{"ace", "vision", same_there, {"robot"}, kLatency_ns, kClockError_ns, {}, tells, answer},
        std::vector<Link::ImportName>{},
        std::vector<Link::Export>{{"map.grid", [this] { return set_up ? std::optional(kCapacity) : std::nullopt; }}},
        std::make_unique<test::MemoryWire>(network), publisher.bell, there);
    std::vector<Link::Outgoing> outgoing(1);
    outgoing[0] = {&type(), std::make_unique<PublishedReader>(publisher)};
    vision->begin(std::move(outgoing));
  }
  void start_robot() {
    robot = std::make_unique<Link>(Link::Options{"ace",
                                                 "robot",
                                                 same_here,
                                                 {"vision"},
                                                 kLatency_ns,
                                                 kClockError_ns,
                                                 [this](const std::string& line) { said.push_back(line); }},
                                   std::vector<Link::ImportName>{{"vision", "map.grid"}}, std::vector<Link::Export>{},
                                   std::make_unique<test::MemoryWire>(network), unrung, here);
    source = robot->source("vision", "map", {{"grid", "", &type()}}, {});
  }
  const Inbox::Message* next() { return source->inbox(0).next(here.now_ns()); }
};

}  // namespace

TEST_CASE("A message comes once its time has come, with its stamp in the clock of this machine") {
  Pair pair;
  pair.set_up = false;
  pair.start_vision();
  pair.start_robot();
  std::atomic<bool> told{false};
  std::thread setup([&] {
    CHECK(pair.source->capacity("grid").width == 4);
    told = true;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(250));
  CHECK(!told);
  pair.set_up = true;
  setup.join();
  pair.source->start(0);
  CHECK(soon([&] { return pair.source->status(pair.here.now_ns()) == ReadStatus::ok; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // both have heard each other
  const int64_t stamp_ns = pair.there.now_ns() - 5'000'000, published_ns = pair.there.now_ns();
  pair.publisher.publish(stamp_ns, published_ns);
  REQUIRE(soon([&] { return pair.next() != nullptr; }));
  const Inbox::Message& message = *pair.next();
  CHECK(reinterpret_cast<const Grid*>(message.memory.get())->cell_m == 1);
  CHECK(std::abs(message.stamp_ns - pair.here.ahead_ns - stamp_ns) < kClockError_ns);
  CHECK(message.visible_at_ns - pair.here.ahead_ns - published_ns >= kLatency_ns);
  pair.source->inbox(0).taken();
  CHECK(pair.next() == nullptr);
  CHECK(pair.source->counts().missing == 0);
  CHECK(std::string(pair.source->trouble()).empty());
}

TEST_CASE(
    "What the network loses is counted, a late message too, and a machine that is gone is noticed and comes back") {
  std::atomic<size_t> data = 0;
  Pair pair;
  pair.start_vision(), pair.start_robot();
  pair.source->capacity("grid");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  pair.publisher.publish(pair.there.now_ns(), pair.there.now_ns());  // before the run begins here: not for it
  CHECK(soon([&] { return pair.source->counts().received == 1; }));
  pair.source->start(0);
  CHECK(pair.next() == nullptr);
  pair.network.lose([&](const std::string& topic) { return topic == "takt/ace/vision/map/grid" && ++data % 3 == 0; });
  for (int i = 0; i < 10; ++i) pair.publisher.publish(pair.there.now_ns(), pair.there.now_ns());
  CHECK(soon([&] { return pair.source->counts().received == 8; }));
  CHECK(pair.source->counts().missing == 3);
  CHECK(soon([&] { return pair.next() != nullptr; }));
  while (pair.next() != nullptr) pair.source->inbox(0).taken();
  data = 0;
  pair.publisher.publish(pair.there.now_ns(), pair.there.now_ns() - 10 * kLatency_ns);
  CHECK(soon([&] { return pair.next() != nullptr; }));
  CHECK(std::string(pair.source->trouble()) == "messages came later than the network's latency");

  pair.vision.reset();
  CHECK(soon([&] { return pair.source->status(pair.here.now_ns()) == ReadStatus::no_data; }));
  pair.start_vision();  // its messages begin with 1 again, and those from before are sent once more
  CHECK(soon([&] { return pair.source->status(pair.here.now_ns()) == ReadStatus::ok; }));
  CHECK(soon([&] { return pair.source->counts().received > 9; }));
}

TEST_CASE("Questions are answered by the other machine, if it takes words from others; the report has what it tells") {
  Pair pair;
  pair.tells = [] { return Json{{"mode", "full"}}; };
  pair.answer = [](const Json& question) { return Json{{"ok", true}, {"to", question}}; };
  pair.start_vision(), pair.start_robot();
  const Json question{{"do", "mode"}, {"mode", "safe_stop"}};
  CHECK(pair.robot->ask("arm", question) == Json{{"error", "machine arm is not there"}});
  CHECK(soon([&] { return pair.robot->ask("vision", question) == Json{{"ok", true}, {"to", question}}; }));
  CHECK(soon([&] {
    return pair.vision->ask("robot", question)["error"].get<std::string>().find("takes no words from others") !=
           std::string::npos;
  }));
  CHECK(soon([&] { return pair.robot->report()[0]["told"] == Json{{"mode", "full"}}; }));
  CHECK(soon([&] { return pair.robot->report()[0]["clock_offset_ms"].is_number(); }));
  const Json vision = pair.robot->report()[0];
  CHECK(vision["name"] == "vision");
  CHECK(soon([&] { return pair.robot->report()[0]["state"] == "here"; }));
  CHECK(std::abs(vision["clock_offset_ms"].get<double>()) == doctest::Approx(7000).epsilon(0.01));
  CHECK(vision["outputs"][0]["port"] == "map.grid");
  pair.vision.reset();
  CHECK(soon([&] { return pair.robot->ask("vision", question) == Json{{"error", "machine vision is not there"}}; }));
}

TEST_CASE("Words that are none, or are for somebody else, are passed over") {
  std::vector<std::string> sent;
  std::mutex mutex;
  Questions questions({"robot", 1,
                       [](const Json&) {
                         return Json{{"ok", true}};
                       }},
                      [&](std::span<const std::byte> bytes) {
                        const std::lock_guard lock(mutex);
                        sent.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
                      });
  const auto come = [&](const std::string& text) {
    questions.take(std::as_bytes(std::span(text.data(), text.size())));
  };
  for (const char* text : {"", "{", "[]", "7", R"({"to": "arm", "from": "x", "id": 1, "question": {}})",
                           R"({"to": "robot", "from": 3, "id": 1, "question": {}})", R"({"to": "robot", "from": "x"})",
                           R"({"to": "robot", "from": "x", "id": -1, "question": {}})",
                           R"({"to": "robot", "from": "x", "id": 9, "answer": {}})"})
    come(text);
  come(R"({"to": "robot", "from": "x", "id": 4, "question": {"do": "stop"}})");
  CHECK(soon([&] {
    const std::lock_guard lock(mutex);
    return !sent.empty();
  }));
  questions.stop();
  REQUIRE(sent.size() == 1);
  CHECK(sent[0] == R"({"from":"robot","to":"x","id":4,"answer":{"ok":true}})");
}

TEST_CASE("A machine that runs another graph is named and not listened to; a setup that waits can be ended") {
  Pair pair;
  pair.same_there = "other";
  pair.start_vision(), pair.start_robot();
  CHECK(soon([&] { return std::string(pair.source->trouble()) != ""; }));
  CHECK(std::string(pair.source->trouble()).find("another graph") != std::string::npos);
  CHECK(pair.source->status(pair.here.now_ns()) == ReadStatus::no_data);
  std::thread setup([&] { CHECK_THROWS_AS(pair.source->capacity("grid"), SetupError); });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  pair.robot->give_up();
  setup.join();
  pair.robot.reset();
  REQUIRE(!pair.said.empty());
  CHECK(pair.said.front().find("machine vision runs another graph") != std::string::npos);
}

TEST_CASE("A frame is read as it was sent, in every coding; a damaged one is told") {
  Publisher publisher;
  publisher.publish(11, 12);
  const Held held{publisher.sent[0]->header(), 1, 11, 0, 0};
  std::vector<std::byte> packed;
  record::pack(type(), held.message(), packed);
  for (const char* word : {"plain", "zstd", "lz4", "jpeg"}) {
    CAPTURE(word);
    Framer framer(type(), *coding_of(word));
    const auto sent = framer.frame(81, held);
    const std::vector<std::byte> bytes(sent.begin(), sent.end());
    const auto frame = frame_of(bytes);
    REQUIRE(frame);
    CHECK(frame->run == 81);
    CHECK(frame->sequence == 1);
    CHECK(frame->stamp_ns == 11);
    CHECK(frame->published_ns == 12);
    std::vector<std::byte> into;
    const auto again = decoded(frame->coding, frame->coded, packed.size(), into);
    REQUIRE(again);
    CHECK(std::vector<std::byte>(again->begin(), again->end()) == packed);
    for (size_t i = 0; i < bytes.size(); ++i) {
      auto damaged = bytes;
      damaged[i] ^= std::byte{1};
      CHECK(!frame_of(damaged));
      CHECK(!frame_of(std::span(bytes).first(i)));
    }
  }
  CHECK(!coding_of("png"));
}

TEST_CASE("What is no message in a coding, or one larger than there is room for, is told") {
  std::vector<std::byte> packed(5000, std::byte{7}), into;
  for (const Coding coding : {Coding::zstd, Coding::lz4}) {
    Coder coder(coding);
    const auto small = coder.code(type(), packed);
    CHECK(small.size() < packed.size() / 10);
    CHECK(decoded(coding, small, packed.size(), into)->size() == packed.size());
    CHECK(!decoded(coding, small, packed.size() - 1, into));
    for (size_t length = 0; length < small.size(); ++length) CHECK(!decoded(coding, small.first(length), 5000, into));
  }
}
