// SPDX-License-Identifier: Apache-2.0
#include "graph/run/told_lines.hpp"

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

using takt::command::ToldLines;

TEST_CASE("what processes tell is there once, however often one is started, and no more than there is room for") {
  ToldLines told;
  CHECK(told.lines().empty());
  for (const char* line : {"camera: 3 files are left out", "laser: line 7 is cut off", "camera: 3 files are left out"}) {
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      told.tell({line});
      _exit(0);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(status == 0);
  }
  CHECK(told.lines() == std::vector<std::string>{"camera: 3 files are left out", "laser: line 7 is cut off"});
  told.tell(std::vector<std::string>(200, std::string(1000, 'x')));
  CHECK(told.lines().size() >= 3);
}
