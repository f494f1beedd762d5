// SPDX-License-Identifier: Apache-2.0
// What a run keeps of itself, what freezes it, and what is left of it after a kill.
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>

#include "graph/flight/flight_recorder.hpp"
#include "graph/flight/left_runs.hpp"
#include "rt/record/log_file.hpp"
#include "rt/sched/plan_ports.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/record/recorded_run.hpp"

using namespace takt;
using namespace takt::flight;
namespace fs = std::filesystem;

namespace {

constexpr int64_t kSecond = 1'000'000'000, kEpoch = kSecond;

graph::GraphSpec graph_with(int64_t before_ns, int64_t after_ns) {
  graph::GraphSpec graph;
  graph.name = "small";
  graph.record.before_ns = before_ns;
  graph.record.after_ns = after_ns;
  graph.chains.push_back({"whole", {"base", "odometry"}, {"reader", "seen"}, 30'000'000, {}});
  return graph;
}

/// A run of so many seconds in virtual time, with its recorder; `meanwhile` is called after each half of a job.
nlohmann::ordered_json fly(const graph::GraphSpec& graph, const Plan& plan, const fs::path& folder, int64_t seconds,
                           const std::function<void(RunBoard&, int64_t)>& meanwhile = {}) {
  RunBoard board(plan);
  VirtualClock clock(kEpoch);
  const auto transport = make_local_transport(plan.ports);
  FlightRecorder::Options how;
  how.folder = folder;
  how.by_caller = true;
  FlightRecorder recorder(graph, plan, board, *transport, {}, how);
  REQUIRE(recorder.lacks() == "");
  trace::Rings rings(4);
  trace::Collector collector(rings, test::heard_by(recorder));
  Executor::Options run;
  run.duration_ns = seconds * kSecond;
  run.board = &board;
  run.trace = &rings;
  run.after_step = [&] {
    collector.drain();
    recorder.capture();
    if (meanwhile) meanwhile(board, clock.now_ns());
  };
  Executor(plan, *transport, clock, run).run();
  collector.finish();
  recorder.finish({{"epoch_ns", std::to_string(kEpoch)}}, 0);
  return recorder.told();
}

record::LogFile open(const fs::path& file) {
  auto log = record::LogFile::open(file);
  REQUIRE_MESSAGE(log, log.error());
  return std::move(*log);
}

const mcap::Metadata& metadata(const record::LogFile& log, std::string_view name) {
  for (const auto& one : log.container().metadata())
    if (one.name == name) return one.map;
  FAIL("no metadata " << name);
  std::abort();
}

}  // namespace

TEST_CASE("Small ports are kept on disk, large ones in memory and by their hash on disk") {
  using enum record::PortRule::Keep;
  test::SmallGraph small;
  small.plan.ports[1].capacity = {2000, 1000, 1, 0};  // 4 MB at 10 Hz
  graph::RecordSpec spec;
  Places places = flight::places(spec, small.plan);
  CHECK(places.disk[0].keep == all);
  CHECK(places.memory[0].keep == nothing);
  CHECK(places.disk[1].keep == hash);
  CHECK(places.memory[1].keep == all);
  CHECK(places.in_memory());
  CHECK(places.memory_bytes_s == doctest::Approx(40e6).epsilon(0.1));
  // One in ten seconds is little enough for the disk.
  spec.ports.push_back({{"filter", "grid"}, {all, 1, 10 * kSecond}, {}});
  places = flight::places(spec, small.plan);
  CHECK(places.disk[1].pause_ns == 10 * kSecond);
  CHECK(!places.in_memory());
  spec.ports.front() = {{"filter", "grid"}, {nothing, 1, 0}, {}};
  CHECK(flight::places(spec, small.plan).disk[1].keep == nothing);
}

