// SPDX-License-Identifier: Apache-2.0
// A process that is killed at every step of a message's life, and between any two, is started again and killed again;
// values are set meanwhile. Its record replays without a difference. On virtual time, in a process of its own.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "restarted_run.hpp"
#include "rt/record/log_file.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::record;

namespace {

ReplayResult replay(LogFile& log, std::vector<char> told = {}) {
  test::Renewable nodes;
  Replayer::Options how = nodes.options();
  how.told = std::move(told);
  return Replayer(nodes.graph.plan, log, how).run();
}

void check_replayed(LogFile& log) {
  size_t restarts = 0, messages = 0;
  for (const RecordedEvent& event : log.events())
    restarts += std::holds_alternative<Restart>(event.what) && event.task > 0;
  for (const char* port : {"filter.grid", "reader.seen"}) messages += log.messages(log.channel(port)).size();
  REQUIRE(restarts > 0);
  const ReplayResult all = replay(log);
  INFO((all.first ? all.first->node + ", job " + std::to_string(all.first->job) + ": " + all.first->what : ""));
  CHECK(all.different == 0);
  CHECK(all.lacking == 0);
  CHECK(all.unmade == 0);
  CHECK(all.compared == messages);  // each has its job
  CHECK(all.restarts <= restarts);
  CHECK(all.restarts + 2 >= restarts);  // nothing may have come out of the last life
  const ReplayResult filter = replay(log, {0, 1, 0}), reader = replay(log, {0, 0, 1});
  CHECK(filter.different + reader.different + filter.lacking + reader.lacking == 0);
  CHECK(filter.compared + reader.compared == messages);
  CHECK(filter.restarts + reader.restarts == all.restarts);
}

/// Runs these lives, and replays their record. The last one has no successor that would say what came out of it.
void perform(const std::vector<test::Life>& lives, std::vector<char> whole) {
  const test::TemporaryFolder folder;
  const auto file = folder.path / "run.mcap";
  auto sink = mcap::FileSink::open(file);
  REQUIRE(sink);
  test::RestartedRun run(*sink, {.ports = test::with_fields(whole)}, lives.size());
  for (const test::Life& life : lives) run.live(life);
  const RecordResult result = run.finish();
  CHECK(result.lost() == 0);
  auto log = LogFile::open(file);
  REQUIRE_MESSAGE(log, log.error());
  CHECK(log->damages().empty());
  const auto taken = std::count_if(log->events().begin(), log->events().end(), [](const RecordedEvent& event) {
    return std::holds_alternative<ParameterSet>(event.what);
  });
  CHECK(static_cast<uint64_t>(taken) <= run.sets());
  const auto taken_up = std::count_if(log->events().begin(), log->events().end(), [](const RecordedEvent& event) {
    const auto* restart = std::get_if<Restart>(&event.what);
    return restart != nullptr && !restart->params.empty();
  });
  if (run.sets() > 1) CHECK((taken > 0 && taken_up > 0));
  check_replayed(*log);
}

std::vector<MessageStep> all_steps() {
  std::vector<MessageStep> steps;
  for (size_t i = 1; i < kMessageSteps; ++i) steps.push_back(static_cast<MessageStep>(i));
  return steps;
}

}  // namespace

TEST_CASE("A process that is killed at any step of a message, and started again, replays without a difference") {
  for (const MessageStep step : all_steps()) {
    const auto name = std::string(to_string(step));
    CAPTURE(name);
    for (const std::vector<char>& whole : {std::vector<char>{}, std::vector<char>{1, 0, 0}}) {
      std::vector<test::Life> lives;
      for (uint32_t port = 0; port < 3; ++port)
        for (uint32_t passes = 0; passes < 6; ++passes) lives.push_back({step, port, passes, 0});
      perform(lives, whole);
    }
  }
}

TEST_CASE("Kills at random steps, with values set in between: no difference") {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const auto below = [&](uint32_t most) { return static_cast<uint32_t>(random() % most); };
    std::vector<test::Life> lives;
    for (int i = 0; i < 20; ++i)
      lives.push_back({static_cast<MessageStep>(below(kMessageSteps)), below(3), below(20),
                       below(2) == 0 ? 0 : 0.25 * (1 + below(8))});
    perform(lives, {});
  }
}

TEST_CASE("Without fresh nodes the jobs after a restart count as lacking") {
  const test::TemporaryFolder folder;
  const auto file = folder.path / "run.mcap";
  auto sink = mcap::FileSink::open(file);
  REQUIRE(sink);
  test::RestartedRun run(*sink, {}, 2);
  run.live({MessageStep::after_publish, 1, 3, 0});
  run.live({});
  run.finish();
  auto log = LogFile::open(file);
  REQUIRE(log);
  test::LongGraph graph;
  const ReplayResult result = Replayer(graph.plan, *log, {}).run();
  CHECK(result.lacking > 10);
  CHECK(result.restarts == 0);
}
