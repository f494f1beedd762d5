// SPDX-License-Identifier: Apache-2.0
// A run is recorded, the record read, its jobs run again.
#include <doctest/doctest.h>
#include <sched.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <thread>

#include "recorded_run.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/record/join.hpp"
#include "rt/record/log_file.hpp"
#include "rt/record/replayer.hpp"
#include "rt/sched/grant.hpp"
#include "rt/sched/param_mail.hpp"
#include "tests/own_threads.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::record;

namespace {

struct Record {
  test::TemporaryFolder folder;
  std::filesystem::path file = folder.path / "run.mcap";
  RecordResult result;
  explicit Record(Recorder::Options how = {}, int64_t seconds = 3, int64_t copied_ns = INT64_MAX) {
    auto sink = mcap::FileSink::open(file);
    REQUIRE(sink);
    test::SmallGraph graph;
    result = test::record_run(graph.plan, *sink, seconds, std::move(how), {}, {}, copied_ns);
  }
  LogFile open() const {
    auto log = LogFile::open(file);
    REQUIRE_MESSAGE(log, log.error());
    return std::move(*log);
  }
};

ReplayResult replay(const Record& record, test::SmallGraph& graph, Replayer::Options how = {}) {
  LogFile log = record.open();
  return Replayer(graph.plan, log, how).run();
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("Every message and every job of a run is in its record") {
  const Record record;
  CHECK(record.result.lost() == 0);
  CHECK(record.result.refused.empty());
  CHECK(record.result.jobs == 90 + 30 + 30);
  LogFile log = record.open();
  CHECK(log.damages().empty());
  CHECK(log.facts().at("format") == "2");
  CHECK(log.format() == 2);
  CHECK(log.events().empty());
  CHECK(log.end().at("epoch_ns") == "1000000000");
  CHECK(log.end().at("lost_overwritten") == "0");
  CHECK(log.jobs().size() == 150);
  const auto& odometry = log.messages(log.channel("base.odometry"));
  CHECK(odometry.size() == 90 - 13);  // jobs 3, 10 ... 87 were silent
  CHECK(odometry.begin()->first == 1);
  CHECK(odometry.rbegin()->first == odometry.size());
  CHECK(log.messages(log.channel("filter.grid")).size() == 30);
  CHECK(log.channel("nobody.nothing") == 0);
  const auto message = log.message(log.channel("base.odometry"), 2);
  REQUIRE(message);
  CHECK(message->whole);
  CHECK(message->stamp_ns == 1'000'000'000 + 33'333'333 - 1000);
}

TEST_CASE("Messages that went with their writers before they were copied are counted") {
  const Record all, some({}, 3, 3'850'000'000);
  CHECK(some.result.overwritten >= 5);
  CHECK(some.result.messages + some.result.overwritten == all.result.messages);
  CHECK(some.result.jobs == all.result.jobs);
}

TEST_CASE("A replay runs the jobs of all nodes but the devices, and every byte is the same") {
  const Record record;
  test::SmallGraph graph;
  const ReplayResult result = replay(record, graph);
  CHECK(result.jobs == 60);
  CHECK(result.messages == 60);
  CHECK(result.compared == 60);
  CHECK(result.whole == 60);
  CHECK(result.different == 0);
  CHECK(result.lacking == 0);
  CHECK_FALSE(result.first);
  CHECK(graph.filter.sum > 0);
}

TEST_CASE("Messages of which only the hash was recorded are made again and compared by it") {
  const Record record({.ports = test::with_fields({1, 0, 0})});
  test::SmallGraph graph;
  ReplayResult result = replay(record, graph);
  CHECK(result.compared == 60);
  CHECK(result.whole == 0);
  CHECK(result.different == 0);
  test::SmallGraph other;
  other.filter.sum = 1e-3;
  result = replay(record, other);
  CHECK(result.different == 60);
  REQUIRE(result.first);
  CHECK(result.first->what == "differs (the record has only its hash)");
}

TEST_CASE("A changed constant is found, with node, job, field and byte") {
  const Record record;
  test::SmallGraph graph;
  REQUIRE(graph.filter.gain.set(2.5));
  const ReplayResult result = replay(record, graph);
  REQUIRE(result.first);
  CHECK(result.first->node == "filter");
  CHECK(result.first->port == "grid");
  CHECK(result.first->job == 1);  // in job 0 the sum is 0 with any gain
  CHECK(result.first->what.find("cell_m (byte 8) is ") == 0);
  CHECK(result.different_of.at("filter") == 29);
  CHECK(result.different_of.at("reader") == 29);
  test::SmallGraph late;
  REQUIRE(late.filter.gain.set(2.5));
  const ReplayResult end = replay(record, late, {.from_ns = 1'000'000'000 + 2'500'000'000});
  REQUIRE(end.first);
  CHECK(end.first->job == 25);
  CHECK(end.different_of.at("filter") == 5);
}

TEST_CASE("A parameter that is set while the run goes on is set again before the same job") {
  const test::TemporaryFolder folder;
  test::SmallGraph recorded, again;
  {
    auto sink = mcap::FileSink::open(folder.path / "run.mcap");
    REQUIRE(sink);
    int jobs = 0;
    test::record_run(recorded.plan, *sink, 3, {}, {}, [&](RunBoard& board) {
      if (++jobs == 60) CHECK(post(board.mail(1), 1, ParamValue(0.25)));
    });
  }
  CHECK(recorded.filter.bias() == 0.25);
  auto log = LogFile::open(folder.path / "run.mcap");
  REQUIRE(log);
  CHECK(Replayer(again.plan, *log, {}).run().different == 0);
  CHECK(again.filter.bias() == 0.25);
}

TEST_CASE("A mode that was asked for too late for a job is not that of the job in its record") {
  const test::TemporaryFolder folder;
  test::SmallGraph recorded, again;
  for (test::SmallGraph* graph : {&recorded, &again})
    graph->plan.modes = {{"full", {1, 1, 1}}, {"cautious", {1, 1, 1}}};
  RunBoard* run = nullptr;
  recorded.filter.meanwhile = [&](const Job& job) {
    if (job.index() == 7) CHECK(run->modes().request(1, job.release_ns() - 1, "by a process that was held up"));
  };
  {
    auto sink = mcap::FileSink::open(folder.path / "run.mcap");
    REQUIRE(sink);
    test::record_run(recorded.plan, *sink, 2, {}, {}, [&](RunBoard& board) { run = &board; });
  }
  auto log = LogFile::open(folder.path / "run.mcap");
  REQUIRE(log);
  for (const RecordedJob& job : log->jobs())
    if (job.task == 1) CHECK(job.mode == (job.index > 7 ? 1 : 0));
  const ReplayResult result = Replayer(again.plan, *log, {}).run();
  CHECK(result.different == 0);
  CHECK(result.compared > 20);
}

TEST_CASE("What nodes say is in the record, with node, job, level and instant, and a replay does not mind") {
  test::TemporaryFolder folder;
  auto sink = mcap::FileSink::open(folder.path / "run.mcap");
  REQUIRE(sink);
  test::SmallGraph graph;
  graph.filter.meanwhile = [](Job& job) {
    if (job.index() == 5) job.log(LogLevel::warning, "sum of %d jobs", 5);
  };
  CHECK(test::record_run(graph.plan, *sink, 1).lost() == 0);
  auto log = LogFile::open(folder.path / "run.mcap");
  REQUIRE(log);
  std::vector<RecordedEvent> said;
  for (const RecordedEvent& event : log->events())
    if (std::holds_alternative<LogSaid>(event.what)) said.push_back(event);
  REQUIRE(said.size() == 1);
  CHECK(std::get<LogSaid>(said[0].what) == LogSaid{2, 0, "sum of 5 jobs"});
  CHECK(said[0].task == 1);
  CHECK(said[0].job == 5);
  const auto job = std::find_if(log->jobs().begin(), log->jobs().end(),
                                [](const RecordedJob& j) { return j.task == 1 && j.index == 5; });
  REQUIRE(job != log->jobs().end());
  CHECK(said[0].at_ns >= job->start_ns);
  CHECK(said[0].at_ns <= job->published_ns);
  test::SmallGraph again;
  CHECK(Replayer(again.plan, *log, {}).run().different == 0);
}

TEST_CASE("Some nodes run anew, the rest comes from the record") {
  const Record record;
  test::SmallGraph graph;
  REQUIRE(graph.filter.gain.set(2.5));
  SUBCASE("the changed one") {
    const ReplayResult result = replay(record, graph, {.run = {0, 1, 0}});
    CHECK(result.jobs == 30);
    CHECK(result.different == 29);
  }
  SUBCASE("its reader, which has the grids of the record") {
    const ReplayResult result = replay(record, graph, {.run = {0, 0, 1}});
    CHECK(result.jobs == 30);
    CHECK(result.different == 0);
  }
  SUBCASE("its reader, but the grids are known by their hash only") {
    const Record hashes({.ports = test::with_fields({1, 0, 1})});
    const ReplayResult result = replay(hashes, graph, {.run = {0, 0, 1}});
    CHECK(result.jobs == 0);
    CHECK(result.lacking == 30);
  }
}

TEST_CASE("Two runs on virtual time give the same file, byte by byte") {
  const Record a, b;
  CHECK(bytes_of(a.file) == bytes_of(b.file));
}

TEST_CASE("A job that asks or sends something else than in the record is told") {
  const Record record;
  struct Silent final : Node {
    Input<Odometry> odometry{this, "odometry", ""};
    Output<Grid> grid{this, "grid", ""};
    void setup(Setup&) override {}
    void run(Job& job) override { job.time_left_ns(); }
  } silent;
  test::SmallGraph graph;
  graph.plan.tasks[1].node = &silent;
  const ReplayResult result = replay(record, graph);
  REQUIRE(result.first);
  CHECK(result.first->node == "filter");
  CHECK(result.first->what == "asked for time_left where the record has now");
  CHECK(result.lacking == 30);  // the reader's jobs had grids that nobody makes now
}

TEST_CASE("A window out of a record replays from the first job on that has its inputs") {
  Record record;
  {
    test::SmallGraph graph;
    REQUIRE(graph.filter.gain.set(0.0));  // else it remembers what was before
    auto sink = mcap::FileSink::open(record.file);
    REQUIRE(sink);
    test::record_run(graph.plan, *sink, 3);
  }
  const Record window;
  {
    auto sink = mcap::FileSink::open(window.file);
    REQUIRE(sink);
    JoinOptions how;
    how.from_ns = 2'500'000'000;  // of a run from 1 s to 4 s
    REQUIRE(join({record.file}, *sink, how));
  }
  test::SmallGraph graph;
  REQUIRE(graph.filter.gain.set(0.0));
  const ReplayResult result = replay(window, graph);
  CHECK(result.jobs + result.lacking == 30);
  // Those whose inputs are older; the reader is given what the filter's first jobs, which are not run, had made.
  CHECK(result.lacking >= 1);
  CHECK(result.lacking <= 4);
  CHECK(result.different == 0);
}

TEST_CASE("Jobs that name what the plan does not have are not run") {
  const Record record;
  test::SmallGraph smaller;
  smaller.plan.tasks[2].edges.clear();  // as if the reader's jobs named an edge too many
  const ReplayResult result = replay(record, smaller);
  CHECK(result.lacking == 30);
  CHECK(result.jobs == 30);
  CHECK(result.different == 0);
}

TEST_CASE("A record that is cut off anywhere replays as far as it goes") {
  const Record record({.file = {.chunk_bytes = 2000, .compression = mcap::Compression::zstd, .level = 1}});
  const std::string whole = bytes_of(record.file);
  size_t jobs = 0;
  for (size_t length = whole.size() / 3; length < whole.size(); length += 997) {
    std::ofstream(record.file, std::ios::binary) << whole.substr(0, length);
    LogFile log = record.open();
    CHECK_FALSE(log.damages().empty());
    CHECK(log.jobs().size() >= jobs);
    jobs = log.jobs().size();
    test::SmallGraph graph;
    const ReplayResult result = Replayer(graph.plan, log, {}).run();
    CHECK(result.different == 0);
  }
  CHECK(jobs > 100);
}

TEST_CASE("A file that takes no more, or a queue without room: the run goes on and the loss is stated") {
  struct Full final : mcap::Sink {
    size_t room = 6000;
    tl::expected<void, std::string> append(std::span<const mcap::Bytes> parts) override {
      size_t size = 0;
      for (const mcap::Bytes part : parts) size += part.size();
      if (size > room) return tl::make_unexpected(std::string("No space left on device"));
      room -= size;
      return {};
    }
  } full;
  test::SmallGraph graph;
  const RecordResult result = test::record_run(graph.plan, full, 3, {.file = {.chunk_bytes = 1000, .level = 1}});
  CHECK(result.not_written > 0);
  CHECK(result.lost() == result.not_written);
  CHECK(result.refused == "No space left on device");
  CHECK(result.messages + result.jobs + result.not_written == 77 + 30 + 30 + 150);
}

TEST_CASE("Beside a run in real time the recorder reads by itself; what finds no room is counted") {
  const test::TemporaryFolder folder;
  test::SmallGraph graph;
  const RunBoard board(graph.plan);
  const auto transport = make_local_transport(graph.plan.ports);
  const auto write = [&](Recorder& recorder) {
    const auto writer = transport->make_writer(0);
    for (int64_t i = 0; i < 10; ++i) {
      REQUIRE(writer->loan() != nullptr);
      writer->publish(i, i, i);
    }
    return recorder.finish({});
  };
  auto sink = mcap::FileSink::open(folder.path / "run.mcap");
  REQUIRE(sink);
  SUBCASE("room") {
    Recorder recorder(graph.plan, board, *transport, *sink, {}, {});
    const RecordResult result = write(recorder);
    CHECK(result.messages == 10);
    CHECK(result.lost() == 0);
  }
  SUBCASE("before ordinary threads, as far as the kernel grants it") {
    bool granted = false;
    std::thread([&] { granted = lift_thread(0, kLowestPriority); }).join();
    Recorder recorder(graph.plan, board, *transport, *sink, {}, {.priority = kLowestPriority});
    pid_t copying = 0;
    while (copying == 0) copying = test::own_threads()["takt-record"];  // it takes its name last
    CHECK((sched_getscheduler(copying) & ~SCHED_RESET_ON_FORK) == (granted ? SCHED_FIFO : SCHED_OTHER));
    CHECK(write(recorder).lost() == 0);
  }
  SUBCASE("no room") {
    Recorder recorder(graph.plan, board, *transport, *sink, {}, {.queue_bytes = 1});
    const RecordResult result = write(recorder);
    CHECK(result.messages == 0);
    CHECK(result.no_room == 10);
  }
}

TEST_CASE("What is no record is refused with its name") {
  const test::TemporaryFolder folder;
  CHECK_FALSE(LogFile::open(folder.path / "nothing.mcap"));
  const auto text = folder.write("text.mcap", "this is no record");
  CHECK_FALSE(LogFile::open(text));
  auto sink = mcap::FileSink::open(folder.path / "other.mcap");
  REQUIRE(sink);
  mcap::Writer other(*sink, {});
  REQUIRE(other.begin("", "somebody else"));
  REQUIRE(other.finish());
  const auto log = LogFile::open(folder.path / "other.mcap");
  REQUIRE_FALSE(log);
  CHECK(log.error().find("other.mcap is no record of takt run --record") != std::string::npos);
}
