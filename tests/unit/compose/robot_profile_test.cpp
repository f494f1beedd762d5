// SPDX-License-Identifier: Apache-2.0
// graph/ace.yaml with the profile `robot`: every node set up beside the drivers of the robot's hardware, none of it
// plugged in; and the same nodes and parameters on raw images of the simulated world, in virtual time.
#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <functional>

#include "graph/ace/ace_registry.hpp"
#include "hal/discovery/discovery.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/laser_scan.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;

namespace {

graph::GraphSpec robot() {
  graph::LoadOptions options;
  options.profile = "robot";
  graph::Loaded loaded = graph::load(test::graph_folder() / "ace.yaml", options, ace_registry());
  for (const auto& problem : loaded.problems) MESSAGE(graph::to_string(problem));
  REQUIRE(loaded.graph);
  return std::move(*loaded.graph);
}

hal::DeviceConfig config_of(const graph::DeviceSpec& device, const graph::GraphSpec& graph) {
  return {device.id, device.kind, device.driver, device.settings, graph.directory, 1};
}

graph::Composition composed(const graph::GraphSpec& graph, const Registry& types, hal::Devices& devices,
                            const Clock& clock, const std::filesystem::path& folder,
                            const std::function<void(hal::DeviceConfig&)>& change) {
  const graph::DeviceFactory factory =
      [&](const graph::DeviceSpec& spec) -> tl::expected<std::unique_ptr<Node>, graph::ComposeError> {
    hal::DeviceConfig config = config_of(spec, graph);
    change(config);
    auto node = hal::make_device(types.devices, config, devices, clock);
    if (!node) FAIL(node.error().text());
    return std::move(*node);
  };
  auto composition = graph::compose(graph, types, factory, clock, {folder, 1});
  if (!composition) FAIL(graph::to_string(composition.error().problems.front()));
  return std::move(*composition);
}

const PortPlan& port_of(const Plan& plan, const std::string& node, const std::string& port) {
  const auto found = std::find_if(plan.ports.begin(), plan.ports.end(),
                                  [&](const PortPlan& p) { return p.node == node && p.port == port; });
  REQUIRE(found != plan.ports.end());
  return *found;
}

/// Results that an output gave, and the newest one.
struct Given {
  int count = 0;
  size_t values = 0;  ///< of the newest one: disparities that are valid, cells that are known, echoes
};

/// Reads what the robot's devices and first nodes give.
class Probe final : public Node {
 public:
  Given narrow, wide, ground, front, floor, head;

  void setup(Setup&) override {}
  void run(Job&) override {
    see(narrow_, narrow, [](const DisparityMap& m) { return positive(m.disparity.items()); });
    see(wide_, wide, [](const DisparityMap& m) { return positive(m.disparity.items()); });
    see(ground_, ground, [](const Grid& m) { return positive(m.cells.items()); });
    see(front_, front, [](const LaserScan& scan) { return positive(scan.range_m.items()); });
    see(floor_, floor, [](const LaserScan& scan) { return positive(scan.range_m.items()); });
    see(head_, head, [](const HeadState&) { return size_t{1}; });
  }

 private:
  static size_t positive(auto items) {
    return static_cast<size_t>(std::count_if(items.begin(), items.end(), [](auto value) { return value > 0; }));
  }
  template <class Message, class Look>
  static void see(const Input<Message>& port, Given& given, Look look) {
    if (port.newest() == nullptr || !port.is_new()) return;
    ++given.count;
    given.values = look(*port.newest());
  }

  Input<DisparityMap> narrow_{this, "narrow", ""}, wide_{this, "wide", ""};
  Input<Grid> ground_{this, "ground", ""};
  Input<LaserScan> front_{this, "front", ""}, floor_{this, "floor", ""};
  Input<HeadState> head_{this, "head", ""};
};

/// Adds a node of that type to the graph, which reads these.
void add_probe(graph::GraphSpec& graph) {
  graph::NodeSpec probe{"probe", "probe", "mapping", {}, {}, {}, {}};
  const auto read = [&](const char* node, const char* port, const char* input) {
    probe.edges.push_back({{node, port}, input, 1, std::nullopt, {}});
  };
  read("stereo", "disparity", "narrow");
  read("stereo_wide", "disparity", "wide");
  read("ground_map", "grid", "ground");
  read("front_laser", "scan", "front");
  read("floor_laser", "scan", "floor");
  read("head", "state", "head");
  graph.nodes.push_back(std::move(probe));
  graph::ScheduleEntry entry;
  entry.rate = Rate{15, 1};
  entry.budget_ns = 1'000'000;
  graph.schedule.entries["probe"] = entry;
}

}  // namespace

TEST_CASE("ace on the robot: every node is set up while no device is plugged in, for pairs of raw colour images") {
  const test::TemporaryFolder folder;
  const graph::GraphSpec graph = robot();
  hal::Devices devices;
  const MonotonicClock clock;
  const auto composition = composed(graph, ace_registry(), devices, clock, folder.path,
                                    [](hal::DeviceConfig& config) { config.plugged = false; });
  for (const char* camera : {"head_camera", "ground_camera"}) {
    const Capacity& images = port_of(composition.plan, camera, "pair").capacity;
    CHECK(images.width == 640);
    CHECK(images.height == 480);
    CHECK(images.channels == 3);  // the driver makes colours of the mosaic
  }
  CHECK(port_of(composition.plan, "front_laser", "scan").capacity.count == 361);
  CHECK(port_of(composition.plan, "floor_laser", "scan").capacity.count == 280);
  CHECK(port_of(composition.plan, "stereo", "disparity").capacity.width == 640);
}

