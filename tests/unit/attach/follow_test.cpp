// SPDX-License-Identifier: Apache-2.0
// What a program that shows a run is told of it: how it is made, how it stands, what has happened, messages.
#include "graph/attach/follow.hpp"

#include <doctest/doctest.h>
#include <sys/socket.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "graph/ace/ace_registry.hpp"
#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/grid.hpp"
#include "rt/record/packed_message.hpp"

using namespace takt;
using Json = nlohmann::ordered_json;

namespace {

/// A node with an output, in one process of two; it is real, so that it has parameters.
struct FollowedRun {
  Registry registry = ace_registry();
  std::unique_ptr<Node> node = registry.nodes.find("mapping_3d")->make();
  graph::GraphSpec spec;
  Plan plan;
  std::unique_ptr<RunBoard> board;
  std::unique_ptr<Transport> transport;
  std::unique_ptr<Writer> writer;
  std::vector<std::string> frozen;

  FollowedRun() {
    spec.name = "test";
    spec.nodes.push_back({"map", "mapping_3d", "depth", {}, {}, {}, {}});
    spec.chains.push_back({"see", {"map", "obstacles"}, {"map", "obstacles"}, 200'000'000, {}});
    TaskPlan task;
    task.name = "map";
    task.node = node.get();
    task.rate = Rate{2, 1};
    task.deadline_ns = 500'000'000;
    task.budget_ns = 40'000'000;
    task.ports = {0};
    plan.tasks.push_back(task);
    plan.ports.push_back({"map", "obstacles", &MessageType::of<Grid>(), {.width = 4, .height = 3}, 2, 2, 2});
    plan.modes = {{"full", {1}}, {"rest", {0}}};
    const size_t process_of[] = {1};
    board = std::make_unique<RunBoard>(plan, 2, process_of);
    board->epoch_ns().store(1'000'000'000);
    transport = make_local_transport(plan.ports);
    writer = transport->make_writer(0);
  }
  attach::Subject subject() {
    return {registry, spec, plan, *board, *transport, 77, [this] { return frozen; }, {"eyes", "maps"}, {1}};
  }
  void publish(int16_t value) {
    auto* grid = reinterpret_cast<Grid*>(writer->loan() + 1);
    grid->width = 4;
    grid->height = 3;
    grid->cells.resize(12);
    grid->cells[0] = value;
    writer->publish(1, 0, 0);
  }
};

/// Both ends of a connection, and the one who follows on a thread.
struct Following {
  explicit Following(const attach::Subject& of) : subject(of), taps(subject.transport, subject.plan.ports) {
    int ends[2];
    REQUIRE(socketpair(AF_UNIX, SOCK_STREAM, 0, ends) == 0);
    near = std::make_unique<attach::Connection>(ends[0]);
    far = std::make_unique<attach::Connection>(ends[1], 1000);
    thread = std::thread([this] { attach::Follow(subject, taps, *far).run(ending); });
  }
  ~Following() {
    ending.store(true);
    thread.join();
  }
  Json line() {
    const auto line = near->read_line();
    REQUIRE(line);
    return *line;
  }
  const attach::Subject subject;
  attach::Taps taps;
  std::atomic<bool> ending{false};
  std::unique_ptr<attach::Connection> near, far;
  std::thread thread;
};

}  // namespace

TEST_CASE("a run is described by what it is made of") {
  FollowedRun run;
  run.board->task(0).response_bound.set(90'000'000);
  run.board->port(0).age_bound.set(120'500'000);
  const Json graph = attach::describe_json(run.subject());
  const Json& node = graph["nodes"][0];
  CHECK(node["name"] == "map");
  CHECK(node["type"] == "mapping_3d");
  CHECK(node["process"] == "maps");
  CHECK(node["rate_hz"] == 2.0);
  CHECK(node["on"].is_null());
  CHECK(node["budget_ms"] == 40.0);
  CHECK(node["proven_ms"] == 90.0);
  CHECK(node["outputs"] == Json{"map.obstacles"});
  CHECK(graph["chains"][0]["bound_ms"] == 200.0);
  CHECK(graph["chains"][0]["proven_ms"] == 120.5);
  CHECK(graph["modes"] == Json{"full", "rest"});
  CHECK(graph["ports"][0]["capacity"] == Json{4, 3, 1, 0});
  CHECK(graph["ports"][0]["layout"]["fields"].size() == MessageType::of<Grid>().fields.size());
  CHECK(graph["parameters"].size() == run.node->params().size());
  for (const Json& parameter : graph["parameters"]) {
    CAPTURE(parameter["param"]);
    CHECK(parameter["node"] == "map");
    CHECK(parameter["value"] == parameter["default"]);
    if (parameter.contains("least")) CHECK(parameter["least"] <= parameter["most"]);
  }
}

TEST_CASE("its state has the figures of the board, in the order of the description") {
  FollowedRun run;
  Json state = attach::state_json(run.subject());
  CHECK(state["nodes"][0]["completed"] == 0);
  CHECK(state["chains"][0]["age_ms"].is_null());
  run.board->task(0).completed.store(17);
  run.board->task(0).largest_response_ns.store(31'000'000);
  run.board->port(0).last_age_ns.store(5'000'000);
  run.board->port(0).largest_age_ns.store(8'000'000);
  run.board->process(1).pid.store(4711);
  run.board->process(1).reach(ProcessRecord::running, 1);
  run.frozen = {"a miss"};
  state = attach::state_json(run.subject());
  CHECK(state["mode"] == "full");
  CHECK(state["nodes"][0]["completed"] == 17);
  CHECK(state["nodes"][0]["response_max_ms"] == 31.0);
  CHECK(state["chains"][0] == Json{{"age_ms", 5.0}, {"age_max_ms", 8.0}});
  REQUIRE(state["processes"].size() == 3);
  CHECK(state["processes"][0]["pid"] == 77);
  CHECK(state["processes"][1]["state"] == "starting");
  CHECK(state["processes"][2] == Json{{"name", "maps"}, {"pid", 4711}, {"state", "running"}, {"restarts", 0}});
  CHECK(state["frozen"] == Json{"a miss"});
}

TEST_CASE("each job is told once; of more than the board has, the newest") {
  FollowedRun run;
  const attach::Subject subject = run.subject();
  TaskStatistics& statistics = run.board->task(0);
  const auto finish = [&](int count) {
    for (int i = 0; i < count; ++i) {
      const uint64_t n = statistics.job_count.load();
      const auto at_ns = 1'000'000'000 + static_cast<int64_t>(n) * 1'000'000;
      statistics.jobs[n % statistics.jobs.size()] = {at_ns, at_ns + 1000, at_ns + 500'000, 1};
      statistics.job_count.store(n + 1);
    }
  };
  finish(3);
  attach::JobsSince jobs(subject);
  CHECK(jobs.take().empty());  // those before it looked
  finish(2);
  const Json two = jobs.take();
  REQUIRE(two.size() == 2);
  CHECK(two[1] == Json{0, 0.004, 0.004001, 0.0045, 1});
  finish(1000);
  const Json many = jobs.take();
  CHECK(many.size() == 63);
  CHECK(many.back()[1] == 1.004);
  CHECK(jobs.take().empty());
}

TEST_CASE("events of all kinds are told once, in the order of their instants") {
  FollowedRun run;
  const attach::Subject subject = run.subject();
  attach::EventsSince events(subject);
  CHECK(events.take().empty());
  RunBoard& board = *run.board;
  board.faults().append({Fault::hang, 0, 3, 4'000'000'000, BoundedText<200>("hangs")});
  board.faults().append({Fault::hang, 9, 3, 4'000'000'000, BoundedText<200>("of nobody")});
  board.modes().request(1, 3'000'000'000, "by hand");
  board.marks().append({2'000'000'000, 0, BoundedText<200>("here")});
  Outage outage;
  outage.process = 1;
  outage.from_ns = 5'000'000'000;
  outage.cause = BoundedText<200>("was killed");
  board.outages().add(outage);
  Json told = events.take();
  REQUIRE(told.size() == 4);
  CHECK(told[0] == Json{{"at_s", 1.0}, {"kind", "mark"}, {"node", ""}, {"text", "here"}});
  CHECK(told[1] == Json{{"at_s", 2.0}, {"kind", "mode"}, {"node", ""}, {"text", "rest: by hand"}});
  CHECK(told[2] == Json{{"at_s", 3.0}, {"kind", "fault"}, {"node", "map"}, {"text", "hangs"}});
  CHECK(told[3] == Json{{"at_s", 4.0}, {"kind", "outage"}, {"node", ""}, {"text", "process maps was killed"}});
  CHECK(events.take().empty());
  board.outages()[0].back_ns = 5'250'000'000;
  told = events.take();
  REQUIRE(told.size() == 1);
  CHECK(told[0]["text"] == "process maps is back after 0.25 s");
  LogLine line;
  line.at_ns = 6'000'000'000;
  line.level = LogLevel::warning;
  line.text = BoundedText<200>("too dark");
  LogWriter(board.log(0)).append(line);
  CHECK(events.take() ==
        Json::array({{{"at_s", 5.0}, {"kind", "log"}, {"node", "map"}, {"text", "too dark"}, {"level", "warning"}}}));
  run.frozen = {"why"};
  CHECK(events.take()[0]["kind"] == "frozen");
  run.frozen.push_back("why else");
  told = events.take();
  REQUIRE(told.size() == 1);
  CHECK(told[0]["text"] == "why else");
  CHECK(events.take().empty());
}

TEST_CASE("who follows is sent each new message as a record packs it, until he drops the output") {
  FollowedRun run;
  Following following(run.subject());
  REQUIRE(following.near->write({{"add", "map.obstacle"}}));
  CHECK(following.line()["error"].get<std::string>().find("did you mean `map.obstacles`") != std::string::npos);
  REQUIRE(following.near->write({{"add", 5}}));
  CHECK(following.line()["error"] == "add names an output");
  REQUIRE(following.near->write({{"dance", 5}}));
  CHECK(following.line().contains("error"));
  REQUIRE(following.near->write({{"add", "map.obstacles"}, {"every_ms", 0}}));
  for (const int16_t value : {int16_t{500}, int16_t{700}}) {
    run.publish(value);
    const Json line = following.line();
    CHECK(line["message"] == "map.obstacles");
    const auto packed = following.near->read_bytes(line["bytes"].get<size_t>());
    REQUIRE(packed);
    const MessageType& type = MessageType::of<Grid>();
    const AlignedBytes memory = aligned_bytes(type.bytes({.width = 4, .height = 3}));
    type.place(memory.get(), {.width = 4, .height = 3});
    REQUIRE(record::unpack(type, std::as_bytes(std::span(packed->data(), packed->size())), memory.get()));
    CHECK(reinterpret_cast<const Grid*>(memory.get())->cells[0] == value);
  }
  REQUIRE(following.near->write({{"drop", "map.obstacles"}}));
  REQUIRE(following.near->write({{"state_every_ms", 1}}));
  for (int i = 0; i < 3; ++i) {
    const Json line = following.line();
    CHECK(line["state"]["nodes"].size() == 1);
    CHECK(line["epoch_ns"] == 1'000'000'000);
  }
  run.publish(900);
  for (int i = 0; i < 3; ++i) CHECK(following.line().contains("state"));  // and no message
  CHECK(run.writer->statistics().in_use == 2);                            // what the ring keeps
}

TEST_CASE("who has gone is let go") {
  FollowedRun run;
  Following following(run.subject());
  REQUIRE(following.near->write({{"add", "map.obstacles"}}));
  following.near.reset();
  run.publish(1);
  following.thread.join();  // without `ending`
  following.thread = std::thread([] {});
}
