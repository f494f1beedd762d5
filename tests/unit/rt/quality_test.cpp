// SPDX-License-Identifier: Apache-2.0
// The quality controller alone, on made load traces: when it lowers, when it raises, what it leaves alone.
#include "rt/sched/quality.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <vector>

#include "rt/node.hpp"
#include "tests/nanoseconds.hpp"

namespace {

using namespace takt;
using test::kMs;
constexpr int64_t kBudget = 20 * kMs;

/// A node whose job at level l takes load(job) * cost(l), released at `hz`, alone on its machine.
struct Drive {
  std::vector<QualityLevel> levels{{"full", 1.0}, {"half", 0.3}};
  double hz = 15;
  int64_t budget_ns = kBudget, deadline_ns = 66 * kMs;
  std::function<double(int64_t job, int level)> exec_ms = [](int64_t, int) { return 0.0; };

  struct Trace {
    std::vector<int> level;  ///< of each job
    std::vector<char> overran;
    int changes = 0, overruns = 0;
  };

  int64_t release(int64_t job) const { return static_cast<int64_t>(static_cast<double>(job) * 1e9 / hz); }
  Trace run(int64_t jobs) const {
    QualityControl control(levels, budget_ns, deadline_ns);
    Trace trace;
    for (int64_t k = 0; k < jobs; ++k) {
      const int level = control.level();
      const auto exec_ns = static_cast<int64_t>(exec_ms(k, level) * 1e6);
      trace.level.push_back(level);
      trace.overran.push_back(exec_ns > budget_ns);
      trace.overruns += exec_ns > budget_ns;
      trace.changes += control.observe({release(k), exec_ns, exec_ns + kMs, false}) != level;
    }
    return trace;
  }
  /// Execution times of a node that takes load(job) ms at level 0.
  std::function<double(int64_t, int)> scaled(std::function<double(int64_t)> load) const {
    return [load = std::move(load), this](int64_t k, int level) {
      return load(k) * levels[static_cast<size_t>(level)].cost;
    };
  }
  double seconds(int64_t jobs) const { return static_cast<double>(jobs) / hz; }
};

/// Jobs from `from` until level 0 is back.
int64_t jobs_until_full(const Drive::Trace& trace, int64_t from) {
  int64_t k = from;
  while (k < static_cast<int64_t>(trace.level.size()) && trace.level[static_cast<size_t>(k)] != 0) ++k;
  return k - from;
}

}  // namespace

TEST_CASE("a load that fits, even barely, never leaves level 0") {
  Drive drive;
  for (const double ms : {0.0, 10.0, 19.0, 20.0}) {
    drive.exec_ms = drive.scaled([ms](int64_t) { return ms; });
    const auto trace = drive.run(2000);
    CHECK(trace.changes == 0);
    CHECK(trace.level.back() == 0);
  }
}

TEST_CASE("an overrun lowers the next job; one outlier costs about a second of quality") {
  Drive drive;
  drive.exec_ms = drive.scaled([](int64_t k) { return k == 100 ? 30.0 : 9.0; });
  const auto trace = drive.run(300);
  CHECK(trace.level[100] == 0);
  CHECK(trace.level[101] == 1);
  CHECK(trace.overruns == 1);
  CHECK(trace.changes == 2);
  CHECK(drive.seconds(jobs_until_full(trace, 101)) < 1.2);
}

TEST_CASE("a load that grows steadily is lowered before its first overrun") {
  Drive drive;
  for (const double step : {0.05, 0.3, 1.0, 2.0, 4.0}) {
    drive.exec_ms = drive.scaled([step](int64_t k) { return std::min(50.0, 6 + step * static_cast<double>(k)); });
    const auto trace = drive.run(450);
    CAPTURE(step);
    CHECK(trace.overruns == 0);
    CHECK(trace.level.back() == 1);
  }
}

