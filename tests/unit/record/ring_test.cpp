// SPDX-License-Identifier: Apache-2.0
// A ring: the newest files of a record, within their limits whatever the disk does.
#include "rt/record/ring.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>

#include "recorded_run.hpp"
#include "rt/record/log_file.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::record;

namespace {

constexpr uint64_t kMB = 1'000'000;

std::unique_ptr<Ring> ring_in(const std::filesystem::path& folder, RingLimits limits, const char* name = "run") {
  auto ring = Ring::open(folder, name, limits);
  REQUIRE_MESSAGE(ring, ring.error());
  return std::move(*ring);
}

uint64_t bytes_in(const std::filesystem::path& folder) {
  uint64_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) bytes += entry.file_size();
  return bytes;
}

/// Files of `bytes` each, until `count` were written.
void fill(Ring& ring, const std::filesystem::path& folder, int count, size_t bytes, uint64_t most) {
  const std::vector<std::byte> data(bytes);
  for (int i = 0; i < count; ++i) {
    mcap::Sink* sink = ring.next(i * 1'000'000'000LL);
    const mcap::Bytes parts[]{data};
    REQUIRE(sink->append(parts));
    ring.settle((i + 1) * 1'000'000'000LL);
    REQUIRE(bytes_in(folder) <= most);
    REQUIRE(bytes_in(folder) == ring.bytes());
  }
}

}  // namespace

TEST_CASE("A ring drops its oldest files before it takes more than it may") {
  const test::TemporaryFolder folder;
  const auto ring = ring_in(folder.path, {.bytes = 20 * kMB});
  fill(*ring, folder.path, 50, 3 * kMB, 20 * kMB);
  const auto files = ring->files();
  CHECK(files.size() == 6);
  CHECK(ring->dropped() == 44);
  CHECK(ring->most_bytes() == 18 * kMB);
  CHECK(files.back().path.filename() == "run-000050.mcap");
  CHECK(files.front().began_ns == 44'000'000'000);
  CHECK(files.back().ended_ns == 50'000'000'000);
}

TEST_CASE("A ring drops what is too old") {
  const test::TemporaryFolder folder;
  const auto ring = ring_in(folder.path, {.bytes = 500 * kMB, .age_ns = 10'000'000'000});
  fill(*ring, folder.path, 40, 1000, 500 * kMB);
  CHECK(ring->files().size() == 12);
  CHECK(ring->files().front().began_ns == 28'000'000'000);
}

TEST_CASE("Files that an earlier run left go first, and count") {
  const test::TemporaryFolder folder;
  fill(*ring_in(folder.path, {.bytes = 20 * kMB}, "before"), folder.path, 6, 3 * kMB, 20 * kMB);
  const auto ring = ring_in(folder.path, {.bytes = 20 * kMB});
  CHECK(ring->bytes() == 18 * kMB);
  fill(*ring, folder.path, 2, 3 * kMB, 20 * kMB);
  CHECK(ring->files().front().path.filename() == "before-000003.mcap");
  CHECK(ring->files().back().path.filename() == "run-000002.mcap");
}

TEST_CASE("What does not fit even alone is refused, and what fits later is taken") {
  const test::TemporaryFolder folder;
  const auto ring = ring_in(folder.path, {.bytes = 20 * kMB});
  mcap::Sink* sink = ring->next(0);
  const std::vector<std::byte> large(30 * kMB), small(kMB);
  const mcap::Bytes too_much[]{large}, enough[]{small};
  const auto refused = sink->append(too_much);
  REQUIRE(!refused);
  CHECK(refused.error().find("the folder may take 20000000 bytes") != std::string::npos);
  CHECK(sink->append(enough));
  CHECK(bytes_in(folder.path) == kMB);
}

TEST_CASE("A folder that cannot be made is asked for again with each file") {
  const test::TemporaryFolder folder;
  const auto place = folder.path / "ring";
  const auto ring = ring_in(place, {});
  std::filesystem::remove_all(place);
  std::ofstream(place) << "in its way";
  const std::vector<std::byte> data(1000);
  const mcap::Bytes parts[]{data};
  CHECK(!ring->next(0)->append(parts));
  std::filesystem::remove(place);
  CHECK(ring->next(1)->append(parts));
  CHECK(ring->files().size() == 1);
}

TEST_CASE("A file that somebody deleted is told when it settles, and the next one is made, with its folder") {
  const test::TemporaryFolder folder;
  for (const bool durable : {true, false}) {
    const auto ring = ring_in(folder.path / "ring", {.bytes = 20 * kMB, .durable = durable});
    const std::vector<std::byte> data(1000);
    const mcap::Bytes parts[]{data};
    REQUIRE(ring->next(0)->append(parts));
    CHECK(ring->settle(1'000'000'000));
    CHECK(!ring->ends(1000, 0, 1'000'000'000));
    std::filesystem::remove_all(folder.path / "ring");
    const auto settled = ring->settle(2'000'000'000);
    REQUIRE(!settled);
    CHECK(settled.error().ends_with("run-000001.mcap: the file was deleted"));
    CHECK(ring->ends(1000, 0, 2'000'000'000));
    REQUIRE(ring->next(2'000'000'000)->append(parts));
    CHECK(ring->settle(3'000'000'000));
    CHECK(bytes_in(folder.path / "ring") == 1000);
  }
}

TEST_CASE("Each file of a recorded ring opens alone, and together they hold every job") {
  const test::TemporaryFolder folder;
  const auto ring = ring_in(folder.path, {.bytes = 500 * kMB, .split_ns = 2'000'000'000});
  test::SmallGraph graph;
  const RecordResult result = test::record_run(graph.plan, *ring, 9, {.ports = test::with_fields({1, 0, 1})});
  CHECK(result.lost() == 0);
  CHECK(result.refused.empty());
  CHECK(result.files == ring->files().size());
  CHECK(result.files >= 4);
  CHECK(result.bytes == ring->bytes());
  uint64_t jobs = 0, messages = 0;
  for (const Ring::File& file : ring->files()) {
    auto log = LogFile::open(file.path);
    REQUIRE_MESSAGE(log, log.error());
    CHECK(log->damages().empty());
    jobs += log->jobs().size();
    for (const mcap::Channel& channel : log->container().channels())
      if (LogFile::of_a_port(channel)) messages += log->messages(channel.id).size();
  }
  CHECK(jobs == result.jobs);
  CHECK(jobs == 9 * (30 + 10 + 10));
  CHECK(messages == result.messages);
}

TEST_CASE("Of a port by rule: nothing, hashes, or all fields of some messages") {
  const test::TemporaryFolder folder;
  const auto file = folder.path / "run.mcap";
  auto sink = mcap::FileSink::open(file);
  REQUIRE(sink);
  test::SmallGraph graph;
  using enum PortRule::Keep;
  test::record_run(graph.plan, *sink, 3, {.ports = {{all, 5}, {nothing}, {all, 1, 500'000'000}}});
  auto log = LogFile::open(file);
  REQUIRE(log);
  const auto count = [&](size_t port, bool whole) {
    const auto& messages = log->messages(log->channel(graph.plan.ports[port].node + "." + graph.plan.ports[port].port));
    return std::count_if(messages.begin(), messages.end(), [&](const auto& one) { return one.second.whole == whole; });
  };
  CHECK(count(0, true) == 15);
  CHECK(count(0, false) == 62);
  CHECK(count(1, true) + count(1, false) == 0);
  CHECK(count(2, true) == 6);
  CHECK(count(2, false) == 24);
}

TEST_CASE("The name of a file tells its run and its number") {
  const auto is = [](const char* file, const char* run, uint64_t number) {
    const RingName name = name_of(file);
    return name.run == run && name.number == number;
  };
  CHECK(is("out/ring/ace-20261129-184012-4711-000012.mcap", "ace-20261129-184012-4711", 12));
  CHECK(is("a-1234567.mcap", "a", 1234567));
  for (const char* file : {"a-00001.mcap", "-000001.mcap", "000001.mcap", "a-00001x.mcap", "a-000001.part", "a", ""})
    CHECK(is(file, "", 0));
}
