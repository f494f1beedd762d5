// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/node_log.hpp"

#include <doctest/doctest.h>

#include <string>
#include <thread>
#include <vector>

#include "plans.hpp"
#include "rt/sched/executor.hpp"
#include "rt/shm/local_transport.hpp"
#include "rt/testing.hpp"

using namespace takt;

namespace {

constexpr int64_t kSecondNs = 1'000'000'000;

struct Talker final : Node {
  Output<Odometry> out{this, "out", ""};
  int lines = 1;
  LogLevel level = LogLevel::info;
  void setup(Setup&) override {}
  void run(Job& job) override {
    for (int i = 0; i < lines; ++i) job.log(level, "job %d, %.2f m", static_cast<int>(job.index()), 0.25);
  }
};

std::vector<LogLine> taken(LogReader& reader, const NodeLog& log) {
  std::vector<LogLine> lines;
  reader.take(log, [&](const LogLine& line) { lines.push_back(line); });
  return lines;
}

void append(LogWriter& writer, uint64_t job, std::string_view text) {
  LogLine line;
  line.job = job;
  line.text = BoundedText<200>(text);
  writer.append(line);
}

}  // namespace

TEST_CASE("a job's line has its text, level, job and instant") {
  NodeTest<Talker> test;
  test.node().level = LogLevel::warning;
  test.run();
  test.run();
  const std::vector<LogLine> lines = test.log();
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].text.text() == "job 1, 0.25 m");
  CHECK(lines[0].level == LogLevel::warning);
  CHECK(lines[0].job == 1);
  CHECK(lines[0].at_ns == test.now_ns());
  CHECK(lines[0].dropped == 0);
  CHECK(test.allocations() == 0);
  CHECK(test.forbidden_calls() == "");
}

TEST_CASE("a longer line is cut at the end of what it may be") {
  struct Long final : Node {
    void setup(Setup&) override {}
    void run(Job& job) override { job.log(LogLevel::info, "%s", std::string(500, 'x').c_str()); }
  };
  NodeTest<Long> test;
  test.run();
  CHECK(test.log().at(0).text.text() == std::string(199, 'x'));
}

TEST_CASE("ten lines at once and five a second; the next one tells how many were dropped") {
  NodeLog log;
  LogWriter writer(log);
  LogReader reader;
  const auto say = [&](int64_t at_ns, int lines) {
    int admitted = 0;
    for (int i = 0; i < lines; ++i)
      if (writer.admits(LogLevel::info, at_ns)) append(writer, 0, "line"), ++admitted;
    return admitted;
  };
  CHECK(say(100 * kSecondNs, 30) == 10);
  CHECK(log.dropped() == 20);
  CHECK(say(100 * kSecondNs + kSecondNs / 5 - 1, 5) == 0);
  CHECK(say(100 * kSecondNs + kSecondNs / 5, 5) == 1);
  const std::vector<LogLine> lines = taken(reader, log);
  REQUIRE(lines.size() == 11);
  CHECK(lines[9].dropped == 0);
  CHECK(lines[10].dropped == 25);
  CHECK(with_dropped(lines[10].text.text(), lines[10].dropped) == "line (25 lines before it were dropped)");
  CHECK(with_dropped("line", 1) == "line (1 line before it was dropped)");
  CHECK(with_dropped("line", 0) == "line");
  int in_a_minute = 0;
  for (int i = 0; i < 60 * 100; ++i) in_a_minute += say(200 * kSecondNs + i * kSecondNs / 100, 1);
  CHECK(in_a_minute == 10 + 60 * 5 - 1);  // the last fifth of a second is not over
}

TEST_CASE("warnings and errors have an allowance of their own, which the others cannot use up") {
  NodeLog log;
  LogWriter writer(log);
  int chatter = 0;
  for (int i = 0; i < 100; ++i) chatter += writer.admits(i % 2 == 0 ? LogLevel::debug : LogLevel::info, kSecondNs);
  CHECK(chatter == 10);
  int serious = 0;
  for (int i = 0; i < 100; ++i) serious += writer.admits(i % 2 == 0 ? LogLevel::warning : LogLevel::error, kSecondNs);
  CHECK(serious == 10);
}

TEST_CASE("what is written over before it is read counts as missed; the newest lines are there") {
  NodeLog log;
  LogWriter writer(log);
  LogReader reader;
  for (uint64_t i = 0; i < NodeLog::kKept + 8; ++i) append(writer, i, std::to_string(i));
  const std::vector<LogLine> lines = taken(reader, log);
  REQUIRE(lines.size() == NodeLog::kKept);
  CHECK(lines.front().text.text() == "8");
  CHECK(reader.missed() == 8);
  CHECK(taken(reader, log).empty());
}

TEST_CASE("a reader beside a writer that never stops sees whole lines only, in their order") {
  NodeLog log;
  constexpr uint64_t kLines = 200'000;
  std::thread writing([&] {
    LogWriter writer(log);
    for (uint64_t i = 0; i < kLines; ++i) append(writer, i, std::string(1 + i % 150, static_cast<char>('a' + i % 26)));
  });
  LogReader reader;
  uint64_t seen = 0, torn = 0, next = 0;
  do {
    reader.take(log, [&](const LogLine& line) {
      const uint64_t i = line.job;
      torn += i < next || line.text.text() != std::string(1 + i % 150, static_cast<char>('a' + i % 26));
      next = i + 1, ++seen;
    });
  } while (seen + reader.missed() < kLines);
  writing.join();
  CHECK(torn == 0);
  CHECK(seen > 0);
  CHECK(seen + reader.missed() == kLines);
}

TEST_CASE("levels by name and number") {
  for (uint8_t i = 0; i < kLogLevels; ++i)
    CHECK(log_level(to_string(static_cast<LogLevel>(i))) == static_cast<LogLevel>(i));
  CHECK(to_string(static_cast<LogLevel>(200)) == "error");
  CHECK(!log_level("fatal"));
}

TEST_CASE("in a run the lines stand on the board of the run") {
  Plan plan;
  Talker talker;
  test::add_task(plan, talker, "talker", 0);
  VirtualClock clock(kSecondNs);
  RunBoard board(plan);
  const auto transport = make_local_transport(plan.ports);
  Executor::Options options;
  options.duration_ns = 300'000'000;
  options.board = &board;
  Executor(plan, *transport, clock, options).run();
  CHECK(board.log(0).size() == 3);
  LogReader reader;
  const std::vector<LogLine> lines = taken(reader, board.log(0));
  REQUIRE(lines.size() == 3);
  CHECK(lines[2].text.text() == "job 2, 0.25 m");
  CHECK(lines[2].at_ns > lines[1].at_ns);
}