TEST_CASE("ace on the robot: what is wrong with settings is told without a device, too") {
  const graph::GraphSpec graph = robot();
  const Registry known = ace_registry();
  hal::Devices devices;
  const MonotonicClock clock;
  const auto told = [&](const char* id, const char* setting, const nlohmann::json& value) {
    const auto device =
        std::find_if(graph.devices.begin(), graph.devices.end(), [&](const auto& d) { return d.id == id; });
    hal::DeviceConfig config = config_of(*device, graph);
    config.plugged = false;
    config.settings[setting] = value;
    const auto node = hal::make_device(known.devices, config, devices, clock);
    REQUIRE_FALSE(node.has_value());
    return node.error().text();
  };
  CHECK(told("head_camera", "left", 0).find("`left` and `right`") != std::string::npos);
  CHECK(told("head_camera", "bayer", "rgbg").find("use none, rggb") != std::string::npos);
  CHECK(told("front_laser", "baud", 57600).find("500000") != std::string::npos);
}

TEST_CASE("takt devices: its lines are what a graph's profile takes") {
  const test::TemporaryFolder folder;
  const auto sysfs = folder.path / "sys";
  const auto write = [&](const char* name, const std::string& text) {
    std::filesystem::create_directories((sysfs / name).parent_path());
    std::ofstream(sysfs / name) << text << "\n";
  };
  write("sys/class/video4linux/video0/name", "bridge");
  write("sys/class/net/can0/type", "280");
  write("sys/class/net/can0/operstate", "up");
  std::filesystem::create_directories(sysfs / "sys/bus/gpio/devices/gpiochip0");
  std::filesystem::create_directories(sysfs / "sys/class/tty/ttyUSB0");
  std::string profile;
  const auto found = discovery::discover(sysfs);
  REQUIRE(found.size() == 4);
  for (const auto& device : found) profile += "    " + device.line + "\n";
  folder.write("schedule.yaml",
               "takt: 1\nname: s\npolicy: cooperative\ncores: [0]\nnodes:\n  stop: {rate: 15, budget: 1ms, "
               "criticality: high}\n");
  const auto file = folder.write("graph.yaml", R"(takt: 1
name: found
schedule: schedule.yaml
default_profile: robot
devices:
  camera: {kind: stereo_camera, rate: 15}
  head: {kind: camera_head, rate: 15}
  lines: {kind: digital_lines, rate: 15}
  laser: {kind: laser_scanner, model: lms200, rate: 15}
profiles:
  robot:
)" + profile + R"(subsystems:
  robot:
    stop: {type: obstacle_stop, in: {scan: laser.scan, lines: lines.state}}
)");
  const graph::Loaded loaded = graph::load(file, {}, ace_registry());
  for (const auto& problem : loaded.problems) MESSAGE(graph::to_string(problem));
  CHECK(loaded.graph);
}

TEST_CASE("ace on the robot: raw pairs become disparities and a ground map, with scans and head beside them") {
  const test::TemporaryFolder folder;
  graph::GraphSpec graph = robot();
  add_probe(graph);
  graph.schedule.policy = Policy::cooperative;
  graph.schedule.cores = {0, 1};
  Registry types = ace_registry();
  types.nodes.add<Probe>("probe", Layer::storage, "test");
  hal::Devices devices;
  VirtualClock clock{1'000'000'000};
  const auto composition = composed(graph, types, devices, clock, folder.path, [](hal::DeviceConfig& config) {
    config.driver = "sim";
    nlohmann::json settings{{"world", (test::graph_folder() / "worlds/lab.xml").string()}};
    for (const char* kept : {"rig", "rate", "mount"})  // what the robot's hardware and the simulated have in common
      if (config.settings.contains(kept)) settings[kept] = config.settings[kept];
    config.settings = settings;
  });
  const auto transport = make_local_transport(composition.plan.ports);
  Executor executor(composition.plan, *transport, clock, {3'000'000'000, 0, false});
  executor.run();
  for (const auto& node : composition.nodes) node->finish();
  const auto probe = std::find_if(composition.nodes.begin(), composition.nodes.end(),
                                  [](const auto& node) { return dynamic_cast<const Probe*>(node.get()) != nullptr; });
  REQUIRE(probe != composition.nodes.end());
  const auto& seen = dynamic_cast<const Probe&>(**probe);
  CHECK(seen.narrow.count >= 40);
  CHECK(seen.narrow.values > 640 * 480 / 2);
  CHECK(seen.wide.count >= 12);
  CHECK(seen.wide.values > 640 * 480 / 2);
  CHECK(seen.ground.count >= 12);
  CHECK(seen.ground.values > 0);
  CHECK(seen.front.count >= 40);
  CHECK(seen.front.values > 100);
  CHECK(seen.floor.count >= 40);
  CHECK(seen.floor.values > 100);
  CHECK(seen.head.count >= 40);
}
