// SPDX-License-Identifier: Apache-2.0
// Pages of the kernel's trace buffer, put together by hand.
#include "rt/trace/ftrace_page.hpp"

#include <doctest/doctest.h>

#include <random>
#include <vector>

namespace {

using namespace takt::trace;

struct Page {
  std::vector<std::byte> bytes = std::vector<std::byte>(16);
  void word(uint32_t value) {
    const auto* from = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), from, from + 4);
  }
  void head(uint32_t type, uint32_t delta) { word(type | delta << 5U); }
  /// Fixes the times and lengths at the page's front.
  void close(uint64_t time, uint64_t flags = 0) {
    const uint64_t commit = (bytes.size() - 16) | flags;
    std::memcpy(bytes.data(), &time, 8);
    std::memcpy(bytes.data() + 8, &commit, 8);
  }
};

struct SeenRecord {
  int64_t at;
  size_t bytes;
  bool operator==(const SeenRecord&) const = default;
};
std::vector<SeenRecord> walk(const Page& page, uint64_t* missed = nullptr) {
  std::vector<SeenRecord> seen;
  const uint64_t lost = for_each_record(page.bytes, 16, [&](int64_t at, std::span<const std::byte> record) {
    seen.push_back({at, record.size()});
  });
  if (missed != nullptr) *missed = lost;
  return seen;
}

constexpr const char* kFormat =
    "name: sched_switch\nID: 372\nformat:\n\tfield:unsigned short common_type;\toffset:0;\tsize:2;\tsigned:0;\n\n"
    "\tfield:char prev_comm[16];\toffset:8;\tsize:16;\tsigned:0;\n\tfield:pid_t "
    "prev_pid;\toffset:24;\tsize:4;\tsigned:1;\n";

}  // namespace

TEST_CASE("records of each length, time extensions and padding") {
  Page page;
  page.head(2, 5), page.word(1), page.word(2);                    // two words, at 1005
  page.head(30, 7), page.word(1);                                 // time goes on by 2^27 + 7
  page.head(0, 3), page.word(4 + 8), page.word(1), page.word(2);  // its length in a word of its own
  page.head(29, 1), page.word(8), page.word(0);                   // a discarded record: time goes on, nothing else
  page.head(31, 9), page.word(100);                               // absolute: 100 * 2^27 + 9
  page.head(1, 1), page.word(1);
  page.head(29, 0), page.word(0);  // the rest is empty
  page.close(1'000);
  const int64_t extended = 1'005 + (int64_t{1} << 27) + 7;
  CHECK(walk(page) == std::vector<SeenRecord>{{1'005, 8}, {extended + 3, 8}, {(int64_t{100} << 27) + 10, 4}});
}

TEST_CASE("what the kernel dropped is counted") {
  Page page;
  page.head(1, 1), page.word(1);
  page.close(0, uint64_t{1} << 31);
  uint64_t missed = 0;
  CHECK(walk(page, &missed).size() == 1);
  CHECK(missed == 1);  // some, it does not say how many
  page.close(0, uint64_t{3} << 30);
  page.word(42), page.word(0);
  CHECK(walk(page, &missed).size() == 1);
  CHECK(missed == 42);
}

TEST_CASE("a damaged page is never read beyond its end") {
  std::mt19937 random(3);
  for (int round = 0; round < 20'000; ++round) {
    Page page;
    for (size_t i = random() % 12; i > 0; --i)
      page.word(static_cast<uint32_t>(random() % (round % 2 == 0 ? 64 : 1U << 31U)));
    page.close(random(), random() % 3 == 0 ? 4'000 : 0);
    if (random() % 4 == 0) page.bytes.resize(random() % (page.bytes.size() + 1));
    for (const SeenRecord& seen : walk(page)) CHECK(seen.bytes <= page.bytes.size());
  }
}

TEST_CASE("offsets come from the format file, not from memory") {
  CHECK(find_id(kFormat) == 372);
  REQUIRE(find_field(kFormat, "prev_pid"));
  CHECK(find_field(kFormat, "prev_pid")->offset == 24);
  CHECK(find_field(kFormat, "prev_comm")->size == 16);
  CHECK_FALSE(find_field(kFormat, "pid"));
  CHECK_FALSE(find_field(kFormat, "next_pid"));
  CHECK_FALSE(find_id("format"));
  const int32_t number = -5;
  const auto record = std::as_bytes(std::span(&number, 1));
  CHECK(read_field(record, {0, 4}) == -5);
  CHECK(read_field(record, {1, 4}) == 0);
  CHECK(read_text(std::as_bytes(std::span("abc\0d", 5)), {0, 5}) == "abc");
}
