// SPDX-License-Identifier: Apache-2.0
#include "graph/compose/partition.hpp"

#include <doctest/doctest.h>

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
