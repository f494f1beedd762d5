// SPDX-License-Identifier: Apache-2.0
#include "hal/own_folder.hpp"

#include <doctest/doctest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/temporary_folder.hpp"

using namespace takt;

namespace {

namespace fs = std::filesystem;

size_t folders_in(const fs::path& parent) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(parent), fs::directory_iterator()));
}

}  // namespace

TEST_CASE("own folder: goes with its owner, and a killed process's with the next one") {
  const test::TemporaryFolder parent;
  const pid_t child = fork();
  if (child == 0) {
    const hal::OwnFolder killed(parent.path, "lines-");
    fs::create_directory(killed.path() / "within");
    raise(SIGKILL);
  }
  REQUIRE(child > 0);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(WIFSIGNALED(status));
  CHECK(folders_in(parent.path) == 1);
  fs::create_directory(parent.path / "others");
  {
    const hal::OwnFolder mine(parent.path, "lines-");
    CHECK(fs::is_directory(mine.path()));
    CHECK(folders_in(parent.path) == 2);  // mine and what has another name
    const hal::OwnFolder more(parent.path, "lines-");
    CHECK(fs::is_directory(mine.path()));
    CHECK(folders_in(parent.path) == 3);
  }
  CHECK(folders_in(parent.path) == 1);
  CHECK(hal::OwnFolder(parent.path / "absent", "lines-").path().empty());
}
