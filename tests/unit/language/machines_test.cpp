// SPDX-License-Identifier: Apache-2.0
// A graph for several machines, and the part of each.
#include <set>

#include "fixture.hpp"
#include "graph/language/part_of_machine.hpp"

using namespace takt;
using namespace takt::test;
using namespace takt::graph;

namespace {

const std::string kMachines = R"(machines:
  eyes: {address: 10.0.0.1, runs: [camera, depth], ages: {ego_motion.motion: 250ms}}
  legs: {address: 10.0.0.2, runs: [base, plan]}
network: {latency: 5ms, clock_error: 200us, domain: 7}
)";

GraphSpec part(const std::string& machine, const std::string& graph = kGraph + kMachines) {
  LoadOptions options;
  options.machine = machine;
  Loaded loaded = Files(graph).load(options);
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  return *loaded.graph;
}

void wrong(const std::string& from, const std::string& to, const std::string& at,
           const std::vector<std::string>& words) {
  const std::string graph = kGraph + with(kMachines, from, to);
  expect_at(Files(graph).load(), "graph.yaml", graph, at, words, kGraph.size());
}

std::set<std::string> ids(const GraphSpec& graph) {
  std::set<std::string> ids;
  for (const DeviceSpec& device : graph.devices) ids.insert(device.id);
  for (const NodeSpec& node : graph.nodes) ids.insert(node.id);
  return ids;
}

const DeviceSpec& device(const GraphSpec& graph, const std::string& id) {
  const auto found =
      std::find_if(graph.devices.begin(), graph.devices.end(), [&](const auto& d) { return d.id == id; });
  REQUIRE(found != graph.devices.end());
  return *found;
}

}  // namespace

