// SPDX-License-Identifier: Apache-2.0
// A replay begins in the middle of a record: at what nodes said they remember.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>

#include "recorded_run.hpp"
#include "rt/record/join.hpp"
#include "rt/record/log_file.hpp"
#include "rt/record/replayer.hpp"
#include "rt/record/snapshots.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::record;

namespace {

constexpr int64_t kEpoch = 1'000'000'000, kOneSecond = 1'000'000'000;

/// Sums up what comes; the sum stands in what it makes.
struct RunningSum final : Node {
  Input<Odometry> odometry{this, "odometry", ""};
  Output<Odometry> sum{this, "sum", ""};
  double total = 0;
  int other = 0;
  bool says_other = false;
  void setup(Setup&) override {}
  void run(Job& job) override {
    for (size_t i = 0; i < odometry.size(); ++i)
      if (odometry.is_new(i)) total += odometry[i].x_m;
    Odometry* message = sum.loan();
    if (message == nullptr) return;
    message->x_m = total;
    sum.send(job.release_ns());
  }
  void remember(StateArchive& archive) override {
    TAKT_STATE(archive, total);
    if (says_other) TAKT_STATE(archive, other);
  }
};

/// A device, a sum, and a sum of the sums at a tenth of the rate.
struct RememberingGraph {
  test::OdometryDevice device;
  RunningSum first, second;
  Plan plan;
  explicit RememberingGraph(bool second_declares = true, bool says_other = false) {
    second.says_other = says_other;
    test::add_task(plan, device, "base", 0);
    test::add_task(plan, first, "first", 10'000'000);
    test::add_task(plan, second, "second", 55'000'000);
    plan.tasks[0].device = true;
    plan.tasks[2].rate = Rate{1, 1};
    plan.tasks[2].deadline_ns = kOneSecond;
    plan.tasks[1].edges.push_back({0, 0, 4, 0});
    plan.tasks[2].edges.push_back({0, 1, 16, 0});
    for (size_t p = 0; p < plan.ports.size(); ++p) plan.ports[p].port = plan.tasks[p].node->outputs()[0]->name();
    first.declare_state();
    if (second_declares) second.declare_state();
    const VirtualClock clock;
    Setup setup{clock, {}, {}, 1, std::nullopt, 0};
    for (size_t t = 0; t < plan.tasks.size(); ++t) {
      TaskPlan& task = plan.tasks[t];
      if (task.node->declares_state()) task.node->publish_state();
      task.node->setup(setup);
      if (task.node->state() == nullptr) continue;
      task.node->size_state();
      task.state_every_ns = kOneSecond;
      task.ports.push_back(plan.ports.size());
      PortPlan port;
      port.node = task.name;
      port.port = "state";
      port.type = &task.node->state()->type();
      port.capacity = task.node->state()->capacity();
      plan.ports.push_back(port);
    }
    for (PortPlan& port : plan.ports) port.history = 40, port.held = 20, port.readers = 2;
    for (const TaskPlan& task : plan.tasks)
      for (const EdgePlan& edge : task.edges)
        PortAccess::connect(*task.node->inputs()[edge.input], plan.ports[edge.port].capacity);
  }
};

/// `only_hash`: of what the nodes make. `pauses_s`: between two states that the record has with all fields.
struct RememberedRun {
  test::TemporaryFolder folder;
  std::filesystem::path file = folder.path / "run.mcap";
  explicit RememberedRun(bool only_hash = false, bool second_declares = true, int64_t seconds = 20,
                         std::array<int64_t, 2> pauses_s = {0, 0}) {
    auto sink = mcap::FileSink::open(file);
    REQUIRE(sink);
    RememberingGraph graph(second_declares);
    Recorder::Options how;
    how.snapshot_every_ns = kOneSecond;
    how.file.chunk_bytes = 2000;
    if (only_hash) how.ports = test::with_fields({1, 0, 0, 1, 1});
    for (size_t state = 0; only_hash && second_declares && state < 2; ++state)
      how.ports[3 + state].pause_ns = pauses_s[state] * kOneSecond;
    CHECK(test::record_run(graph.plan, *sink, seconds, std::move(how)).lost() == 0);
  }
  LogFile open() const {
    auto log = LogFile::open(file);
    REQUIRE(log);
    return std::move(*log);
  }
};

ReplayResult replay_part(LogFile& log, RememberingGraph& graph, Replayer::Options how) {
  how.epoch_ns = kEpoch;
  how.renew = [&](size_t t) { (t == 1 ? graph.first : graph.second).total = 0; };
  return Replayer(graph.plan, log, how).run();
}

/// Replays of that record from many instants on are equal and run at most so many jobs more than they must.
void check_beginnings(const RememberedRun& record, uint64_t most_more) {
  for (int64_t from_ms = 0; from_ms < 19'000; from_ms += 371) {
    RememberingGraph graph;
    LogFile log = record.open();
    Replayer::Options how;
    how.begin_ns = kEpoch + from_ms * 1'000'000;
    const ReplayResult result = replay_part(log, graph, how);
    CAPTURE(from_ms);
    CHECK(result.different == 0);
    CHECK(result.lacking == 0);
    CHECK(result.unmade == 0);
    CHECK(result.compared > 0);
    CHECK(result.begun_afresh == 0);
    const auto left = static_cast<uint64_t>((20'000 - from_ms) / 100 + (20'000 - from_ms) / 1000);
    CHECK(result.jobs >= left - 1);
    CHECK(result.jobs <= left + most_more);
  }
}

}  // namespace

