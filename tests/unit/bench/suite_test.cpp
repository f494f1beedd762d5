// SPDX-License-Identifier: Apache-2.0
#include "bench/suite.hpp"

#include <doctest/doctest.h>

using namespace takt::bench;

namespace {

std::vector<Row> nothing(const Options&) { return {}; }
std::vector<std::string> two() { return {"idle", "loaded"}; }

}  // namespace

TEST_CASE("a suite measures one of its conditions alone, and says which ones it has when asked for another") {
  const Suite suite{"release", "", nothing, two};
  CHECK(refused_condition(suite, "").empty());
  CHECK(refused_condition(suite, "loaded").empty());
  CHECK(refused_condition(suite, "load") == "no condition `load` in suite release; there are:\n  idle\n  loaded");
}

TEST_CASE("a suite without conditions is measured as a whole") {
  const Suite suite{"stereo", "", nothing};
  CHECK(refused_condition(suite, "").empty());
  CHECK(refused_condition(suite, "idle") == "suite stereo is measured as a whole; leave out --only");
}

TEST_CASE("without a choice every condition is wanted, else the one that is named") {
  Options options;
  CHECK(options.wants("idle"));
  options.only = "loaded";
  CHECK(options.wants("loaded"));
  CHECK_FALSE(options.wants("load"));
}