TEST_CASE("The bandwidth of the network is a number with its unit") {
  const auto with_bandwidth = [](const std::string& text) {
    return kGraph + with(kMachines, "domain: 7", "domain: 7, bandwidth: " + text);
  };
  CHECK(part("legs").network.bandwidth == std::nullopt);
  CHECK(part("legs", with_bandwidth("1Gbit")).network.bandwidth == 1'000'000'000);
  CHECK(part("legs", with_bandwidth("54.5 Mbit")).network.bandwidth == 54'500'000);
  for (const char* none : {"fast", "0Mbit", "-1Gbit", "10MB", "1e300Gbit"})
    wrong("domain: 7", std::string("domain: 7, bandwidth: ") + none, none, {"kbit, Mbit or Gbit"});
  CHECK(part("eyes").export_readers.at("ego_motion.motion") == std::set<std::string>{"legs"});
}

TEST_CASE("Each machine has what it runs, and what it reads of others as devices at twice their rate") {
  const GraphSpec legs = part("legs");
  CHECK(legs.machine == "legs");
  CHECK(legs.isolation == "subsystem");
  CHECK(ids(legs) == std::set<std::string>{"base", "planner", "ego_motion", "eyes"});
  const DeviceSpec& motion = device(legs, "ego_motion");
  REQUIRE(motion.remote);
  CHECK(motion.remote->machine == "eyes");
  CHECK(motion.remote->type == "ego_motion");
  CHECK(!motion.remote->of_device);
  CHECK(motion.remote->ports == std::vector<std::string>{"motion"});
  // It is released by stereo at 15 Hz. 250 ms old when it is published, then the network and two clocks, then the next
  // one.
  CHECK(legs.schedule.entries.at("ego_motion").rate == Rate{30, 1});
  CHECK(motion.remote->lag_ns == 250'000'000 + 5'000'000 + 400'000 + Rate{15, 1}.period_ns());
  CHECK(device(legs, "eyes").remote->ports.empty());
  CHECK(legs.exported.empty());
  CHECK(legs.network.domain == 7);
  REQUIRE(legs.chains.size() == 1);  // it begins where it comes in
  CHECK(legs.chains.front().from == PortName{"ego_motion", "motion"});
  REQUIRE(legs.adjusted.size() == 1);
  CHECK(legs.adjusted.front() == "chain reaction: from ego_motion.motion: camera.pair is on machine eyes");

  const GraphSpec eyes = part("eyes");
  CHECK(ids(eyes) == std::set<std::string>{"camera", "stereo", "ego_motion", "legs"});
  CHECK(eyes.exported == std::vector<PortName>{{"ego_motion", "motion"}});
  CHECK(eyes.chains.empty());
  CHECK(eyes.modes.front().without == std::vector<std::string>{"stereo", "ego_motion"});
}

TEST_CASE("Machines do not wait for each other in a circle: it is refused, and parts have one order") {
  const std::string graph = kGraph + kMachines;
  const auto loaded = Files(graph).load();
  REQUIRE(loaded.graph);
  CHECK(setup_order(*loaded.graph) == std::vector<std::string>{"camera", "stereo", "ego_motion", "planner", "base"});
  const std::string round = with(with(kGraph, "max_age: 150ms}}", "max_age: 150ms}, guess: planner.guess}"),
                                 "exports: [planner.velocity]", "exports: [planner.velocity, planner.guess]");
  REQUIRE(Files(round).load().graph);
  expect_at(Files(round + kMachines).load(), "graph.yaml", round, "planner.guess}",
            {"`ego_motion` of machine `eyes` reads `planner.guess` of machine `legs`", "let one machine run both"});
}

TEST_CASE("A device of another machine is one here, too; an age that the graph does not say is not known") {
  const GraphSpec legs = part("legs", kGraph + R"(machines:
  eyes: {address: 10.0.0.1, runs: [camera]}
  legs: {address: 10.0.0.2, runs: [base, depth, plan]}
)");
  const DeviceSpec& camera = device(legs, "camera");
  REQUIRE(camera.remote);
  CHECK(camera.remote->of_device);
  CHECK(camera.remote->type == "stereo_camera");
  CHECK(!camera.remote->lag_ns);
  CHECK(legs.schedule.entries.at("camera").rate == Rate{30, 1});
  CHECK(legs.chains.front().from == PortName{"camera", "pair"});
  CHECK(legs.adjusted.empty());
}

TEST_CASE("The loss of a machine is one of a device; on one machine none can be lost") {
  const std::string graph =
      with(kGraph, "modes:\n", "modes:\n  deaf: {without: [planner, base], lost: [eyes]}\n") + kMachines;
  const GraphSpec legs = part("legs", graph);
  CHECK(legs.modes.front().lost == std::vector<std::string>{"eyes"});
  CHECK(part("eyes", graph).modes.front().lost.empty());
  const Loaded whole = Files(graph).load();
  REQUIRE(whole.graph);
  CHECK(whole.graph->machine == "");
  CHECK(whole.graph->modes.front().lost.empty());
  CHECK(ids(*whole.graph) == std::set<std::string>{"camera", "base", "stereo", "ego_motion", "planner"});
}

TEST_CASE("Each subsystem and device runs on one machine, with what releases its nodes") {
  wrong("runs: [base, plan]", "runs: [base]", "machines", {"no machine runs `plan`"});
  wrong("runs: [base, plan]", "runs: [base, plan, camera]", "camera]}",
        {"`legs` runs `camera`", "machine `eyes` runs"});
  wrong("runs: [base, plan]", "runs: [base, plan, planner]", "planner]",
        {"`planner`, which is no subsystem or device", "`plan`"});
  wrong("ages: {ego_motion.motion", "ages: {ego_motion.moton", "ego_motion.moton",
        {"no output of what it runs", "did you mean `ego_motion.motion`"});
  wrong("ages: {ego_motion.motion", "ages: {planner.velocity", "planner.velocity", {"no output of what it runs"});
  const auto wire = [](const char* text, const char* at, std::vector<std::string> words) {
    const std::string ages = "ages: {ego_motion.motion: 250ms}";
    wrong(ages, ages + ", wire: {" + text + "}", at, std::move(words));
  };
  wire("ego_motion.motion: jpeg", "ego_motion.motion: jpeg", {"has no pictures", "give zstd or lz4"});
  wire("planner.velocity: zstd", "planner.velocity: zstd", {"`wire` of machine `eyes`", "no output of what it runs"});
  wire("ego_motion.motion: rar", "rar", {"lz4"});
  wrong("latency: 5ms", "latency: 0ms", "0ms, clock", {"`latency` of `network` must be above 0"});
  wrong("domain: 7", "domain: 300", "300", {"230"});
  wrong("address: 10.0.0.2, ", "", "legs: {runs", {"address"});
  const std::string apart = with(kSchedule, "planner: {rate: 1/3}", "planner: {on: ego_motion.motion}");
  expect_at(Files(kGraph + kMachines, apart).load(), "schedule.yaml", apart, "planner: {on",
            {"`planner` is released by `ego_motion.motion`, which another machine runs"});
  LoadOptions options;
  options.machine = "arms";
  const Loaded none = Files(kGraph + kMachines).load(options);
  REQUIRE(none.problems.size() == 1);
  CHECK(none.problems[0].text.find("no machine `arms`; machines: eyes, legs") != std::string::npos);
  CHECK(Files().load(options).problems.at(0).text.find("has no `machines`") != std::string::npos);
}
