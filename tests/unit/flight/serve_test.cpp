// SPDX-License-Identifier: Apache-2.0
// A run is followed through the files of its ring, whatever becomes of them.
#include "graph/flight/serve.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <fstream>
#include <random>

#include "rt/file/output_file.hpp"
#include "rt/record/mcap/reader.hpp"
#include "rt/record/recorder.hpp"
#include "rt/record/ring.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::flight;
namespace fs = std::filesystem;

namespace {

constexpr int64_t kOneSecond = 1'000'000'000;

/// Writes a message a second, each in a chunk of its own, three in a file.
struct SteppedRun {
  std::unique_ptr<record::Ring> ring;
  std::optional<mcap::Writer> file;
  std::vector<std::byte> data;
  uint32_t said = 0;

  explicit SteppedRun(const fs::path& folder, size_t message_bytes = 100, const std::string& name = "run") {
    auto opened = record::Ring::open(folder, name, {.bytes = 16 << 20, .durable = false});
    REQUIRE(opened);
    ring = std::move(*opened);
    data.resize(message_bytes);
    std::mt19937 random(1);
    for (std::byte& byte : data) byte = static_cast<std::byte>(random());
    begin();
  }
  void begin() {
    file.emplace(*ring->next(said * kOneSecond), mcap::Writer::Options{});
    REQUIRE(file->begin("", "takt"));
    REQUIRE(file->metadata(record::Recorder::kFacts, {{"format", "2"}}));
    REQUIRE(file->attach({1, 1, "plan.json", "application/json", mcap::bytes_of("{}")}));
    file->add_channel(file->add_schema("takt.a", "json", "{}"), "a.b", "takt", {{"fields", "all"}});
    file->add_channel(1, "a.c", "takt", {});
  }
  void end(const mcap::Metadata& facts) {
    REQUIRE(file->metadata(record::Recorder::kEnd, facts));
    REQUIRE(file->finish());
  }
  void say() {
    if (said > 0 && said % 3 == 0) end({{"goes_on", "in the next file"}}), begin();
    const auto at_ns = static_cast<uint64_t>(++said * kOneSecond);
    REQUIRE(file->write({static_cast<uint16_t>(1 + said % 2), said, at_ns, at_ns, data}));
    REQUIRE(file->flush());
    ring->settle(static_cast<int64_t>(at_ns));
  }
};

/// Keeps what it is given; calls back before it takes something.
struct Receiver final : mcap::Sink {
  std::string bytes;
  std::function<void()> before = [] {};
  size_t most = SIZE_MAX;
  tl::expected<void, std::string> append(std::span<const mcap::Bytes> parts) override {
    before();
    if (bytes.size() > most) return tl::unexpected(std::string("Broken pipe"));
    for (const mcap::Bytes part : parts) bytes.append(reinterpret_cast<const char*>(part.data()), part.size());
    return {};
  }
};

struct Got {
  std::vector<uint32_t> numbers;  ///< of the messages
  std::vector<mcap::Metadata> gaps;
  std::string missing;
  size_t channels = 0, attachments = 0;
};

Got what_is_in(const test::TemporaryFolder& folder, const std::string& bytes) {
  const auto reader = mcap::Reader::open(folder.write("got.mcap", bytes));
  REQUIRE_MESSAGE(reader, reader.error());
  Got got;
  CHECK(reader->for_each([&](const mcap::Message& message) {
    CHECK(reader->channels()[message.channel - 1U].topic == (message.sequence % 2 == 0 ? "a.b" : "a.c"));
    got.numbers.push_back(message.sequence);
    return true;
  }));
  for (const auto& one : reader->metadata())
    if (one.name == "takt gap") got.gaps.push_back(one.map);
  got.missing = reader->missing();
  got.channels = reader->channels().size();
  got.attachments = reader->attachments().size();
  return got;
}

std::vector<uint32_t> numbers(uint32_t from, uint32_t to) {
  std::vector<uint32_t> all;
  for (; from <= to; ++from) all.push_back(from);
  return all;
}

/// The run goes on whenever the ring has been looked at, for so many messages in all.
Watch watching(SteppedRun& run, uint32_t messages) {
  Watch watch;
  watch.lives = [] { return true; };
  watch.enough = [] { return false; };
  watch.wait = [&run, messages] { run.said < messages ? run.say() : run.end({{"lost_overwritten", "0"}}); };
  return watch;
}

}  // namespace

TEST_CASE("A run is served to its end, from its newest file on") {
  const test::TemporaryFolder folder;
  SteppedRun run(folder.path / "ring");
  for (int i = 0; i < 7; ++i) run.say();  // the third file begins with 7
  Receiver reader;
  const auto served = serve(folder.path / "ring", reader, watching(run, 20));
  REQUIRE(served);
  CHECK(served->end == "the run has ended");
  CHECK(served->messages == 14);
  CHECK(served->files == 5);
  CHECK(served->gaps == 0);
  CHECK(served->bytes == reader.bytes.size());
  const Got got = what_is_in(folder, reader.bytes);
  CHECK(got.numbers == numbers(7, 20));
  CHECK(got.missing == "");
  CHECK(got.channels == 2);
  CHECK(got.attachments == 1);
}

