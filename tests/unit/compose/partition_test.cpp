// SPDX-License-Identifier: Apache-2.0
#include "graph/compose/partition.hpp"

#include <doctest/doctest.h>

#include "graph/compose/spares.hpp"

namespace {

using namespace takt;
using namespace takt::graph;

GraphSpec graph_of_three() {
  GraphSpec graph;
  graph.devices.push_back({"camera", "stereo_camera", "sim", {}, {}, {}, {}});
  graph.nodes.push_back({"stereo", "stereo", "depth", {}, {}, {}, {}});
  graph.nodes.push_back({"picture", "picture", "view", {}, {}, {}, {}});
  graph.nodes.push_back({"ego_motion", "ego_motion", "depth", {}, {}, {}, {}});
  return graph;
}

}  // namespace

TEST_CASE("one process for the devices, one per subsystem, in the order of the file") {
  std::vector<std::string> adjusted;
  const Partition parts = partition(graph_of_three(), adjusted);
  CHECK(parts.names == std::vector<std::string>{"devices", "depth", "view"});
  CHECK(parts.process_of.at("camera") == 0);
  CHECK(parts.process_of.at("stereo") == 1);
  CHECK(parts.process_of.at("ego_motion") == 1);
  CHECK(parts.process_of.at("picture") == 2);
  CHECK(adjusted.empty());
}

TEST_CASE("a node released by another process's output moves there with its whole subsystem, and it is said") {
  GraphSpec graph = graph_of_three();
  graph.schedule.entries["stereo"].on = PortName{"camera", "pair"};
  std::vector<std::string> adjusted;
  const Partition parts = partition(graph, adjusted);
  CHECK(parts.names == std::vector<std::string>{"devices", "view"});
  CHECK(parts.process_of.at("ego_motion") == parts.process_of.at("camera"));
  REQUIRE(adjusted.size() == 1);
  CHECK(adjusted[0] == "process depth -> devices: stereo runs on camera.pair, and a lane is never split");
}

TEST_CASE("a chain of such nodes ends up in one process") {
  GraphSpec graph = graph_of_three();
  graph.schedule.entries["stereo"].on = PortName{"camera", "pair"};
  graph.schedule.entries["picture"].on = PortName{"stereo", "disparity"};
  std::vector<std::string> adjusted;
  CHECK(partition(graph, adjusted).names == std::vector<std::string>{"devices"});
  CHECK(adjusted.size() == 2);
}

namespace {

/// camera -> stereo -> ego_motion (depth), stereo -> picture (view), with a chain to each end.
GraphSpec graph_with_chains(int64_t ego_motion_ns, int64_t picture_ns) {
  GraphSpec graph = graph_of_three();
  const auto reads = [&](size_t node, const char* from, const char* port) {
    EdgeSpec edge;
    edge.from = {from, port};
    graph.nodes[node].edges.push_back(edge);
  };
  reads(0, "camera", "pair");
  reads(1, "stereo", "disparity");
  reads(2, "stereo", "disparity");
  graph.subsystems = {{"depth", {}, {}}, {"view", {}, {}}};
  graph.schedule.entries["ego_motion"].criticality = Criticality::high;
  graph.chains.push_back({"motion", {"camera", "pair"}, {"ego_motion", "motion"}, ego_motion_ns, {}});
  graph.chains.push_back({"show", {"camera", "pair"}, {"picture", "picture"}, picture_ns, {}});
  return graph;
}

std::vector<bool> wanted(const GraphSpec& graph, std::vector<std::string>& adjusted) {
  std::vector<bool> all;
  for (const SpareChoice& choice : spares(graph, partition(graph, adjusted), adjusted)) all.push_back(choice.wanted);
  return all;
}

}  // namespace

TEST_CASE(
    "a spare by default: on a chain to a node of high criticality that cannot wait for a return, without a device") {
  std::vector<std::string> adjusted;
  CHECK(wanted(graph_with_chains(kReturn_ns - 1, kReturn_ns), adjusted) == std::vector<bool>{false, true, false});
  CHECK(wanted(graph_with_chains(kReturn_ns, kReturn_ns), adjusted) == std::vector<bool>{false, false, false});
  CHECK(wanted(graph_with_chains(kReturn_ns, 1), adjusted) == std::vector<bool>{false, false, false});  // low
  CHECK(adjusted.empty());
  const GraphSpec graph = graph_with_chains(200'000'000, kReturn_ns);
  CHECK(spares(graph, partition(graph, adjusted), adjusted)[1].why.find("chain motion allows 200 ms") == 0);
}

TEST_CASE("the graph has the last word on spares, but for a process with a device") {
  std::vector<std::string> adjusted;
  GraphSpec graph = graph_with_chains(200'000'000, kReturn_ns);
  graph.subsystems[0].spare = false;
  graph.subsystems[1].spare = true;
  CHECK(wanted(graph, adjusted) == std::vector<bool>{false, false, true});
  CHECK(adjusted.empty());
  graph.subsystems[0].spare = true;
  graph.schedule.entries["stereo"].on = PortName{"camera", "pair"};  // in the process of the camera
  CHECK(wanted(graph, adjusted) == std::vector<bool>{false, true});
  REQUIRE(adjusted.size() == 2);
  CHECK(adjusted[1] == "spare of process devices -> none: it owns device camera, which cannot be opened twice");
}

TEST_CASE("room for a takeover: what the process asks for once more, beside what all of them hold") {
  const GraphSpec graph = graph_of_three();
  std::vector<std::string> adjusted;
  const Partition parts = partition(graph, adjusted);
  Plan plan;
  plan.policy = Policy::deadline;
  plan.anticipate_ns = 0;
  for (const char* name : {"camera", "stereo", "picture", "ego_motion"}) {
    TaskPlan task;
    task.name = name;
    task.rate = Rate{10, 1};
    task.budget_ns = 10'000'000;
    task.deadline_ns = 50'000'000;
    plan.tasks.push_back(task);
  }
  const std::vector<TakeoverRoom> room = takeover_room(plan, parts, 1.1);
  REQUIRE(room.size() == 3);
  CHECK(room[1].needs == doctest::Approx(0.4));  // two lanes of 10 ms in 50
  CHECK(room[2].needs == doctest::Approx(0.2));
  CHECK(room[2].free == doctest::Approx(0.3));
  CHECK(room[2].fits());
  CHECK_FALSE(room[1].fits());
  CHECK(takeover_room(plan, parts, 0.5)[0].free == 0);
  const std::string text = spares_text(parts, {{false, ""}, {false, ""}, {true, "so it is"}}, room);
  CHECK(text ==
        "spare of process view: so it is; its takeover needs 0.200 cores beside those of the dead, 0.300 are free\n"
        "a return of process depth needs 0.400 cores beside those of the dead, 0.300 are free: its jobs run under "
        "SCHED_FIFO meanwhile\n");
  plan.policy = Policy::fixed;
  CHECK(takeover_room(plan, parts, 1.1).empty());
}
