// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <map>
#include <random>
#include <set>
#include <string>

#include "nodes/semantic/clock_generator.hpp"

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
  std::mt19937 random(5);
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  size_t named = 0;
  for (int round = 0; round < 300; ++round) {
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
  CHECK(named > 1000);
}
