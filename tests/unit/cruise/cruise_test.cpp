// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "rt/msg/velocity_command.hpp"
#include "rt/testing.hpp"

namespace takt {
void register_cruise(NodeTypes& types);
}

using namespace takt;

TEST_CASE("cruise wants its speeds between its two instants, and to stand before and afterwards") {
  NodeTypes types;
  register_cruise(types);
  NodeTest test(types.find("cruise")->make());
  test.set("speed", 0.8);
  test.set("turn", -0.3);
  test.set("from", 1.0);
  test.set("until", 2.0);
  for (int k = 0; k < 30; ++k) {
    test.run();
    const auto* command = test.out<VelocityCommand>("velocity");
    REQUIRE(command);
    CHECK(test.stamp_ns("velocity") == test.job().release_ns());
    const bool drives = k >= 10 && k < 20;
    CHECK(command->speed_m_s == (drives ? 0.8 : 0.0));
    CHECK(command->turn_rad_s == (drives ? -0.3 : 0.0));
  }
}
