// SPDX-License-Identifier: Apache-2.0
// Damaged scenario files end in problems with a place, or in a scenario that can be bound to a plan; never in a crash.
#include <random>

#include "../../unit/faults/fixture.hpp"
#include "graph/faults/injection.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::graph;
using namespace takt::test;

namespace {

const std::string kScenario = R"(takt: 1
name: cameras_go
seed: 7
faults:
  - {kind: drop, target: camera.pair, from: 2s, to: 4s, probability: 0.5}
  - {kind: delay, target: stereo.disparity, by: 1/10 s}
  - {kind: kill, target: any, every: 3s, from: 5s, to: 60s}
  - {kind: hang, target: planner, at: 6s, for: 2s}
  - {kind: full_disk, from: 1s, megabytes: 2.5}
expect:
  modes: [full, blind, full]
  rates: {stereo: 14.5, planner: {at_most: 3}}
  ages: {reaction: {at_least: 10ms, at_most: 300ms}}
  restarts: {depth: 1}
  recovery: 2s
  lost: 0
)";

/// Another digit for one of its digits; or one to three places changed, taken out or doubled.
std::string damaged(std::mt19937& random) {
  static const std::string garbage = "{}[]:,-.0s9eE\"'#\n ~x";
  std::string text = kScenario;
  if (random() % 2 == 0) {
    text[text.find_first_of("0123456789", random() % (text.size() - 10))] = static_cast<char>('0' + random() % 10);
    return text;
  }
  for (size_t damage = 0; damage < 1 + random() % 3; ++damage) {
    const size_t at = random() % text.size(), length = std::min<size_t>(1 + random() % 12, text.size() - at);
    switch (random() % 3) {
      case 0: text[at] = garbage[random() % garbage.size()]; break;
      case 1: text.erase(at, length); break;
      default: text.insert(at, text.substr(at, length));
    }
  }
  return text;
}

}  // namespace

TEST_CASE("damaged scenarios") {
  std::mt19937 random(test::seed(23));
  const GraphSpec graph = small_graph();
  size_t refused = 0, sound = 0;
  for (int i = 0; i < test::rounds(3000); ++i) {
    const std::string text = damaged(random);
    CAPTURE(text);
    auto loaded = load(text);
    CHECK(loaded.scenario.has_value() == loaded.problems.empty());
    for (const auto& problem : loaded.problems) CHECK(problem.position.line > 0);
    ++(loaded.scenario ? sound : refused);
    if (!loaded.scenario) continue;
    Plan plan = small_plan();
    VirtualClock clock(1);
    const std::atomic<int64_t> epoch{1};
    Injection injection(std::move(*loaded.scenario), graph, plan.ports.size(), false);
    injection.make_room(plan);
    injection.disturb(plan, clock, epoch);
  }
  CHECK(refused >= test::at_scale(1000));
  CHECK(sound >= test::at_scale(200));
}
