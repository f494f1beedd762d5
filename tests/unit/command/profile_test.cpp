// SPDX-License-Identifier: Apache-2.0
#include "graph/command/profile.hpp"

#include <doctest/doctest.h>

#include "rt/machine/parse.hpp"
#include "tests/nanoseconds.hpp"

using namespace takt;
using namespace takt::command;

namespace {

using test::kMs;

/// `count` jobs of so long, and one of `longest`.
NodeProfile node(const char* name, int64_t alone_ns, int64_t together_ns, int count, int64_t longest_ns) {
  NodeProfile profile;
  profile.name = name;
  for (int i = 0; i < count; ++i) {
    profile.alone.add(alone_ns);
    profile.together.add(together_ns);
  }
  profile.together.add(longest_ns);
  return profile;
}

bool about(int64_t ns, int64_t wanted_ns) { return ns >= wanted_ns && ns <= wanted_ns + wanted_ns / 100; }

}  // namespace

TEST_CASE("a budget is the margin times the larger quantile of both passes; nodes without a job get none") {
  std::vector<NodeProfile> nodes{node("a", 2 * kMs, 3 * kMs, 200, 50 * kMs), node("b", 5 * kMs, 4 * kMs, 200, kMs)};
  nodes.emplace_back().name = "idle";
  const auto budgets = budgets_of(nodes, 0.99, 1.5);
  REQUIRE(budgets.size() == 2);
  CHECK(about(budgets.at("a"), 3 * kMs * 3 / 2));
  CHECK(about(budgets.at("b"), 5 * kMs * 3 / 2));
  CHECK(about(budgets_of(nodes, 1.0, 1.0).at("a"), 50 * kMs));
}

TEST_CASE("too few jobs for a quantile are told, and the largest counts") {
  const NodeProfile few = node("few", 2 * kMs, 2 * kMs, 20, 9 * kMs);
  CHECK(!few.enough_for(0.99));
  CHECK(few.enough_for(0.9));
  CHECK(about(few.quantile_ns(0.99), 9 * kMs));
  std::vector<NodeProfile> nodes{few};
  nodes.emplace_back().name = "idle";
  const std::string text = profile_text(nodes, 0.99, 1.2);
  CHECK(text.find("so the largest counts:\n  few\n") != std::string::npos);
  CHECK(text.find("the budget stays:\n  idle\n") != std::string::npos);
  machine::for_each_line(text, [](std::string_view line) { CHECK(line.size() <= 80); });
}

TEST_CASE("drift: above the stored quantile or above the budget, by more than the tolerance") {
  std::vector<NodeProfile> nodes{node("kept", 5 * kMs, 5 * kMs, 200, kMs), node("slower", 5 * kMs, 5 * kMs, 200, kMs),
                                 node("burst", 5 * kMs, 5 * kMs, 200, kMs), node("unknown", kMs, kMs, 200, kMs)};
  nodes[0].budget_ns = 5 * kMs;
  nodes[1].budget_ns = 20 * kMs;
  nodes[2].budget_ns = 4 * kMs;
  nodes.emplace_back().name = "idle";
  nodes.back().budget_ns = kMs;
  graph::ScheduleSpec schedule;
  schedule.measured.emplace();
  schedule.measured->nodes["kept"].exec_ns = 45 * kMs / 10;
  schedule.measured->nodes["slower"].exec_ns = 4 * kMs;
  const auto drifts = drift_of(nodes, schedule, 0.99, 0.2);
  REQUIRE(drifts.size() == 5);
  CHECK(drifts[0].ok());
  CHECK(drifts[1].above_stored);
  CHECK(!drifts[1].above_budget);
  CHECK(drifts[2].above_budget);
  CHECK(drifts[3].ok());
  CHECK(drifts[4].ok());
  CHECK(!drifts[4].measured);
  CHECK(drift_of(nodes, schedule, 0.99, 0.3)[1].ok());
  // As long as before, and a nanosecond longer.
  schedule.measured->nodes["slower"].exec_ns = nodes[1].quantile_ns(0.99);
  CHECK(drift_of(nodes, schedule, 0.99, 0)[1].ok());
  schedule.measured->nodes["slower"].exec_ns -= 1;
  CHECK(drift_of(nodes, schedule, 0.99, 0)[1].above_stored);
  schedule.measured.reset();  // then the budget alone counts
  CHECK(drift_of(nodes, schedule, 0.99, 0.2)[1].ok());
  CHECK(drift_of(nodes, schedule, 0.99, 0.2)[2].above_budget);
  const std::string text = drift_text(drifts, 0.2);
  CHECK(text.find("ABOVE stored") != std::string::npos);
  CHECK(text.find("2 of 5 nodes above by more than 20 %") != std::string::npos);
  machine::for_each_line(text, [](std::string_view line) { CHECK(line.size() <= 80); });
}

TEST_CASE("tolerances") {
  CHECK(parse_tolerance("20%") == 0.2);
  CHECK(parse_tolerance("0.5") == 0.5);
  CHECK(parse_tolerance("0%") == 0.0);
  for (const char* wrong : {"", "x", "20 %", "-5%", "20%%", "inf"}) {
    CAPTURE(wrong);
    CHECK(!parse_tolerance(wrong));
  }
}
