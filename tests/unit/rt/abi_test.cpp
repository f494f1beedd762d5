// SPDX-License-Identifier: Apache-2.0
#include "rt/abi.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace takt;

TEST_CASE("libtakt_core says its version, and its ABI is that of what is built with it") {
  CHECK(std::string(version().number).starts_with("0."));
  CHECK(std::string(version().commit) != "");
  CHECK(version().abi == kAbi);
  CHECK(abi_difference(kAbi, version().abi) == "");
}

TEST_CASE("the difference of two ABIs is told property by property") {
  CHECK(abi_difference("compiler=clang 14;NDEBUG=not set;vectors=AVX", "compiler=gcc 12;NDEBUG=set;vectors=AVX") ==
        "compiler is clang 14, here gcc 12; NDEBUG is not set, here set");
  for (const char* other : {"", "compiler=gcc 12", "vectors=AVX;compiler=gcc 12", "rubbish"})
    CHECK_MESSAGE(
        abi_difference(other, "compiler=gcc 12;vectors=AVX").find("another version of Takt") != std::string::npos,
        other);
}
