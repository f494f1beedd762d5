// SPDX-License-Identifier: Apache-2.0
// Jobs that lose their source: what the board keeps of it, and the mode that follows, in virtual time.
#include <doctest/doctest.h>

#include <functional>

#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "tests/unit/rt/epoch.hpp"
#include "tests/unit/rt/plans.hpp"

namespace {

using namespace takt;
using test::kEpoch, test::kMs;

struct Sensor final : Node {
  Output<Odometry> out{this, "out", ""};
  std::function<void(Job&, int64_t at_ms)> act;
  std::vector<std::string> modes;
  void setup(Setup&) override {}
  void run(Job& job) override {
    modes.emplace_back(job.mode());
    if (act) act(job, (job.release_ns() - kEpoch) / kMs);
  }
};

/// Two sources and a node that needs the first, all at 10 Hz; losing the first one leads to `without`, the second to
/// safe_stop.
struct SourcesScene {
  Sensor camera, laser, user;
  Plan plan;
  VirtualClock clock{kEpoch};
  std::unique_ptr<RunBoard> board;

  SourcesScene() {
    test::add_task(plan, camera, "camera", 0);
    test::add_task(plan, laser, "laser", 10 * kMs);
    test::add_task(plan, user, "user", 50 * kMs);
    plan.tasks[0].device = plan.tasks[1].device = true;
    plan.modes = {{"full", {1, 1, 1}}, {"without", {1, 1, 0}}, {"safe_stop", {1, 1, 0}}};
    plan.safe_stop = 2;
    plan.mode_rules = {{0, 1}, {{1, 1}, {2, 2}}};
  }
  void run(const std::function<void(RunBoard&)>& before = {}) {
    const auto transport = make_local_transport(plan.ports);
    board = std::make_unique<RunBoard>(plan);
    if (before) before(*board);
    Executor::Options options;
    options.duration_ns = 1000 * kMs;
    options.board = board.get();
    options.job_duration_ns = [](size_t, uint64_t) { return kMs; };
    Executor(plan, *transport, clock, options).run();
  }
  std::vector<std::string> changes() const {
    std::vector<std::string> all;
    for (size_t i = 0; i < board->modes().size(); ++i) {
      const ModeLog::Change& change = *board->modes().change(i);
      all.push_back(plan.modes[change.mode].name + " at " + std::to_string((change.from_ns - kEpoch) / kMs) + ": " +
                    board->modes().reason(i));
    }
    return all;
  }
};

/// Lost in [from, to) ms.
auto lost_between(int64_t from_ms, int64_t to_ms, SourceState state) {
  return [=](Job& job, int64_t at_ms) {
    job.source_state({at_ms >= from_ms && at_ms < to_ms ? state : SourceState::ok, static_cast<uint64_t>(at_ms / 100)});
  };
}

}  // namespace

TEST_CASE("a loss pauses what needs the source, its return lets it go on; report and faults know of both") {
  SourcesScene scene;
  scene.camera.act = lost_between(200, 600, SourceState::disconnected);
  scene.run();
  CHECK(scene.changes() ==
        std::vector<std::string>{"without at 201: camera lost: disconnected", "full at 601: camera is back"});
  CHECK(scene.user.modes == std::vector<std::string>(6, "full"));  // 50, 150, and from 650 on
  CHECK(scene.camera.modes.size() == 10);                          // it goes on, or it could not come back
  const SourceRecord& record = scene.board->source(0);
  CHECK(record.state.load() == SourceState::ok);
  CHECK(record.losses.load() == 1);
  CHECK(record.lost_until_ns(kEpoch + 1000 * kMs) == 400 * kMs);
  CHECK(record.reopen_tries.load() == 9);
  CHECK(scene.board->source(1).losses.load() == 0);
  REQUIRE(scene.board->faults().size() == 2);
  CHECK(scene.board->faults().at(0)->kind == Fault::lost);
  CHECK(std::string(scene.board->faults().at(0)->what.text()) == "camera lost: disconnected");
  CHECK(std::string(scene.board->faults().at(1)->what.text()) == "camera is back after 400 ms");
  CHECK(scene.board->faults().at(1)->task == 0);
}

