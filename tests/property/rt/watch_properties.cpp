// SPDX-License-Identifier: Apache-2.0
// What the watchdog decides against a job that is followed microsecond by microsecond.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "rt/sched/watch_rules.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/property_scale.hpp"

namespace {

using namespace takt;
using test::kUs;

/// A job in steps of a microsecond: when it runs and when it is preempted, until it returns.
struct JobTrace {
  int64_t release_ns = 0, start_ns = 0;
  std::vector<char> runs;  ///< from start on, by microsecond

  int64_t end_ns() const { return start_ns + static_cast<int64_t>(runs.size()) * kUs; }
  int64_t cpu_ns(int64_t now_ns) const {
    const auto steps = static_cast<ptrdiff_t>(std::clamp<int64_t>((now_ns - start_ns) / kUs, 0, std::ssize(runs)));
    int64_t used = std::count(runs.begin(), runs.begin() + steps, 1) * kUs;
    if (steps < std::ssize(runs) && now_ns > start_ns && runs[static_cast<size_t>(steps)])
      used += (now_ns - start_ns) % kUs;
    return used;
  }
  /// First microsecond at whose end the budget is used up; end of the job if never.
  int64_t exhausted_ns(int64_t budget_ns) const {
    int64_t used = 0;
    for (size_t i = 0; i < runs.size(); ++i) {
      used += runs[i] ? kUs : 0;
      if (used >= budget_ns) return start_ns + static_cast<int64_t>(i + 1) * kUs;
    }
    return end_ns() + 1;
  }
};

JobTrace random_job(std::mt19937& random) {
  const auto draw = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  JobTrace job;
  job.release_ns = draw(0, 3000) * kUs;
  job.start_ns = job.release_ns + draw(0, 1) * draw(0, 2000) * kUs;
  for (int piece = draw(1, 8); piece > 0; --piece) {
    job.runs.insert(job.runs.end(), static_cast<size_t>(draw(1, 1500)), 1);
    job.runs.insert(job.runs.end(), static_cast<size_t>(draw(0, 1) * draw(0, 1500)), 0);
  }
  return job;
}

}  // namespace

TEST_CASE("an overrun is seen when it happens and at most a grain later, a miss and a hang at their instant") {
  std::mt19937 random(test::seed(5));
  const auto draw = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  int overruns = 0, misses = 0, hangs = 0;
  for (int round = 0; round < test::rounds(3000); ++round) {
    CAPTURE(round);
    const JobTrace job = random_job(random);
    WatchRules rules;
    rules.budget_ns = draw(1, 6000) * kUs;
    rules.deadline_ns = draw(1, 8000) * kUs;
    rules.patience_ns = draw(0, 3000) * kUs;
    rules.demote = draw(0, 2) != 0;
    rules.stop_on_overrun = draw(0, 2) == 0;
    rules.stop_on_miss = draw(0, 1) != 0;
    const int64_t exhausted = job.exhausted_ns(rules.budget_ns);
    const int64_t missed = job.release_ns + rules.deadline_ns + 1, hung = missed + rules.patience_ns;
    WatchSight sight;
    int64_t overrun_at = -1, miss_at = -1, hang_at = -1;
    int looks = 0;
    for (sight.now_ns = 0; sight.now_ns < job.end_ns(); ++looks) {
      // A job that is late to begin is looked for once a deadline, however short that is.
      REQUIRE(looks < 1000 + (job.start_ns - job.release_ns) / rules.deadline_ns);
      sight.running = sight.now_ns >= job.start_ns;
      sight.release_ns = job.release_ns;
      sight.cpu_left_ns = rules.budget_ns - job.cpu_ns(sight.now_ns);
      const WatchVerdict verdict = judge(rules, sight);
      if (verdict.overrun) overrun_at = sight.now_ns;
      if (verdict.miss) miss_at = sight.now_ns;
      if (verdict.hang) hang_at = sight.now_ns;
      sight.overrun_told = sight.overrun_told || verdict.overrun;
      sight.miss_told = sight.miss_told || verdict.miss;
      sight.hang_told = sight.hang_told || verdict.hang;
      if (verdict.overrun || verdict.miss || verdict.hang) continue;  // what comes next is asked for once more
      REQUIRE(verdict.look_again_ns > sight.now_ns);
      sight.now_ns = std::min(verdict.look_again_ns, job.end_ns());
    }
    if (rules.minds_overrun() && exhausted + kWatchGrain_ns < job.end_ns()) {
      CHECK(overrun_at >= exhausted);
      CHECK(overrun_at <= exhausted + kWatchGrain_ns);
      ++overruns;
    } else if (!rules.minds_overrun() || exhausted > job.end_ns()) {
      CHECK(overrun_at == -1);
    }
    const auto by_the_clock = [&](bool minds, int64_t due_ns, int64_t seen_ns, int& count) {
      if (minds && due_ns < job.end_ns() && due_ns <= job.start_ns) {  // begun too late
        CHECK(seen_ns <= job.start_ns + rules.deadline_ns);
        CHECK((seen_ns >= job.start_ns || seen_ns == -1));
        return;
      }
      const bool due = minds && due_ns < job.end_ns();
      CHECK(seen_ns == (due ? due_ns : -1));
      count += due;
    };
    by_the_clock(rules.stop_on_miss, missed, miss_at, misses);
    by_the_clock(true, hung, hang_at, hangs);
  }
  CHECK(overruns >= test::at_scale(300));
  CHECK(misses >= test::at_scale(300));
  CHECK(hangs >= test::at_scale(300));
}

