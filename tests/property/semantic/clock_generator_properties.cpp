// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <string>

#include "nodes/semantic/clock_generator.hpp"
#include "tests/property_scale.hpp"

using namespace takt::semantic;

namespace {

struct Line {
  int at_ms, action, every;
  std::string node;
};

/// The slow way: for each node the last word of the script up to now, found anew every time.
std::map<std::string, std::pair<bool, int>> wanted(const std::vector<Line>& lines, const std::set<std::string>& idle,
                                                   int idle_every, int now_ms, bool stopped) {
  std::map<std::string, std::pair<bool, int>> result;
  std::set<std::string> nodes = idle;
  for (const Line& line : lines) nodes.insert(line.node);
  for (const std::string& node : nodes) {
    bool run = true;
    int every = 1, run_since = -1, every_since = -1;
    for (const Line& line : lines) {
      if (line.node != node || line.at_ms > now_ms) continue;
      if (line.action < 2 && line.at_ms >= run_since) run = line.action == 1, run_since = line.at_ms;
      if (line.action == 2 && line.at_ms >= every_since) every = line.every, every_since = line.at_ms;
    }
    if (stopped && idle.contains(node) && every < idle_every) every = idle_every;
    if (!run || every != 1) result[node] = {run, every};
  }
  return result;
}

}  // namespace

TEST_CASE("what the clock generator asks for at any time is the last word on each node") {
  std::mt19937 random(takt::test::seed(5));
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  size_t named = 0;
  for (int round = 0; round < takt::test::rounds(300); ++round) {
    std::vector<Line> lines;
    std::string text;
    for (int i = below(12); i > 0; --i) {
      const Line line{below(40) * 50, below(3), 1 + below(4), std::string(1, static_cast<char>('a' + below(4)))};
      static constexpr const char* kWords[] = {"stop", "start", "pace"};
      text += std::to_string(line.at_ms) + "ms " + kWords[line.action] + " " + line.node +
              (line.action == 2 ? " " + std::to_string(line.every) : "") + ";";
      lines.push_back(line);
    }
    std::set<std::string> idle;
    while (below(3) > 0) idle.insert(std::string(1, static_cast<char>('a' + below(6))));
    const int idle_every = 1 + below(4);
    const auto script = parse_script(text);
    REQUIRE(script.has_value());
    ClockGenerator generator(*script, {idle.begin(), idle.end()}, static_cast<uint8_t>(idle_every));
    for (int now = 0; now < 2100; now += 1 + below(150)) {
      const bool stopped = below(2) == 0;
      generator.update(int64_t{now} * 1'000'000, stopped);
      std::map<std::string, std::pair<bool, int>> seen;
      for (const auto& r : generator.deviating()) seen[r.node] = {r.run != 0, r.every};
      CHECK(seen.size() == generator.deviating().size());
      CHECK(seen == wanted(lines, idle, idle_every, now, stopped));
      named += seen.size();
    }
  }
  CHECK(named >= takt::test::at_scale(1000));
}

namespace {

/// One look around at an instant.
struct Around {
  int at_ms = 0;
  bool objects_known = false;
  std::vector<std::pair<std::string, int>> objects;  ///< types and distances, cm
  int crossing = -1;                                 ///< -1: nobody tells
};
struct RuleText {
  std::string node, type;  ///< type empty: crossing
  int within_cm, every;    ///< every 0: stop
};

/// The slow way: the condition of each look so far, from the first one on, and then the last instant it was true.
bool needed(const RuleText& rule, const std::vector<Around>& looks, int margin_cm, int hold_ms) {
  bool need = true;
  int true_ms = -1;
  for (const Around& look : looks) {
    const int reach_cm = rule.within_cm + (need && true_ms >= 0 ? margin_cm : 0);
    bool is_true = rule.type.empty() ? look.crossing != 0 : !look.objects_known;
    for (const auto& [type, distance_cm] : look.objects)
      if (!rule.type.empty() && type == rule.type && distance_cm <= reach_cm) is_true = true;
    if (is_true) true_ms = look.at_ms;
    need = true_ms >= 0 && look.at_ms - true_ms <= hold_ms;
  }
  return need;
}

}  // namespace

TEST_CASE("what rules leave of each node at any time is what all looks around so far say") {
  std::mt19937 random(takt::test::seed(6));
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  const auto letter = [&](char first, int n) { return std::string(1, static_cast<char>(first + below(n))); };
  size_t stopped = 0, paced = 0, full = 0;
  for (int round = 0; round < takt::test::rounds(300); ++round) {
    std::vector<RuleText> rules;
    std::string text;
    for (int i = 1 + below(5); i > 0; --i) {
      const RuleText rule{letter('a', 4), below(3) == 0 ? "" : letter('s', 3), 1 + below(500),
                          below(2) * (2 + below(4))};
      text += rule.node + " when " +
              (rule.type.empty() ? "crossing" : rule.type + " within " + std::to_string(rule.within_cm) + "cm") +
              " else " + (rule.every ? "pace " + std::to_string(rule.every) : "stop") + ";";
      rules.push_back(rule);
    }
    const int margin_cm = below(150), hold_ms = below(1500);
    const auto parsed = parse_rules(text);
    REQUIRE(parsed.has_value());
    ClockGenerator generator({}, {}, 1, Needs(*parsed, {margin_cm / 100.0 + 1e-9, int64_t{hold_ms} * 1'000'000}));
    std::vector<Around> looks;
    for (int now = below(100); now < 6000; now += 1 + below(400)) {
      Around& look = looks.emplace_back();
      look.at_ms = now;
      look.objects_known = below(10) != 0;
      look.crossing = below(6) - 1 > 0 ? 0 : below(3) - 1;
      if (look.objects_known)
        for (int i = below(3); i > 0; --i) look.objects.emplace_back(letter('s', 3), below(600));
      std::vector<Neighbour> near;
      for (const auto& [type, distance_cm] : look.objects) near.push_back({type, distance_cm / 100.0 - 1e-9});
      Surroundings around;
      if (look.objects_known) around.objects = near;
      if (look.crossing >= 0) around.crossing = look.crossing == 1;
      generator.update(int64_t{now} * 1'000'000, false, around);
      std::map<std::string, std::pair<bool, int>> expected, seen;
      for (const RuleText& rule : rules) {
        auto& [run, every] = expected.emplace(rule.node, std::pair{true, 1}).first->second;
        if (needed(rule, looks, margin_cm, hold_ms)) continue;
        if (rule.every) every = std::max(every, rule.every);
        else run = false;
      }
      full += std::erase_if(expected, [](const auto& node) { return node.second == std::pair{true, 1}; });
      for (const auto& r : generator.deviating()) seen[r.node] = {r.run != 0, r.every};
      CHECK(seen == expected);
      for (const auto& [node, state] : seen) ++(state.first ? paced : stopped);
    }
  }
  CHECK(stopped >= takt::test::at_scale(1000));
  CHECK(paced >= takt::test::at_scale(1000));
  CHECK(full >= takt::test::at_scale(1000));
}
