// SPDX-License-Identifier: Apache-2.0
// A cut holds what its jobs need, and no more; it replays like the part that it was.
#include <doctest/doctest.h>

#include <algorithm>
#include <optional>

#include "graph/log/cut_log.hpp"
#include "graph/log/log_content.hpp"
#include "rt/record/replayer.hpp"
#include "rt/sched/param_mail.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/record/recorded_run.hpp"

using namespace takt;
using namespace takt::log;

namespace {

constexpr int64_t kSecond = 1'000'000'000, kEpoch = kSecond;

/// Nodes that remember nothing: the filter adds up nothing.
struct Forgetful : test::SmallGraph {
  Forgetful() { REQUIRE(filter.gain.set(0.0)); }
};

struct Scene {
  test::TemporaryFolder folder;

  record::LogFile open(const char* name) {
    auto log = record::LogFile::open(folder.path / name);
    REQUIRE_MESSAGE(log, log.error());
    return std::move(*log);
  }
  /// Three seconds; the filter's bias is set in the first one. Grids by their hash only.
  record::LogFile run(double bias = 0) {
    Forgetful graph;
    auto sink = mcap::FileSink::open(folder.path / "run.mcap");
    REQUIRE(sink);
    const std::string plan = plan_json(graph.plan).dump();
    int steps = 0;
    test::record_run(graph.plan, *sink, 3, {.ports = test::with_fields({1, 0, 1})},
                     {{}, {{0, 0, "plan.json", "application/json", mcap::bytes_of(plan)}}}, [&](RunBoard& board) {
                       if (bias != 0 && ++steps == 40) CHECK(post(board.mail(1), 1, ParamValue(bias)));
                     });
    return open("run.mcap");
  }
  record::LogFile cut(const record::LogFile& log, int64_t from_ns, int64_t to_ns) {
    {
      auto sink = mcap::FileSink::open(folder.path / "cut.mcap");
      REQUIRE(sink);
      const auto cut = cut_log(log, from_ns, to_ns, *sink);
      REQUIRE_MESSAGE(cut, cut.error());
    }
    return open("cut.mcap");
  }
};

}  // namespace

TEST_CASE("A cut has the jobs of its time and those that made what they held") {
  Scene scene;
  const record::LogFile whole = scene.run();
  record::LogFile cut = scene.cut(whole, kEpoch + kSecond, kEpoch + 2 * kSecond);
  CHECK(cut.damages().empty());
  CHECK(cut.facts().at("cut").find("1.000 s to 2.000 s") == 0);
  CHECK(epoch_ns(cut) == kEpoch);
  const auto of = [&](uint16_t task) {
    return std::count_if(cut.jobs().begin(), cut.jobs().end(), [&](const auto& job) { return job.task == task; });
  };
  CHECK(of(0) == 30);
  CHECK(of(1) == 10);  // the reader at 1.055 s holds the grid of 1.010 s
  CHECK(of(2) == 10);
  Forgetful graph;
  const record::ReplayResult replayed = record::Replayer(graph.plan, cut, {}).run();
  CHECK(replayed.jobs == 20);
  CHECK(replayed.lacking == 0);
  CHECK(replayed.compared == 20);
  CHECK(replayed.different == 0);
}

TEST_CASE("An earlier job stays where the record has what it made by hash only") {
  Scene scene;
  const record::LogFile whole = scene.run();
  // The reader at 1.055 s holds the grid that was released at 1.010 s, before the cut.
  record::LogFile cut = scene.cut(whole, kEpoch + kSecond + 50'000'000, kEpoch + kSecond + 60'000'000);
  CHECK(std::any_of(cut.jobs().begin(), cut.jobs().end(),
                    [](const auto& job) { return job.task == 1 && job.release_ns == kEpoch + kSecond + 10'000'000; }));
  Forgetful graph;
  const record::ReplayResult replayed = record::Replayer(graph.plan, cut, {}).run();
  CHECK(replayed.jobs == 2);
  CHECK(replayed.lacking == 0);
  CHECK(replayed.different == 0);
}

TEST_CASE("What was set before the cut is set in it") {
  Scene scene;
  const record::LogFile whole = scene.run(0.25);
  record::LogFile cut = scene.cut(whole, kEpoch + 2 * kSecond, kEpoch + 3 * kSecond);
  Forgetful graph;
  CHECK(record::Replayer(graph.plan, cut, {}).run().different == 0);
  CHECK(graph.filter.bias() == 0.25);
}

TEST_CASE("A cut of nothing is a record without jobs") {
  Scene scene;
  record::LogFile cut = scene.cut(scene.run(), 0, 1);
  CHECK(cut.jobs().empty());
  CHECK(content_json(cut)["nodes"].size() == 3);
}