TEST_CASE("What the ring drops before a slow reader has it is a gap, told with its time") {
  const test::TemporaryFolder folder;
  SteppedRun run(folder.path / "ring", 1'000'000);
  run.say();
  Receiver reader;
  bool slow = true;
  reader.before = [&] {  // the run says forty messages while the reader takes the second one
    if (run.said == 2 && std::exchange(slow, false))
      while (run.said < 42) run.say();
  };
  std::vector<std::string> told;
  Watch watch = watching(run, 45);
  watch.say = [&](const std::string& line) { told.push_back(line); };
  const auto served = serve(folder.path / "ring", reader, watch);
  REQUIRE(served);
  CHECK(served->gaps == 1);
  CHECK(served->end == "the run has ended");
  const Got got = what_is_in(folder, reader.bytes);
  CHECK(got.missing == "");
  REQUIRE(got.gaps.size() == 1);
  // The file in hand was dropped, and is read to its end all the same.
  REQUIRE(got.numbers.size() > 3);
  const uint32_t next = got.numbers[3];
  CHECK(next > 20);
  auto wanted = numbers(1, 3);
  for (const uint32_t number : numbers(next, 45)) wanted.push_back(number);
  CHECK(got.numbers == wanted);
  CHECK(got.gaps[0].at("from_ns") == std::to_string(3 * kOneSecond));
  CHECK(got.gaps[0].at("to_ns") == std::to_string(next * kOneSecond));
  const std::string files = std::to_string((next - 4) / 3) + " files of the ring were gone before they were read";
  CHECK(got.gaps[0].at("what") == files);
  REQUIRE(told.size() == 1);
  CHECK(told[0] == "a gap of " + std::to_string(next - 3) + ".0 s: " + files);
}

TEST_CASE("Of a run that was killed all is served that it wrote") {
  const test::TemporaryFolder folder;
  SteppedRun run(folder.path / "ring");
  Receiver reader;
  Watch watch = watching(run, 100);
  watch.lives = [&] { return run.said < 8; };
  const auto served = serve(folder.path / "ring", reader, watch);
  REQUIRE(served);
  CHECK(test::has(served->end, "the run was killed"));
  const Got got = what_is_in(folder, reader.bytes);
  CHECK(got.numbers == numbers(1, 8));
  CHECK(got.missing == "");
}

TEST_CASE("A later run in the same ring is not this one") {
  const test::TemporaryFolder folder;
  SteppedRun run(folder.path / "ring");
  Receiver reader;
  Watch watch = watching(run, 100);
  std::optional<SteppedRun> later;
  watch.wait = [&] {
    if (run.said < 4) return run.say();
    later.emplace(folder.path / "ring", 100, "sun");
    later->say();
    fs::last_write_time(later->ring->files().back().path, fs::file_time_type::clock::now() + std::chrono::hours(1));
  };
  const auto served = serve(folder.path / "ring", reader, watch);
  REQUIRE(served);
  CHECK(served->run == "run");
  CHECK(what_is_in(folder, reader.bytes).numbers == numbers(1, 4));
}

TEST_CASE("A record ends with the next chunk when it is enough, and has its end") {
  const test::TemporaryFolder folder;
  SteppedRun run(folder.path / "ring");
  Receiver reader;
  Watch watch = watching(run, 100);
  watch.enough = [&] { return run.said == 5; };
  const auto served = serve(folder.path / "ring", reader, watch);
  REQUIRE(served);
  CHECK(served->end == "stopped");
  const Got got = what_is_in(folder, reader.bytes);
  CHECK(got.numbers == numbers(1, 4));
  CHECK(got.missing == "");
}

TEST_CASE("What a reader took before it went can be read") {
  const test::TemporaryFolder folder;
  SteppedRun run(folder.path / "ring");
  Receiver reader;
  reader.most = 2000;
  const auto served = serve(folder.path / "ring", reader, watching(run, 100));
  REQUIRE(served);
  CHECK(served->refused == "Broken pipe");
  const Got got = what_is_in(folder, reader.bytes);
  CHECK(got.numbers == numbers(1, static_cast<uint32_t>(got.numbers.size())));
  CHECK(got.numbers.size() > 3);
}

TEST_CASE("What is damaged in a file of the ring is a gap, and the next file goes on") {
  const test::TemporaryFolder folder;
  SteppedRun run(folder.path / "ring");
  run.say();
  run.say();
  std::ofstream(run.ring->files().back().path, std::ios::app) << "this is no record of an MCAP file";
  Receiver reader;
  const auto served = serve(folder.path / "ring", reader, watching(run, 6));
  REQUIRE(served);
  CHECK(served->gaps == 1);
  const Got got = what_is_in(folder, reader.bytes);
  CHECK(got.numbers == std::vector<uint32_t>{1, 2, 4, 5, 6});
  CHECK(test::has(got.gaps.at(0).at("what"), "run-000001.mcap is damaged: at byte"));
}

TEST_CASE("Without a ring nothing is served") {
  const test::TemporaryFolder folder;
  folder.write("other.mcap", "x");
  Receiver reader;
  CHECK(test::has(serve(folder.path, reader, {}).error(), "no run keeps a ring here"));
  CHECK(test::has(serve(folder.path / "none", reader, {}).error(), "no run keeps a ring here"));
  CHECK(reader.bytes.empty());
}

TEST_CASE("The ring of a run is found, and whether the run has its folder") {
  const test::TemporaryFolder folder;
  const fs::path ring = folder.path / "flight/ring";
  fs::create_directories(ring);
  for (const fs::path& named : {folder.path, folder.path / "flight", ring}) CHECK(ring_of(named) == ring);
  CHECK(!run_lives(ring));
  const auto lock = WriterLock::of_folder(folder.path);
  REQUIRE(lock);
  CHECK(run_lives(ring));
}
