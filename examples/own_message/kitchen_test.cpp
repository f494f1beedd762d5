// SPDX-License-Identifier: Apache-2.0
// One node alone, then the whole graph in virtual time. Any test framework does; this test uses none.
#include <cstdio>
#include <takt/graph_testing.hpp>
#include <takt/testing.hpp>

#include "registration.hpp"

int failed = 0;
void check(bool good, const char* what) {
  std::printf("%s: %s\n", good ? "ok" : "FAILED", what);
  failed += !good;
}

int main() {
  takt::NodeTest<Alarm> alarm;
  alarm.put("measured", 7, [](Temperature& message) { message.celsius = 25.0; });
  alarm.run();
  check(!alarm.out<Temperature>("hot"), "no alarm at the limit");
  alarm.put("measured", 8, [](Temperature& message) { message.celsius = 25.5; });
  alarm.run();
  check(alarm.out<Temperature>("hot") && alarm.stamp_ns("hot") == 8, "an alarm above it, with the stamp");
  alarm.run();
  check(!alarm.out<Temperature>("hot"), "one alarm for each message");

  takt::Registry registry;
  register_kitchen(registry);
  takt::GraphTest kitchen("kitchen.yaml", registry);
  kitchen.watch("alarm.hot");
  check(kitchen.run_for(3.0) == 0, "the graph runs for 3 s of virtual time");
  check(kitchen.count("alarm.hot") == 9, "9 of 30 temperatures are above 30 degrees");
  check(kitchen.message<Temperature>("alarm.hot", 0).number == 21, "the first one is number 21");
  check(kitchen.figure("nodes/oven/completed") == 30, "the oven missed no job");
  return failed;
}
