// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "graph/ace/ace_registry.hpp"

using namespace takt;

// tests/integration/snapshots.sh tells whether it is all.
TEST_CASE("every node of the robot declares what it carries from one job to the next") {
  const Registry registry = ace_registry();
  for (const auto& [name, type] : registry.nodes.all()) {
    CAPTURE(name);
    CHECK(type.make()->declares_state());
  }
}
