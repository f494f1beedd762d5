// SPDX-License-Identifier: Apache-2.0
#include "graph/check/measured.hpp"

#include <doctest/doctest.h>

using namespace takt;
using namespace takt::graph;

TEST_CASE("budgets that were measured elsewhere are told from those of this machine and from estimates") {
  const machine::Identity here{"CPU A", 2, "6.1 #1"};
  ScheduleSpec schedule;
  CHECK(measured_elsewhere(schedule, here).empty());
  schedule.measured.emplace();
  schedule.measured->machine = here;
  schedule.measured->position = {"s.yaml", 7, 1};
  CHECK(measured_elsewhere(schedule, here).empty());
  schedule.measured->machine.cores = 4;
  const std::string warning = measured_elsewhere(schedule, here);
  CHECK(warning.find("s.yaml:7:1: warning: ") == 0);
  CHECK(warning.find("cores `4`, here `2`") != std::string::npos);
  CHECK(warning.find("processor") == std::string::npos);
  schedule.measured->machine = {"CPU B", 2, "6.2 #1"};
  CHECK(measured_elsewhere(schedule, here).find("processor `CPU B`, here `CPU A`; kernel") != std::string::npos);
}