TEST_CASE("twice the budget for 20 s: one overrun, then none; level 0 within 5 s of the end, at any rate from 2 Hz") {
  for (const double hz : {2.0, 5.0, 7.0, 15.0, 30.0, 100.0}) {
    Drive drive;
    drive.hz = hz;
    const auto begin = static_cast<int64_t>(5 * hz), end = static_cast<int64_t>(25 * hz);
    drive.exec_ms = drive.scaled([=](int64_t k) { return k >= begin && k < end ? 40.0 : 9.0; });
    const auto trace = drive.run(static_cast<int64_t>(40 * hz));
    CAPTURE(hz);
    CHECK(trace.overruns == 1);
    CHECK(trace.changes == 2);
    CHECK(drive.seconds(jobs_until_full(trace, end)) < 5);
  }
}

TEST_CASE("a cause that the lower level does not show is tried for, ever more rarely, and its end is still found") {
  Drive drive;
  constexpr int64_t begin = 75, end = begin + 60 * 15;
  drive.exec_ms = [](int64_t k, int level) {
    const double extra = k >= begin && k < end && level == 0 ? 31 : 0;
    return (level == 0 ? 9.0 : 2.7) + extra;
  };
  const auto trace = drive.run(end + 20 * 15);
  CHECK(trace.overruns <= 2 + 60 / 4 + 1);
  CHECK(trace.overruns >= 60 / 4 - 2);
  CHECK(drive.seconds(jobs_until_full(trace, end)) < 4.2);
  CHECK(trace.level.back() == 0);
}

TEST_CASE("a lower level that is declared too cheap: its fall at the cause's end brings level 0 back in time") {
  for (const double hz : {2.0, 7.0, 15.0, 100.0}) {
    Drive drive;  // level 1 is said to take 0.3, and really takes 0.6 of level 0
    drive.hz = hz;
    const auto begin = static_cast<int64_t>(5 * hz), end = static_cast<int64_t>(25 * hz);
    drive.exec_ms = [=](int64_t k, int level) {
      return (k >= begin && k < end ? 30.0 : 15.0) * (level == 0 ? 1.0 : 0.6);
    };
    const auto trace = drive.run(static_cast<int64_t>(60 * hz));
    CAPTURE(hz);
    CHECK(trace.overruns == 1);
    CHECK(trace.changes == 2);
    CHECK(drive.seconds(jobs_until_full(trace, end)) <= 5);
  }
}

TEST_CASE("declared too cheap, and the end of the cause hardly shows: late, but level 0 comes back") {
  Drive drive;
  constexpr int64_t begin = 75, end = begin + 5 * 15;
  drive.exec_ms = [](int64_t k, int level) { return (k >= begin && k < end ? 21.0 : 18.0) * (level == 0 ? 1.0 : 0.6); };
  const auto trace = drive.run(end + 60 * 15);
  CHECK(trace.overruns == 1);
  CHECK(trace.level.back() == 0);
  CHECK(drive.seconds(jobs_until_full(trace, end)) > 10);
  CHECK(drive.seconds(jobs_until_full(trace, end)) <= 31);
}

TEST_CASE("a cause that weakens, but not enough, costs one attempt") {
  Drive drive;
  drive.exec_ms = drive.scaled([](int64_t k) { return k < 75 ? 9.0 : k < 225 ? 60.0 : 30.0; });
  const auto trace = drive.run(500);
  CHECK(trace.overruns == 2);
  CHECK(trace.level.back() == 1);
}

TEST_CASE("while a visible cause lasts for minutes, only blind raises overrun") {
  Drive drive;
  drive.exec_ms = drive.scaled([](int64_t) { return 40.0; });
  const auto trace = drive.run(15 * 300);
  CHECK(trace.overruns <= 1 + 300 / 30);
  CHECK(trace.overruns >= 2);
}

