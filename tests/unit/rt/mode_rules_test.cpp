// SPDX-License-Identifier: Apache-2.0
// Which mode follows from lost sources: by example, and against a slow reference over random histories.
#include "rt/sched/mode_rules.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <random>
#include <set>
#include <thread>

#include "rt/sched/mode_log.hpp"

namespace {

using namespace takt;

constexpr SourceSet kHead = 1, kGround = 2, kLaser = 4;
constexpr size_t kFull = 0, kNoStereo = 1, kLaserOnly = 2, kSafeStop = 3;

ModeRules ace() { return {{10, 11, 12}, {{kNoStereo, kHead}, {kLaserOnly, kHead | kGround}, {kSafeStop, kLaser}}}; }
ModeInForce by(ModeOrigin origin, size_t mode, size_t before) { return {mode, origin, before}; }

/// The same question asked of sets and of the whole history, the start first.
struct Entry {
  size_t mode;
  bool by_rule;
};
size_t reference(const std::vector<std::pair<size_t, std::set<int>>>& rules, const std::set<int>& lost, bool newly_lost,
                 const std::vector<Entry>& history, size_t safe_stop) {
  const Entry last = history.back();
  size_t base = last.mode;
  for (const Entry& entry : history)
    if (!entry.by_rule) base = entry.mode;
  if (!last.by_rule && (!newly_lost || last.mode == safe_stop)) return last.mode;
  if (lost.empty()) return base;
  std::vector<size_t> able;
  for (const auto& [mode, covered] : rules)
    if (std::includes(covered.begin(), covered.end(), lost.begin(), lost.end())) able.push_back(mode);
  if (std::find(able.begin(), able.end(), base) != able.end()) return base;
  std::erase(able, ModeRule::kUnreachable);
  return able.empty() ? safe_stop : able.front();
}

}  // namespace

TEST_CASE("the first mode that can do without all that is lost; safe_stop if there is none") {
  CHECK(mode_without(ace(), kHead, kSafeStop) == kNoStereo);
  CHECK(mode_without(ace(), kGround, kSafeStop) == kLaserOnly);
  CHECK(mode_without(ace(), kHead | kGround, kSafeStop) == kLaserOnly);
  CHECK(mode_without(ace(), kLaser, kSafeStop) == kSafeStop);
  CHECK(mode_without(ace(), kHead | kLaser, kSafeStop) == kSafeStop);
  ModeRules unreachable = ace();
  unreachable.rules[0].mode = ModeRule::kUnreachable;
  CHECK(mode_without(unreachable, kHead, kSafeStop) == kLaserOnly);
}

TEST_CASE("a rule's mode is left when all are back; what a person or a broken deadline asked for stays") {
  const auto rules = ace();
  CHECK(change_of_mode(rules, kHead, true, by(ModeOrigin::other, kFull, kFull), kSafeStop) == kNoStereo);
  CHECK(change_of_mode(rules, kHead | kGround, true, by(ModeOrigin::rule, kNoStereo, kFull), kSafeStop) == kLaserOnly);
  CHECK(change_of_mode(rules, kHead, false, by(ModeOrigin::rule, kLaserOnly, kFull), kSafeStop) == kNoStereo);
  CHECK(change_of_mode(rules, 0, false, by(ModeOrigin::rule, kNoStereo, kFull), kSafeStop) == kFull);
  CHECK_FALSE(change_of_mode(rules, 0, false, by(ModeOrigin::other, kNoStereo, kNoStereo), kSafeStop));
  CHECK_FALSE(change_of_mode(rules, kHead, false, by(ModeOrigin::other, kFull, kFull), kSafeStop));
  CHECK_FALSE(change_of_mode(rules, kHead, true, by(ModeOrigin::other, kSafeStop, kSafeStop), kSafeStop));
}

TEST_CASE("a mode by hand that covers the loss stays, another is left for one that does, and entered again") {
  const auto rules = ace();
  CHECK_FALSE(change_of_mode(rules, kHead, true, by(ModeOrigin::other, kLaserOnly, kLaserOnly), kSafeStop));
  CHECK(change_of_mode(rules, kGround, true, by(ModeOrigin::other, kNoStereo, kNoStereo), kSafeStop) == kLaserOnly);
  CHECK(change_of_mode(rules, 0, false, by(ModeOrigin::rule, kLaserOnly, kNoStereo), kSafeStop) == kNoStereo);
}

TEST_CASE("random histories: log and rule say what the slow reference says") {
  std::mt19937 random(7);
  const auto draw = [&](size_t below) { return static_cast<size_t>(random() % below); };
  size_t changes = 0;
  for (int round = 0; round < 400; ++round) {
    const size_t sources = 1 + draw(4), modes = 2 + draw(4), safe_stop = modes - 1;
    ModeRules rules;
    std::vector<std::pair<size_t, std::set<int>>> slow;
    for (size_t r = 0; r < 1 + draw(4); ++r) {
      ModeRule rule{draw(10) == 0 ? ModeRule::kUnreachable : draw(modes), 0};
      std::set<int> covered;
      for (size_t s = 0; s < sources; ++s)
        if (draw(2) == 0) rule.covers |= SourceSet{1} << s, covered.insert(static_cast<int>(s));
      rules.rules.push_back(rule);
      slow.emplace_back(rule.mode, covered);
    }
    ModeLog log;
    std::vector<Entry> history{{0, false}};
    std::set<int> lost;
    SourceSet bits = 0;
    for (int64_t step = 0; step < 60; ++step) {
      if (draw(6) == 0) {  // a person or a deadline
        const size_t mode = draw(modes);
        REQUIRE(log.request(static_cast<uint32_t>(mode), step, ""));
        if (history.back().mode != mode || history.back().by_rule) history.push_back({mode, false});
        continue;
      }
      const int source = static_cast<int>(draw(sources));
      const bool newly_lost = lost.insert(source).second;
      if (!newly_lost) lost.erase(source);
      bits ^= SourceSet{1} << source;
      const size_t expected = reference(slow, lost, newly_lost, history, safe_stop);
      const auto wanted = change_of_mode(rules, bits, newly_lost, log.in_force(), safe_stop);
      REQUIRE(wanted.value_or(log.newest()) == expected);
      if (!wanted) continue;
      REQUIRE(expected != history.back().mode);
      REQUIRE(log.request_by_rule(static_cast<uint32_t>(*wanted), step, ""));
      history.push_back({expected, true});
      ++changes;
    }
  }
  CHECK(changes > 1000);
}

TEST_CASE("a mode that several processes ask for at once is entered once") {
  ModeLog log;
  constexpr uint32_t kRounds = 500;
  for (uint32_t round = 0; round < kRounds; ++round) {
    std::atomic<int> ready{0};
    const auto ask = [&] {
      for (++ready; ready.load() < 2;) std::this_thread::yield();
      log.request_by_rule((round + 1) % 2, round, "");
    };
    std::thread other(ask);
    ask();
    other.join();
  }
  size_t entered = 0;
  for (size_t i = 0; i < log.size(); ++i) entered += log.repeats(i) ? 0 : 1;
  CHECK(entered == kRounds);
  MESSAGE("asked for twice in " << log.size() - kRounds << " of " << kRounds << " rounds");
}
