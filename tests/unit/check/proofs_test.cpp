// SPDX-License-Identifier: Apache-2.0
// What a check admits, and with which overheads.
#include "graph/check/proofs.hpp"

#include <doctest/doctest.h>

#include "tests/unit/check/plans.hpp"

using namespace takt;
using namespace takt::graph;

namespace {

CheckMachine measured_machine(double release_us, double worst_us) {
  CheckMachine machine;
  machine.measured = true;
  machine.overheads_from = "overheads measured";
  machine.overheads.release_ns = static_cast<int64_t>(release_us * 1e3);
  machine.worst = machine.overheads;
  machine.worst->release_ns = static_cast<int64_t>(worst_us * 1e3);
  return machine;
}

Plan one_task() { return test::plan_of(Policy::fixed, {0}, {test::task("a", 10, 20, 50)}); }

int64_t response_ns(const CheckResult& result) {
  return result.modes.front().admission.nodes.front().response_ns.value_or(0);
}

}  // namespace

TEST_CASE("a plan that the worst overheads admit is admitted with them, and its bounds are theirs") {
  const CheckMachine machine = measured_machine(50, 500);
  const CheckResult result = check({}, one_task(), {machine});
  CHECK(result.admitted);
  CHECK(result.basis == OverheadBasis::worst);
  CHECK(response_ns(result) == 20'500'000);
  CHECK(result.json["overheads"]["basis"] == "worst");
  CHECK(result.json["overheads"]["release_us"] == doctest::Approx(500));
  CHECK(result.text.find("overheads measured: the worst, and 20 % more") != std::string::npos);
  const Proofs proofs = proofs_of(one_task(), result, machine);
  CHECK(proofs.stall_ns == 500'000);
  CHECK(proofs.response(0, 0).bound_ns == 20'500'000);
}

TEST_CASE("a plan that only the percentiles admit says so, and why") {
  const CheckResult result = check({}, one_task(), {measured_machine(50, 40'000)});
  CHECK(result.admitted);
  CHECK(result.basis == OverheadBasis::p99);
  CHECK(response_ns(result) == 20'050'000);
  REQUIRE(result.notes.size() == 1);
  CHECK(result.notes[0].starts_with(
      "admitted at p99: with the worst overheads that were observed, and 20 % more, it is not"));
  CheckMachine machine = measured_machine(50, 0);
  machine.worst.reset();
  CHECK(check({}, one_task(), {machine}).basis == OverheadBasis::p99);
  CHECK(check({}, one_task(), {}).basis == OverheadBasis::assumed);
}

TEST_CASE("a kernel that does not preempt is noted where deadlines are promised in real time") {
  CheckMachine machine;
  machine.not_preemptible = "the kernel does not preempt";
  CheckOptions options{machine};
  CHECK(check({}, one_task(), options).notes == std::vector<std::string>{machine.not_preemptible});
  options.real_time = false;
  CHECK(check({}, one_task(), options).notes.empty());
}

TEST_CASE("proofs of each mode: what it leaves out has none, and what is not admitted has none at all") {
  Plan plan = test::plan_of(Policy::fixed, {0}, {test::task("a", 10, 20, 50), test::task("b", 10, 10, 90)});
  plan.modes = {{"full", {1, 1}}, {"half", {0, 1}}};
  const CheckResult result = check({}, plan);
  REQUIRE(result.admitted);
  const Proofs proofs = proofs_of(plan, result, {});
  CHECK(proofs.response(0, 1).bound_ns == 30'000'000);
  CHECK(proofs.response(1, 1).bound_ns == 10'000'000);
  CHECK(!proofs.response(1, 0).bound_ns);
  CHECK(proofs.response(1, 0).why == "the mode leaves it out");
  CHECK(proofs.edge(0, "a.out -> b.in").why == "the edge has no max_age");
  plan.tasks[0].budget_ns = 60'000'000;
  const Proofs none = proofs_of(plan, check({}, plan), {});
  CHECK(none.modes.empty());
  CHECK(none.response(0, 0).why.starts_with("the schedule is not admitted"));
}

TEST_CASE("a mode is checked on the cores that all lanes of the plan have") {
  // Alone, b and c would be put on one core each.
  Plan plan = test::plan_of(Policy::fixed, {0, 1},
                            {test::task("a", 10, 60, 90), test::task("b", 10, 20, 90), test::task("c", 10, 20, 80)});
  plan.modes = {{"full", {1, 1, 1}}, {"half", {0, 1, 1}}};
  const CheckResult result = check({}, plan);
  REQUIRE(result.admitted);
  const auto& half = result.modes[1].admission.nodes;
  CHECK(std::max(*half[0].response_ns, *half[1].response_ns) == 40'000'000);
}
