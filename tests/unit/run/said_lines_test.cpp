// SPDX-License-Identifier: Apache-2.0
#include "graph/run/said_lines.hpp"

#include <doctest/doctest.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "tests/unit/rt/plans.hpp"

using namespace takt;
using namespace takt::command;

namespace {

struct Said {
  test::Idle first, second;
  Plan plan;
  std::unique_ptr<RunBoard> board;
  Said() {
    test::add_task(plan, first, "stereo", 0);
    test::add_task(plan, second, "mapping", 0);
    board = std::make_unique<RunBoard>(plan);
    board->epoch_ns().store(1'000'000'000);
  }
  void say(size_t task, int64_t at_ns, LogLevel level, const char* text, uint32_t dropped = 0) {
    LogWriter writer(board->log(task));
    for (uint32_t i = 0; i < 10 + dropped && dropped > 0; ++i) writer.admits(level, 0);
    LogLine line;
    line.at_ns = at_ns;
    line.level = level;
    line.text = BoundedText<200>(text);
    writer.append(line);
  }
};

}  // namespace

TEST_CASE("lines of all nodes come in the order of their instants, from info on, each once") {
  Said said;
  SaidLines lines(said.plan, *said.board, false);
  said.say(0, 3'500'000'000, LogLevel::warning, "too dark", 2);
  said.say(0, 3'600'000'000, LogLevel::debug, "17 rows");
  said.say(1, 2'250'000'000, LogLevel::info, "begins");
  CHECK(lines.take() == std::vector<std::string>{"1.250 s mapping: info: begins",
                                                 "2.500 s stereo: warning: too dark (2 lines before it were dropped)"});
  CHECK(lines.take().empty());
  said.say(1, 4'000'000'000, LogLevel::error, "a\x1b[2Jb");
  CHECK(lines.take() == std::vector<std::string>{"3.000 s mapping: error: a [2Jb"});
}

TEST_CASE("in the journal each line has its priority; what was written over is told") {
  Said said;
  SaidLines lines(said.plan, *said.board, true);
  for (uint64_t i = 0; i < NodeLog::kKept + 3; ++i) said.say(0, 2'000'000'000, LogLevel::debug, "one");
  said.say(1, 2'000'000'000, LogLevel::info, "two");
  said.say(1, 2'000'000'000, LogLevel::error, "three");
  CHECK(lines.take() ==
        std::vector<std::string>{"<6>1.000 s mapping: info: two", "<3>1.000 s mapping: error: three",
                                 "<4>1.000 s takt: warning: 3 lines came too fast to be shown; a record "
                                 "has them"});
}

TEST_CASE("a stream is the journal's where systemd says so") {
  struct stat file {};
  REQUIRE(fstat(1, &file) == 0);
  setenv("JOURNAL_STREAM", (std::to_string(file.st_dev) + ":" + std::to_string(file.st_ino)).c_str(), 1);
  CHECK(in_journal(1));
  setenv("JOURNAL_STREAM", "1:1", 1);
  CHECK(!in_journal(1));
  unsetenv("JOURNAL_STREAM");
  CHECK(!in_journal(1));
}
