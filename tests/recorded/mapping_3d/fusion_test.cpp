// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <stdexcept>

#include "nodes/mapping_3d/evaluate.hpp"
#include "tests/recorded/recording.hpp"

using namespace takt::mapping_3d;
using takt::test::recording;

TEST_CASE("median fusion of recorded depth images") {
  const auto folder = recording("clouds/rgbd_poses");
  std::vector<std::string> left_out;
  const FusionEvaluation e = evaluate_recorded(folder, 1, left_out);
  CHECK(left_out.empty());
  CHECK(e.methods.back().outliers_pct < e.methods[0].outliers_pct);
  CHECK_THROWS_WITH_AS(evaluate_recorded(folder / "depth", 1, left_out), doctest::Contains("pose.txt"),
                       std::runtime_error);
}
