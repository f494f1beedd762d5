// SPDX-License-Identifier: Apache-2.0
#include "graph/check/network.hpp"

#include <doctest/doctest.h>

#include <map>

#include "graph/check/check.hpp"
#include "plans.hpp"
#include "rt/msg/motion.hpp"

using namespace takt;
using namespace takt::graph;
using test::task;

namespace {

struct Kernel final : machine::Facts {
  std::map<std::string, std::string> files;
  std::optional<std::string> text(const std::string& path) const override {
    const auto file = files.find(path);
    return file == files.end() ? std::nullopt : std::optional(file->second);
  }
  std::vector<std::string> list(const std::string&) const override { return {}; }
  std::vector<int> allowed_cpus() const override { return {0}; }
  std::optional<int64_t> limit(int) const override { return std::nullopt; }
  bool is_root() const override { return false; }
  std::string user() const override { return "user"; }
  std::string program() const override { return "takt"; }
};

/// A machine with one output that two others read, 10 times a second, and one of another machine at 5 Hz.
struct OneOfThree {
  GraphSpec graph;
  Plan plan;
  Kernel kernel;
  OneOfThree() {
    graph.machine = "one";
    for (const char* name : {"one", "two", "three"}) graph.machines.push_back({name, "10.0.0.1", {}, {}, {}, {}});
    graph.export_readers["maker.motion"] = {"two", "three"};
    DeviceSpec remote;
    remote.id = "far", remote.remote = RemoteSpec{"two", "maker", false, {"motion"}};
    graph.devices.push_back(remote);
    plan.tasks = {task("maker", 10, 1, 50, Criticality::low), task("far", 10, 1, 50, Criticality::low)};
    for (const char* node : {"maker", "far"}) {
      PortPlan port;
      port.node = node, port.port = "motion", port.type = &MessageType::of<Motion>();
      plan.tasks[plan.ports.size()].ports = {plan.ports.size()};
      plan.ports.push_back(port);
    }
  }
};

}  // namespace

TEST_CASE(
    "What goes over the network: each reader of an output, messages as they are packed; half the rate of what comes") {
  const OneOfThree one;
  const NetworkLoad load = network_load(one.graph, one.plan);
  const double message_bits = 8.0 * static_cast<double>(one.plan.ports[0].message_bytes());
  CHECK(load.largest_bytes == one.plan.ports[0].message_bytes());
  CHECK(load.in_bit_s > 5 * message_bits);
  CHECK(load.out_bit_s == doctest::Approx(4 * load.in_bit_s));  // two readers, twice the rate
}

TEST_CASE("More than the declared bandwidth is refused with what to do; without one nothing is proven") {
  OneOfThree one;
  auto found = check_network(one.graph, one.plan, one.kernel);
  REQUIRE(found);
  CHECK(found->problem.empty());
  REQUIRE(found->notes.size() == 1);
  CHECK(found->notes[0].find("`network` has no `bandwidth`") != std::string::npos);
  one.graph.network.bandwidth = static_cast<int64_t>(found->load.out_bit_s) + 1;
  CHECK(check_network(one.graph, one.plan, one.kernel)->problem.empty());
  *one.graph.network.bandwidth -= 2;
  const std::string problem = check_network(one.graph, one.plan, one.kernel)->problem;
  CHECK(problem.find("machine `one` sends up to") == 0);
  const CheckResult result = check(one.graph, one.plan);
  CHECK(!result.admitted);
  CHECK(result.text.find(problem.substr(0, 24)) != std::string::npos);
  one.graph.machine.clear();
  CHECK(!check_network(one.graph, one.plan, one.kernel));
}

TEST_CASE("Small receive buffers are named with their cure") {
  Kernel kernel;
  CHECK(small_buffers(1 << 20, kernel).empty());  // not known
  kernel.files["/proc/sys/net/core/rmem_max"] = "212992\n";
  CHECK(small_buffers(72'000, kernel).empty());
  CHECK(small_buffers(1'000'000, kernel) == "sudo sysctl -w net.core.rmem_max=2097152");
}

TEST_CASE("Addresses that others reach are named, unless there are keys") {
  OneOfThree one;
  CHECK(open_addresses(one.graph).empty());
  one.graph.machines[1].address = "203.0.113.7";
  const auto lines = open_addresses(one.graph);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find("machine `two` has the address 203.0.113.7") == 0);
  one.graph.network.keys = "keys/one";
  CHECK(open_addresses(one.graph).empty());
}

TEST_CASE("Private are RFC 1918, link-local, ULA and loopback") {
  for (const char* address : {"10.0.0.1", "172.16.0.1", "172.31.255.1", "192.168.7.1", "169.254.1.1", "127.0.0.1",
                              "::1", "fe80::1", "fd00::1", "fc12::1"})
    CHECK_MESSAGE(is_private(address), address);
  for (const char* address : {"11.0.0.1", "172.15.0.1", "172.32.0.1", "192.169.0.1", "8.8.8.8", "2001:db8::1",
                              "fec0::1", "robot.example", ""})
    CHECK_MESSAGE(!is_private(address), address);
}