TEST_CASE("A replay that begins anywhere makes what the run made, and no more jobs than it must") {
  check_beginnings(RememberedRun(), 15);
  check_beginnings(RememberedRun(true), 50);
}

TEST_CASE("Where a record has states now and then, a replay begins at the last one of each node") {
  // The second one goes back 5 s, and then the first by 2 more.
  check_beginnings(RememberedRun(true, true, 20, {2, 5}), 10 * (2 + 5 + 2));
}

TEST_CASE("A part of a file is enough for a part of a replay") {
  const RememberedRun record;
  auto log = LogFile::open_head(record.file);
  REQUIRE(log);
  CHECK(log->jobs().empty());
  log->read(kEpoch + 8 * kOneSecond, kEpoch + 15 * kOneSecond);
  CHECK(log->jobs().size() < 400);
  RememberingGraph graph;
  Replayer::Options how;
  how.begin_ns = kEpoch + 11 * kOneSecond;
  how.end_ns = kEpoch + 12 * kOneSecond;
  const ReplayResult result = replay_part(*log, graph, how);
  CHECK(result.different == 0);
  CHECK(result.lacking == 0);
  CHECK(result.begun == 2);
  CHECK(result.jobs >= 11);
  CHECK(result.jobs <= 30);
}

TEST_CASE("A window of files begins at its first snapshots, and takes along what its jobs held") {
  const RememberedRun record;
  test::TemporaryFolder folder;
  auto sink = mcap::FileSink::open(folder.path / "window.mcap");
  REQUIRE(sink);
  JoinOptions how;
  how.from_ns = kEpoch + 7 * kOneSecond + 300'000'000;
  how.to_ns = kEpoch + 13 * kOneSecond;
  how.edges = {{}, {"base.odometry"}, {"first.sum"}};
  REQUIRE(join({record.file}, *sink, how));
  auto log = LogFile::open(folder.path / "window.mcap");
  REQUIRE(log);
  RememberingGraph graph;
  const ReplayResult result = replay_part(*log, graph, {});
  CHECK(result.different == 0);
  CHECK(result.lacking == 0);
  CHECK(result.begun == 2);
  CHECK(result.jobs >= 45);
}

TEST_CASE("A node that does not say what it remembers begins afresh, and that is told") {
  const RememberedRun record(false, false);
  LogFile log = record.open();
  RememberingGraph graph(false);
  Replayer::Options how;
  how.begin_ns = kEpoch + 10 * kOneSecond;
  const ReplayResult result = replay_part(log, graph, how);
  CHECK(result.begun == 2);
  CHECK(result.begun_afresh == 1);
  CHECK(result.stateless.starts_with("second: "));
  CHECK(result.different_of.contains("second"));
  CHECK_FALSE(result.different_of.contains("first"));
}

TEST_CASE("What another version of a node remembered is not loaded") {
  const RememberedRun record;
  LogFile log = record.open();
  RememberingGraph graph(true, true);
  Replayer::Options how;
  how.begin_ns = kEpoch + 10 * kOneSecond;
  const ReplayResult result = replay_part(log, graph, how);
  CHECK(result.begun_afresh == 1);
  CHECK(result.stateless.find("another version") != std::string::npos);
}

TEST_CASE("A visitor sees each job and may end the replay") {
  const RememberedRun record;
  LogFile log = record.open();
  RememberingGraph graph;
  Replayer::Options how;
  how.begin_ns = kEpoch + 10 * kOneSecond;
  size_t seen = 0;
  how.visit = [&](const Replayer& replayer, const RecordedJob& job) {
    if (job.task == 1) CHECK(replayer.newest(1) != nullptr);
    return ++seen < 5;
  };
  CHECK(replay_part(log, graph, how).jobs == 5);
}
