// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/wall_stamps.hpp"

#include <doctest/doctest.h>

namespace takt::attach {

TEST_CASE("equal stamps stay equal until the wall clock moves") {
  WallStamps stamps;
  CHECK(stamps.look(1'000'000'000'000, 5'000));
  CHECK(stamps.of(6'000) == 1'000'000'001'000);
  CHECK_FALSE(stamps.look(1'000'000'000'000 + WallStamps::kStep_ns, 5'000));  // slewed: not followed yet
  CHECK(stamps.of(6'000) == 1'000'000'001'000);
  CHECK(stamps.look(1'000'000'000'001 + WallStamps::kStep_ns, 5'000));
  CHECK(stamps.of(6'000) == 1'000'000'001'001 + WallStamps::kStep_ns);
}

}  // namespace takt::attach
