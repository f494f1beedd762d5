// SPDX-License-Identifier: Apache-2.0
// Exit 77 where there are no recordings: ctest then shows the program as skipped, not as passed.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <iostream>

#include "tests/recorded/recording.hpp"

int main(int argc, char** argv) {
  if (const auto folder = takt::test::data_folder(); !std::filesystem::is_directory(folder)) {
    std::cerr << "NOT RUN: the folder of recordings " << folder << " is missing; set TAKT_DATA to it\n";
    return 77;
  }
  return doctest::Context(argc, argv).run();
}