namespace {

/// A low job on a core where a high one comes and goes, and between them the low lane's own watchdog, which runs only
/// when the high one does not; in microseconds.
struct WatchedCore {
  static constexpr int64_t kLook = 5;  ///< that long is a look
  int64_t release = 0, budget = 0, demand = 0;
  std::vector<std::pair<int64_t, int64_t>> high;  ///< from, to: it has the core
  static constexpr int64_t kShort = 20;           ///< up to that long it counts by its length

  int64_t now = 0, used = 0, looks = 0, preemptions = 0, short_us = 0, overrun_at = -1;
  bool ended() const { return used >= demand || overrun_at >= 0; }
  const std::pair<int64_t, int64_t>* runs_high() const {
    const auto one =
        std::find_if(high.begin(), high.end(), [&](const auto& h) { return h.first <= now && now < h.second; });
    return one == high.end() ? nullptr : &*one;
  }

  void run() {
    WatchRules rules;
    rules.budget_ns = budget * kUs;
    rules.deadline_ns = rules.patience_ns = 1'000'000 * kUs;
    rules.demote = true;
    int64_t next_look = release + budget, looking = 0;
    for (const std::pair<int64_t, int64_t>* last = nullptr; !ended(); ++now) {
      if (const auto* one = runs_high()) {
        const bool is_short = one->second - one->first <= kShort;
        if (now >= release) preemptions += !is_short && one != last, short_us += is_short;
        last = one;
        continue;
      }
      if (looking == 0 && now >= next_look) looking = kLook;
      if (looking > 0) {  // at its end it has seen and decided
        if (--looking == 0) next_look = look(rules);
      } else if (now >= release) {
        ++used;
      }
    }
  }
  int64_t look(const WatchRules& rules) {
    ++looks;
    WatchSight sight;
    sight.now_ns = (now + 1) * kUs;
    sight.running = used > 0;
    sight.release_ns = release * kUs;
    sight.cpu_left_ns = (budget - used) * kUs;
    const WatchVerdict verdict = judge_budget(rules, sight);
    if (verdict.overrun) overrun_at = used;
    return verdict.look_again_ns / kUs;
  }
};

}  // namespace

TEST_CASE("a lane's own watchdog looks no more often than is charged, and stops an overrun within a grain") {
  std::mt19937 random(test::seed(6));
  const auto draw = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  int overruns = 0, preempted = 0;
  for (int round = 0; round < test::rounds(2000); ++round) {
    CAPTURE(round);
    WatchedCore core;
    core.release = draw(0, 500);
    core.budget = draw(50, 4000);
    core.demand = std::max(1, static_cast<int>(core.budget) + draw(0, 1) * draw(-200, 1000));
    int64_t at = draw(0, 1000);
    for (int jobs = draw(0, 12); jobs > 0; --jobs) {
      const int64_t from = at + draw(1, 1500);
      at = from + draw(1, 2000);
      core.high.emplace_back(from, at);
    }
    // Looks of other watchdogs.
    for (int64_t from = draw(0, 2000), n = draw(0, 1) * draw(0, 200); n > 0; --n) {
      core.high.emplace_back(from, from + draw(1, WatchedCore::kShort));
      from = core.high.back().second + draw(1, 120);
    }
    // Just before the low one's end, which a watchdog of the whole process would have polled through.
    if (draw(0, 1) == 1 && core.high.empty()) core.high.emplace_back(core.release + core.budget - draw(1, 40), 20'000);
    core.run();
    CHECK(core.looks <= most_looks(core.preemptions, core.short_us * kUs));
    preempted += core.preemptions > 0;
    const int64_t grain = kWatchGrain_ns / kUs;
    if (core.demand > core.budget + grain) {
      CHECK(core.overrun_at >= core.budget);
      CHECK(core.overrun_at <= core.budget + grain);
      ++overruns;
    }
  }
  CHECK(overruns >= test::at_scale(200));
  CHECK(preempted >= test::at_scale(200));
}

TEST_CASE("a job whose clock stands still is not polled") {
  WatchRules rules;
  rules.budget_ns = 1'000 * kUs;
  rules.demote = true;
  WatchSight sight;
  sight.running = true;
  sight.cpu_left_ns = 10 * kUs;
  CHECK(judge_budget(rules, sight).look_again_ns == kWatchGrain_ns);
  sight.stands = true;
  CHECK(judge_budget(rules, sight).look_again_ns == kStandsGrain_ns);
}

TEST_CASE("nobody looks at a job that none of the rules minds before it hangs") {
  WatchRules rules;
  rules.budget_ns = 1;
  rules.deadline_ns = 100;
  rules.patience_ns = 1000;
  CHECK(judge(rules, {50, false, 200, 0}).look_again_ns == 1301);
  CHECK(judge(rules, {250, false, 200, 0}).look_again_ns == 1301);
  CHECK(judge(rules, {1400, false, 200, 0}).look_again_ns == 1500);
  CHECK(judge(rules, {250, true, 200, 0}).look_again_ns == 1301);
}

TEST_CASE("a job that is late to begin is looked for once a grain, however small its budget is") {
  WatchRules rules;
  rules.budget_ns = 1;
  rules.deadline_ns = 10 * kWatchGrain_ns;
  rules.demote = true;
  CHECK(judge(rules, {100, false, 200, 0}).look_again_ns == 201);
  CHECK(judge(rules, {250, false, 200, 0}).look_again_ns == 250 + kWatchGrain_ns);
}
