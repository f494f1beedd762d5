// SPDX-License-Identifier: Apache-2.0
// What `takt fault` does to a device node: a parameter that its simulated device or double obeys.
#include <doctest/doctest.h>

#include "graph/ace/ace_registry.hpp"
#include "hal/devices.hpp"
#include "hal/gpio/lines_node.hpp"
#include "hal/settings/failures.hpp"
#include "tests/conformance/fake_writer.hpp"
#include "tests/graph_folder.hpp"
#include "tests/nanoseconds.hpp"

using namespace takt;

namespace {

/// SilentLines that are silent when they are told so; without faults they are as hardware.
class SilentLines final : public DigitalLines {
 public:
  explicit SilentLines(bool simulated) : simulated_(simulated) {}
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  DeviceResult open() override { return {}; }
  void close() override {}
  DeviceResult start(int64_t) override { return {}; }
  void stop() override {}
  FaultSwitch* faults() override { return simulated_ ? &schedule_.by_hand() : nullptr; }
  uint32_t count() const override { return 1; }
  LinesReading read(int64_t wanted_ns) override {
    return {schedule_.at(wanted_ns) ? ReadStatus::no_data : ReadStatus::ok, wanted_ns, 1, 0};
  }
  bool write(uint32_t, bool, int64_t) override { return false; }

 private:
  bool simulated_;
  FailureSchedule schedule_{{}, std::array{Misbehaviour::none, Misbehaviour::silent}};
};

ParamBase& fault_of(const DeviceNode& node) {
  REQUIRE(node.params().size() == 1);
  return *node.params()[0];
}

std::string known_to(const Registry& registry, const char* kind, nlohmann::json settings) {
  settings["world"] = "worlds/lab.xml";
  hal::Devices devices;
  const MonotonicClock clock;
  const auto node = hal::make_device(
      registry.devices, {"it", kind, settings["driver"], settings, test::graph_folder(), 1}, devices, clock);
  REQUIRE_MESSAGE(node.has_value(), (node ? "" : node.error().text()));
  return names_of(faults_of((*node)->known_faults()));
}

}  // namespace

TEST_CASE("a fault that is switched on strikes the next job, until it is switched off") {
  LinesNode node(std::make_unique<SilentLines>(true));
  test::FakeWriter writer(*node.outputs()[0]);
  VirtualClock clock;
  Setup setup{clock, ".", {}, 1, Rate{20, 1}};
  node.setup(setup);
  ParamBase& fault = fault_of(node);
  node.end_setup();
  CHECK(fault.live());
  node.start(0);
  const auto sends = [&](int64_t ms) {
    PortAccess::reset(*node.outputs()[0]);
    Job job(clock, 0, ms * test::kMs, (ms + 50) * test::kMs, 0, "full");
    node.run(job);
    return PortAccess::sent(*node.outputs()[0]);
  };
  CHECK(node.known_faults() == fault_bits(std::array{Misbehaviour::silent}));
  CHECK(sends(0));
  CHECK(fault.value_text() == "none");
  REQUIRE(fault.set(std::string("silent")));
  CHECK(fault.value_text() == "silent");
  CHECK_FALSE(sends(50));
  const auto refused = fault.set(std::string("frozen"));
  REQUIRE_FALSE(refused);
  CHECK(refused.error() == "is frozen, must be none or one of silent");
  CHECK_FALSE(fault.set(int64_t{1}));
  CHECK_FALSE(sends(100));  // a refusal changes nothing
  REQUIRE(fault.set(std::string("none")));
  CHECK(sends(150));
}

TEST_CASE("hardware refuses faults") {
  LinesNode node(std::make_unique<SilentLines>(false));
  CHECK(node.known_faults() == 0);
  CHECK_FALSE(fault_of(node).set(std::string("silent")));
  CHECK_FALSE(fault_of(node).set(std::string("none")));
}

TEST_CASE("simulated devices and doubles know their faults; a script has none") {
  const Registry registry = ace_registry();
  CHECK(known_to(registry, "laser_scanner", {{"driver", "sim"}}) == "silent, unplugged, garbage, frozen");
  CHECK(known_to(registry, "digital_lines", {{"driver", "double"}}) == "unplugged, frozen");
  CHECK(known_to(registry, "mobile_base", {{"driver", "double"}}).find("bus_off") != std::string::npos);
  CHECK(known_to(registry, "interaction", {{"driver", "sim"}}).empty());
  CHECK(known_to(registry, "interaction", {{"driver", "double"}}) == "silent");
}
