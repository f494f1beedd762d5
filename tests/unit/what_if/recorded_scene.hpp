// SPDX-License-Identifier: Apache-2.0
// A graph with all that a plan can say, run in virtual time and recorded: the times of its jobs are drawn.
#pragma once
#include <doctest/doctest.h>

#include <random>

#include "graph/log/recorded_plan.hpp"
#include "graph/what_if/what_if.hpp"
#include "rt/msg/requests.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/record/recorded_run.hpp"

namespace takt::test {

/// Sends what it read some time before its release; now and then nothing.
struct Sensor final : Node {
  Output<Odometry> out{this, "out", ""};
  void setup(Setup&) override {}
  void run(Job& job) override {
    if (job.index() % 7 == 3 || out.loan() == nullptr) return job.no_result();
    out.send(job.index() % 2 == 0 ? job.release_ns() - 2 * kMs : job.now_ns());
  }
};

/// Passes on what it has, under the stamp of that; slower or worse.
struct Relay final : Node {
  Input<Odometry> in{this, "in", ""};
  Output<Odometry> out{this, "out", ""};
  Levels levels{this, {{"full", 1.0}, {"half", 0.53}, {"poor", 0.2}}};
  bool oldest = false;    ///< its results are of the oldest message that it holds
  bool only_new = false;  ///< it has some for new input only
  void setup(Setup&) override {}
  void run(Job& job) override {
    if (in.empty() || (only_new && !in.is_new()) || out.loan() == nullptr) return job.no_result();
    out.send(in.stamp_ns(oldest ? 0 : in.size() - 1));
  }
};

/// Joins two.
struct Pair final : Node {
  Input<Odometry> first{this, "first", ""}, second{this, "second", ""};
  Output<Odometry> out{this, "out", ""};
  void setup(Setup&) override {}
  void run(Job& job) override {
    if (first.empty() || out.loan() == nullptr) return job.no_result();
    out.send(first.stamp_ns());
  }
};

/// Stops the node `pair` for a third of the time.
struct Boss final : Node {
  Output<Requests> requests{this, "requests", ""};
  void setup(Setup&) override { requests.reserve({0, 0, 1, 2}); }
  void run(Job& job) override {
    Requests* message = requests.loan();
    if (message == nullptr) return job.no_result();
    message->wanted.resize(1);
    message->wanted[0] = {"pair", static_cast<uint8_t>(job.index() % 15 >= 5), 1};
    requests.send(job.release_ns());
  }
};

/// sensor -> relay -> (on) follower; relay, sensor -> pair, as boss wants it.
struct Scene {
  Sensor sensor;
  Relay relay, follower;
  Pair pair;
  Boss boss;
  Plan plan;
  enum Task : size_t { kSensor, kRelay, kFollower, kPair, kBoss };

  Scene() {
    pair.accept_requests();
    Node* nodes[]{&sensor, &relay, &follower, &pair, &boss};
    const char* names[]{"sensor", "relay", "follower", "pair", "boss"};
    for (size_t t = 0; t < 5; ++t) {
      add_task(plan, *nodes[t], names[t], static_cast<int64_t>(t) * 7 * kMs,
               t == kBoss ? Capacity{0, 0, 1, 2} : Capacity{});
      plan.ports[t].port = nodes[t]->outputs()[0]->name();
      plan.tasks[t].budget_ns = 10 * kMs;
      plan.tasks[t].memory_bytes = kDefaultMemory;
    }
    plan.tasks[kSensor].device = true;
    plan.tasks[kSensor].rate = Rate{15, 1};
    plan.tasks[kSensor].deadline_ns = 60 * kMs;
    plan.tasks[kFollower].rate.reset();
    plan.tasks[kFollower].on_task = kRelay;
    plan.tasks[kFollower].on_port = kRelay;
    plan.tasks[kRelay].edges = {{0, kSensor, 4, 90 * kMs}};
    plan.tasks[kFollower].edges = {{0, kRelay, 1, 0}};
    plan.tasks[kPair].edges = {{0, kSensor, 1, 0}, {1, kRelay, 1, 150 * kMs}, {2, kBoss, 1, 0}};
    plan.tasks[kPair].joins = {{0, 1}};
    plan.tasks[kPair].rate = Rate{7, 1};
    plan.modes = {{"full", {1, 1, 1, 1, 1}}, {"blind", {1, 1, 1, 0, 1}}, {"safe_stop", {1, 0, 0, 0, 1}}};
    plan.safe_stop = 2;
    plan.cores = {0, 1};
    plan.policy = Policy::deadline;
    for (PortPlan& port : plan.ports) {
      port.history = 32;
      port.held = 12;
      port.readers = 6;
    }
    const VirtualClock clock;
    Setup setup{clock, {}, {}, 1, std::nullopt, 0};
    boss.setup(setup);
  }
};

using Durations = std::function<int64_t(size_t task, uint64_t job)>;

/// Its record, and the board with what really happened.
struct RecordedScene {
  TemporaryFolder folder;
  std::filesystem::path file = folder.path / "run.mcap";
  RunBoard board;

  RecordedScene(const Plan& plan, const Durations& durations, int64_t seconds = 4,
                const std::function<void(RunBoard&, int64_t now_ns)>& meanwhile = {}, bool ends = true)
      : board(plan) {
    auto sink = mcap::FileSink::open(file);
    REQUIRE(sink);
    VirtualClock clock(1'000 * kMs);
    const auto transport = make_local_transport(plan.ports);
    record::Recorder::Options how;
    how.by_caller = true;
    how.ports = with_fields({0, 0, 0, 0, 1});
    const std::string text = log::plan_json(plan).dump();
    const record::Head head{{}, {{0, 0, "plan.json", "application/json", mcap::bytes_of(text)}}};
    record::Recorder recorder(plan, board, *transport, *sink, head, std::move(how));
    trace::Rings rings(8);
    trace::Collector collector(rings, heard_by(recorder));
    Executor::Options run;
    run.duration_ns = seconds * 1'000 * kMs;
    run.board = &board;
    run.trace = &rings;
    run.job_duration_ns = durations;
    run.after_step = [&] {
      collector.drain();
      recorder.capture();
      if (meanwhile) meanwhile(board, clock.now_ns());
    };
    const RunResult result = Executor(plan, *transport, clock, run).run();
    collector.finish();
    recorder.finish(
        ends ? mcap::Metadata{{"epoch_ns", std::to_string(result.epoch_ns)}, {"end_ns", std::to_string(result.end_ns)}}
             : mcap::Metadata{});
  }

  what_if::RecordedRun read(const Plan& plan) const {
    auto log = record::LogFile::open(file);
    REQUIRE_MESSAGE(log, log.error());
    return what_if::read_recorded_run(*log, plan);
  }
};

/// The same for every task.
inline Durations all_take(int64_t ns) {
  return [ns](size_t, uint64_t) { return ns; };
}

}  // namespace takt::test