TEST_CASE("a loss that goes on counts up to the end; another kind of loss is no second one") {
  SourcesScene scene;
  scene.camera.act = [](Job& job, int64_t at_ms) {
    job.source_state({at_ms < 300   ? SourceState::ok
                      : at_ms < 500 ? SourceState::silent
                                    : SourceState::disconnected,
                      0});
  };
  scene.run();
  const SourceRecord& record = scene.board->source(0);
  CHECK(record.losses.load() == 1);
  CHECK(record.state.load() == SourceState::disconnected);
  CHECK(record.since_ns.load() == kEpoch + 501 * kMs);
  CHECK(record.lost_until_ns(kEpoch + 1000 * kMs) == 699 * kMs);
  CHECK(scene.changes() == std::vector<std::string>{"without at 301: camera lost: silent"});
}

TEST_CASE("two at once that no mode covers are a safe stop, which a rule entered and leaves step by step") {
  SourcesScene scene;
  scene.camera.act = lost_between(100, 700, SourceState::silent);
  scene.laser.act = lost_between(300, 500, SourceState::garbage);
  scene.run();
  CHECK(scene.changes() == std::vector<std::string>{"without at 101: camera lost: silent",
                                                    "safe_stop at 311: laser lost: garbage",
                                                    "without at 511: laser is back", "full at 701: camera is back"});
}

TEST_CASE("a mode by hand, and a safe stop for a missed deadline, stay when the source is back") {
  for (const bool by_hand : {true, false}) {
    SourcesScene scene;
    scene.camera.act = lost_between(200, 600, SourceState::silent);
    scene.laser.act = [&](Job& job, int64_t at_ms) {
      if (at_ms != 410) return;
      // The second is the mode in which the rule has put the run already.
      if (by_hand) scene.board->modes().request(1, job.release_ns(), "a person", true);
      else scene.board->safe_stop(job.release_ns(), "user: deadline missed");
    };
    scene.run();
    REQUIRE(scene.changes().size() == 2);
    CHECK(scene.changes()[1] == (by_hand ? "without at 410: a person" : "safe_stop at 410: user: deadline missed"));
  }
}

TEST_CASE("a safe stop for a missed deadline takes over the one that a rule entered") {
  SourcesScene scene;
  scene.laser.act = lost_between(200, 600, SourceState::silent);
  scene.camera.act = [&](Job& job, int64_t at_ms) {
    if (at_ms == 400) scene.board->safe_stop(job.release_ns(), "user: deadline missed");
  };
  scene.run();
  CHECK(scene.changes() ==
        std::vector<std::string>{"safe_stop at 211: laser lost: silent", "safe_stop at 400: user: deadline missed"});
}

TEST_CASE("the sources of a dead process are lost, once, until its successor says otherwise") {
  SourcesScene scene;
  RunBoard board(scene.plan);
  const std::vector<size_t> tasks{0, 2};
  board.lose_sources(tasks, 5 * kMs, 6 * kMs);
  board.lose_sources(tasks, 7 * kMs, 8 * kMs);
  CHECK(board.source(0).state.load() == SourceState::unattended);
  CHECK(board.source(0).losses.load() == 1);
  CHECK(board.source(1).losses.load() == 0);
  CHECK(board.source(2).losses.load() == 0);  // no hardware node: it has no source
  CHECK(board.faults().size() == 1);
  CHECK(board.modes().newest() == 1);
  CHECK(board.modes().at(6 * kMs) == 1);
  CHECK(board.modes().at(6 * kMs - 1) == 0);
  board.tell_source(0, 3, {SourceState::ok, 0}, 20 * kMs, 21 * kMs);
  CHECK(board.modes().newest() == 0);
  CHECK(board.source(0).lost_until_ns(50 * kMs) == 15 * kMs);
}

TEST_CASE("a source that comes and goes for ever ends in a safe stop, and leaves room for other faults") {
  SourcesScene scene;
  RunBoard board(scene.plan);
  constexpr auto kTimes = static_cast<int64_t>(2 * ModeLog::kMost);
  for (int64_t i = 0; i < kTimes; ++i)
    board.tell_source(0, 0, {i % 2 == 0 ? SourceState::silent : SourceState::ok, 0}, i * kMs, i * kMs);
  CHECK(board.source(0).losses.load() == ModeLog::kMost);
  CHECK(board.modes().newest() == 2);
  CHECK(board.modes().size() < ModeLog::kMost);
  CHECK(board.faults().size() == kMostFaults - 16);
  CHECK(board.faults().append({}));
}