TEST_CASE("A large state is on disk now and then, one in a minute at least, and in memory each time") {
  using enum record::PortRule::Keep;
  test::SmallGraph small;
  small.plan.tasks[1].state_every_ns = kSecond;
  const size_t port = small.plan.tasks[1].ports.front();
  const auto kept = [&](uint32_t bytes) {
    small.plan.ports[port].capacity = {bytes, 1, 1, 0};
    return flight::places({}, small.plan);
  };
  REQUIRE(is_state_port(small.plan.tasks[1], port));
  CHECK(kept(400'000).disk[port].pause_ns == 0);
  const double bytes = static_cast<double>((kept(1'500'000), small.plan.ports[port].chunk_bytes()));
  Places places = kept(1'500'000);
  CHECK(places.disk[port].keep == all);
  CHECK(places.disk[port].pause_ns == static_cast<int64_t>(bytes / 0.25e6 * 1e9));
  CHECK(places.memory[port].keep == all);
  CHECK(places.memory[port].pause_ns == 0);
  CHECK(places.states_ns == places.disk[port].pause_ns);
  CHECK(kept(20'000'000).states_ns == 60 * kSecond);
  places = kept(80'000'000);  // one in a minute is more than a port may have on disk
  CHECK(places.disk[port].keep == hash);
  CHECK(places.states_ns == 0);
}

TEST_CASE("Misses of high nodes, old chains, modes and marks are causes") {
  test::SmallGraph small;
  small.plan.tasks[1].criticality = Criticality::high;
  small.plan.modes = {{"full", {}}, {"slow", {}}};
  Triggers triggers(graph_with(0, 0), small.plan);
  record::RecordedJob job;
  job.task = 1, job.index = 81, job.late = true;
  job.deadline_ns = 5 * kSecond, job.finish_ns = 5 * kSecond + 14'200'000;
  const auto miss = triggers.of(job);
  REQUIRE(miss);
  CHECK(miss->what == small.plan.tasks[1].name + " missed the deadline of job 81 by 14.2 ms");
  CHECK(miss->at_ns == job.finish_ns);
  job.task = 2;
  CHECK(!triggers.of(job));
  job.task = 1, job.late = false;
  CHECK(!triggers.of(job));

  MessageHeader header;
  header.published_ns = 2 * kSecond;
  const auto aged = [&](int64_t age_ns) { return Held{&header, 1, 2 * kSecond - age_ns, 2 * kSecond, 0}; };
  CHECK(!triggers.of(2, aged(30'000'000)));
  const auto old = triggers.of(2, aged(31'000'000));
  REQUIRE(old);
  CHECK(old->what == "chain whole: reader.seen was 31.0 ms old, bound 30.0 ms");
  CHECK(!triggers.of(0, aged(90'000'000)));

  record::RecordedEvent event;
  event.what = record::ModeChange{1, "guard: silent"};
  CHECK(triggers.of(event)->what == "mode slow: guard: silent");
  event.what = record::MarkSet{"turned left", "uid 0"};
  CHECK(triggers.of(event)->kind == "mark");
  event.what = record::ParameterSet{};
  CHECK(!triggers.of(event));
}

TEST_CASE("The first message that passes a condition is a cause, and the first again after one that did not") {
  test::SmallGraph small;
  auto graph = graph_with(0, 0);
  graph::ConditionSpec fast;
  fast.of = graph::ConditionSpec::Of::field;
  fast.port = {"base", "odometry"};
  fast.field = "speed_m_s";
  fast.unit = "m/s";
  fast.bound.at_least = 2;
  graph::ConditionSpec third;
  third.port = {"reader", "seen"};
  third.bound.at_least = 3;
  graph.record.freeze = {fast, third};
  Triggers triggers(graph, small.plan);
  struct {
    MessageHeader header;
    Odometry odometry;
  } message;
  const auto causes = [&](size_t port, std::initializer_list<double> speeds) {
    std::string all;
    for (const double speed : speeds) {
      message.odometry.speed_m_s = speed;
      const auto cause = triggers.of(port, Held{&message.header, 1, 0, 0, 0});
      all += cause ? "[" + cause->what + "]" : ".";
    }
    return all;
  };
  CHECK(causes(0, {1, 2.5, 3, 1, 2}) ==
        ".[base.odometry speed_m_s at least 2 m/s: 2.5]..[base.odometry speed_m_s at least 2 m/s: 2]");
  CHECK(causes(2, {0, 0, 0, 0}) == "..[messages of reader.seen at least 3: 3].");
}

TEST_CASE("Causes that come close to each other are one file, which begins before the first and names all of them") {
  const test::TemporaryFolder folder;
  test::SmallGraph small;
  size_t marks = 0;
  const auto graph = graph_with(kSecond, kSecond);
  const std::pair<double, const char*> set[] = {
      {6, "root"}, {6.7, "effect"}, {6.9, "effect"}, {7.5, "later"}, {15, "alone"}};
  const auto told = fly(graph, small.plan, folder.path, 20, [&](RunBoard& board, int64_t now_ns) {
    if (marks < std::size(set) && now_ns >= kEpoch + static_cast<int64_t>(set[marks].first * 1e9))
      board.marks().append({now_ns, 7, BoundedText<200>(set[marks++].second)});
  });
  const auto& frozen = told["frozen"];
  REQUIRE(frozen.size() == 3);
  CHECK(frozen[0]["what"] == "mark: root");
  REQUIRE(frozen[0]["also"].size() == 1);
  CHECK(frozen[0]["also"][0]["what"] == "mark: effect");
  CHECK(frozen[0]["also"][0]["at_s"].get<double>() == doctest::Approx(6.7).epsilon(0.01));
  CHECK(frozen[0]["more"] == 1);
  CHECK(frozen[1]["what"] == "mark: later");
  CHECK(frozen[2]["what"] == "mark: alone");
  CHECK(frozen[2]["also"].empty());
  const record::LogFile log = open(folder.path / "frozen" / frozen[0]["file"].get<std::string>());
  CHECK(metadata(log, "takt frozen").at("also") == "mark: effect");
  CHECK(log.jobs().front().published_ns <= kEpoch + 5 * kSecond + 100'000'000);
  CHECK(log.jobs().back().published_ns >= kEpoch + 7 * kSecond + 700'000'000);
}

TEST_CASE("A mark freezes the seconds around it") {
  const test::TemporaryFolder folder;
  test::SmallGraph small;
  size_t marks = 0;
  const auto graph = graph_with(3 * kSecond, 2 * kSecond);
  const auto told = fly(graph, small.plan, folder.path, 20, [&](RunBoard& board, int64_t now_ns) {
    if (now_ns >= kEpoch + 10 * kSecond && marks == 0)
      board.marks().append({now_ns, 7, BoundedText<200>("it turned left")}), ++marks;
    if (now_ns >= kEpoch + 11 * kSecond && marks == 1)
      board.marks().append({now_ns, 7, BoundedText<200>("it turned left")}), ++marks;
  });
  CHECK(told["disk"]["lost"] == 0);
  CHECK(told["disk"]["refused"] == "");
  REQUIRE(told["frozen"].size() == 1);
  const auto& frozen = told["frozen"][0];
  CHECK(frozen["refused"] == "");
  CHECK(frozen["damages"].empty());
  CHECK(frozen["more"] == 1);
  CHECK(frozen["also"].empty());
  CHECK(frozen["at_s"].get<double>() == doctest::Approx(10).epsilon(0.01));
  const record::LogFile log = open(folder.path / "frozen" / frozen["file"].get<std::string>());
  CHECK(log.damages().empty());
  CHECK(metadata(log, "takt frozen").at("what") == "mark: it turned left");
  CHECK(log.jobs().size() == doctest::Approx(6 * (30 + 10 + 10)).epsilon(0.02));
  for (const record::RecordedJob& job : log.jobs()) {
    CHECK(job.published_ns >= kEpoch + 7 * kSecond);
    CHECK(job.published_ns < kEpoch + 13 * kSecond + 100'000'000);
  }
  CHECK(log.events().size() == 2);
}

TEST_CASE("Each cause of its own has its file, and the newest files stay") {
  const test::TemporaryFolder folder;
  record::RingLimits limits;
  auto ring = record::Ring::open(folder.path / "ring", "run", limits);
  REQUIRE(ring);
  test::SmallGraph small;
  REQUIRE(test::record_run(small.plan, **ring, 10).lost() == 0);
  const auto freeze = [&](uint64_t most_bytes, size_t at_least, int count) {
    Freezer::Options how;
    how.folder = folder.path / "frozen";
    how.name = "run";
    how.before_ns = kSecond;
    how.after_ns = kSecond / 2;  // so that a second between two is too much for one file
    how.most_bytes = most_bytes;
    how.at_least = at_least;
    Freezer freezer(**ring, nullptr, how);
    for (int i = 0; i < count; ++i) freezer.freeze({"mark", std::to_string(i), "", kEpoch + (2 + i) * kSecond});
    return freezer.finish();
  };
  const auto files = [&] {
    return std::distance(fs::directory_iterator(folder.path / "frozen"), fs::directory_iterator());
  };
  for (const Frozen& one : freeze(1'000'000'000, 3, 5)) CHECK(one.refused == "");
  CHECK(files() == 5);
  freeze(0, 3, 4);  // no room at all: three stay, and the one that is written
  CHECK(files() == 4);
}

TEST_CASE("A run that ends with much to write does not wait for it for ever, and says what is missing") {
  const test::TemporaryFolder folder;
  auto ring = record::Ring::open(folder.path / "ring", "run", {});
  REQUIRE(ring);
  Freezer::Options how;
  how.folder = folder.path / "frozen";
  how.name = "run";
  how.patience = std::chrono::seconds(0);
  how.after_ns = 1'000'000'000;
  std::vector<std::string> told;
  how.told = [&](const Frozen& frozen) { told.push_back(frozen.refused); };
  Freezer freezer(**ring, nullptr, how);
  for (const int64_t at_s : {5, 7, 9}) freezer.freeze({"miss", "node", "", at_s * kSecond});
  const std::vector<Frozen> all = freezer.finish();
  REQUIRE(all.size() == 3);
  for (const Frozen& frozen : all) {
    CHECK(frozen.file.empty());
    CHECK(frozen.refused == "it was not written within 0 s of the run's end");
  }
  CHECK(told.size() == 3);
}

TEST_CASE("What a killed run left is rescued, as far as it was written") {
  const test::TemporaryFolder folder;
  test::SmallGraph small;
  const pid_t child = fork();
  if (child == 0) {
    const auto ring = record::Ring::open(folder.path / "ring", "small-1", {});
    if (!ring) _exit(1);
    // The run waits for its writer, so it cannot be over before the ring has these seconds.
    record::Recorder::Options how;
    how.queue_bytes = 4096;
    test::record_run(small.plan, **ring, 30, how, {}, [&](RunBoard&) {
      if ((*ring)->files().back().ended_ns >= kEpoch + 20 * kSecond) _exit(9);
    });
    _exit(0);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(WEXITSTATUS(status) == 9);
  const fs::path file = folder.path / "rescued.mcap";
  auto sink = mcap::FileSink::open(file);
  REQUIRE(sink);
  const auto rescued = rescue(folder.path / "ring", *sink);
  REQUIRE_MESSAGE(rescued, rescued.error());
  CHECK(rescued->run == "small-1");
  CHECK(rescued->joined.last_ns >= kEpoch + 20 * kSecond - 100'000'000);
  const record::LogFile log = open(file);
  CHECK(log.damages().empty());
  CHECK(log.jobs().size() >= 19 * (30 + 10 + 10));
}

TEST_CASE("Of nothing nothing is rescued") {
  const test::TemporaryFolder folder;
  auto sink = mcap::FileSink::open(folder.path / "rescued.mcap");
  REQUIRE(sink);
  CHECK(rescue(folder.path, *sink).error().find("no run has left anything here") != std::string::npos);
  CHECK(rescue(folder.path / "none", *sink).error().find("no run has left anything here") != std::string::npos);
}
