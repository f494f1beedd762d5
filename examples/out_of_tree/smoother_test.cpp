// SPDX-License-Identifier: Apache-2.0
// Any test framework does; this test uses none.
#include "smoother.hpp"

#include <cstdio>
#include <takt/testing.hpp>

int main() {
  takt::NodeTest<Smoother> test;
  test.set("step", 0.25);
  test.put("in", 7, [](takt::VelocityCommand& wanted) { wanted.speed_m_s = 0.6; });
  for (const double expected : {0.25, 0.5, 0.6, 0.6}) {
    test.run();
    const auto* sent = test.out<takt::VelocityCommand>("out");
    if (!sent || sent->speed_m_s != expected || test.stamp_ns("out") != 7) return std::puts("FAILED"), 1;
    std::printf("job %d: %g m/s\n", static_cast<int>(test.job().index()), sent->speed_m_s);
  }
  test.empty("in");
  if (test.run() || test.out<takt::VelocityCommand>("out")) return std::puts("FAILED"), 1;
  return std::puts("no input: no result"), 0;
}
