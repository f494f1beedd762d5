// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "tests/temporary_folder.hpp"

namespace takt::test {

/// A FIFO, written to by somebody else.
struct Fifo {
  TemporaryFolder folder;
  std::filesystem::path in = folder.path / "tasks", out = folder.path / "speech";
  Fifo() { REQUIRE(mkfifo(in.c_str(), 0600) == 0); }
  void write(const std::string& text) const {
    const int fd = open(in.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    REQUIRE(fd >= 0);
    CHECK(::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
    close(fd);
  }
};

}  // namespace takt::test
