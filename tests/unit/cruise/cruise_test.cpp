// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "rt/msg/velocity_command.hpp"
#include "tests/unit/mapping_3d/node_harness.hpp"

namespace takt {
void register_cruise(NodeTypes& types);
}

using namespace takt;

TEST_CASE("cruise wants its speeds between its two instants, and to stand before and afterwards") {
  NodeTypes types;
  register_cruise(types);
  const auto node = types.find("cruise")->make();
  test::set(*node, "speed", 0.8);
  test::set(*node, "turn", -0.3);
  test::set(*node, "from", 1.0);
  test::set(*node, "until", 2.0);
  constexpr int64_t kEpoch = 5'000'000'000;
  VirtualClock clock(kEpoch);
  Setup setup{clock, ".", ".", 0, Rate{10, 1}, 0};
  node->setup(setup);
  test::BoxWriter<VelocityCommand> out(*node->outputs()[0]);
  node->start(kEpoch);
  for (uint64_t k = 0; k < 30; ++k) {
    const int64_t release = Rate{10, 1}.release_ns(kEpoch, static_cast<int64_t>(k));
    Job job(clock, k, release, release + 100'000'000, 0, "full");
    out.clear();
    node->run(job);
    REQUIRE(out.sent());
    CHECK(out.stamp_ns() == release);
    const bool drives = k >= 10 && k < 20;
    CHECK(out.message().speed_m_s == (drives ? 0.8 : 0.0));
    CHECK(out.message().turn_rad_s == (drives ? -0.3 : 0.0));
  }
}