TEST_CASE("of several levels the best that fits is taken, down and up") {
  Drive drive;
  drive.levels = {{"full", 1.0}, {"fine", 0.6}, {"half", 0.3}, {"least", 0.1}};
  drive.exec_ms = drive.scaled([](int64_t k) { return k < 50 ? 10.0 : k < 200 ? 50.0 : k < 400 ? 25.0 : 12.0; });
  const auto trace = drive.run(600);
  CHECK(trace.level[51] == 2);  // 50 * 0.3 = 15 <= 17
  CHECK(trace.level[199] == 2);
  CHECK(trace.level[399] == 1);  // 25 * 0.6 = 15
  CHECK(trace.level[599] == 0);
  CHECK(trace.overruns == 1);
}

TEST_CASE("one missed deadline without an overrun is somebody else's doing, two in a row are answered") {
  QualityControl control(Drive().levels, kBudget, 66 * kMs);
  int64_t k = 0;
  const auto job = [&](int64_t response_ms) {
    return control.observe({++k * 66 * kMs, 9 * kMs, response_ms * kMs, false});
  };
  CHECK(job(10) == 0);
  CHECK(job(70) == 0);
  CHECK(job(10) == 0);
  CHECK(job(70) == 0);
  CHECK(job(70) == 1);
}

TEST_CASE("a level that fits its budget but not the deadline, because others run before it, is not taken back") {
  QualityControl control(Drive().levels, kBudget, 66 * kMs);
  int64_t k = 0;
  const auto run = [&](int count, int64_t wait_ms) {
    for (int i = 0; i < count; ++i) control.observe({++k * 66 * kMs, 3 * kMs, (3 + wait_ms) * kMs, false});
    return control.level();
  };
  control.observe({0, 40 * kMs, 41 * kMs, false});
  CHECK(run(200, 58) == 1);  // 10 + 58 would be late
  CHECK(run(200, 50) == 0);
}

TEST_CASE("jobs that found nothing to do say nothing about the load") {
  QualityControl control(Drive().levels, kBudget, 66 * kMs);
  CHECK(control.observe({0, 40 * kMs, 41 * kMs, false}) == 1);
  for (int k = 1; k < 1000; ++k) REQUIRE(control.observe({k * 66 * kMs, kMs / 100, kMs, true}) == 1);
}

TEST_CASE("without a budget the deadline is the capacity; with one level nothing happens") {
  QualityControl no_budget(Drive().levels, 0, 66 * kMs);
  CHECK(no_budget.observe({0, 60 * kMs, 61 * kMs, false}) == 0);
  CHECK(no_budget.observe({66 * kMs, 67 * kMs, 68 * kMs, false}) == 1);
  QualityControl long_budget(Drive().levels, 100 * kMs, 66 * kMs);
  CHECK(long_budget.observe({0, 67 * kMs, 68 * kMs, false}) == 1);
  const std::vector<QualityLevel> one{{"full", 1.0}};
  QualityControl single(one, kBudget, 66 * kMs);
  CHECK(single.observe({0, 100 * kMs, 101 * kMs, false}) == 0);
}

TEST_CASE("levels must fall in cost from 1") {
  struct Bare final : Node {
    void setup(Setup&) override {}
    void run(Job&) override {}
  } node;
  CHECK(node.levels().size() == 1);
  CHECK_THROWS_AS(Levels(&node, {}), std::logic_error);
  CHECK_THROWS_AS(Levels(&node, {{"full", 0.9}}), std::logic_error);
  CHECK_THROWS_AS(Levels(&node, {{"full", 1.0}, {"half", 1.0}}), std::logic_error);
  CHECK_THROWS_AS(Levels(&node, {{"full", 1.0}, {"none", 0.0}}), std::logic_error);
  CHECK_THROWS_AS(Levels(&node, {{"a", 1.0}, {"b", 0.5}, {"c", 0.4}, {"d", 0.3}, {"e", 0.2}}), std::logic_error);
  Levels(&node, {{"full", 1.0}, {"half", 0.5}});
  CHECK(node.levels()[1].name == "half");
}
