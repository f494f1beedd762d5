// SPDX-License-Identifier: Apache-2.0
// Real hardware from a graph's device entry to a message: with doubles where there is none.
#include <doctest/doctest.h>

#include "graph/ace/ace_registry.hpp"
#include "hal/base/base_double.hpp"
#include "hal/devices.hpp"
#include "hal/head/head_double.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/odometry.hpp"
#include "tests/conformance/fake_writer.hpp"
#include "tests/graph_folder.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::hal;
using test::graph_folder;

namespace {

tl::expected<std::unique_ptr<DeviceNode>, DeviceError> made(const std::string& kind, const std::string& driver,
                                                            nlohmann::json settings, const Clock& clock) {
  Devices devices;
  return make_device(ace_registry().devices, {"thing", kind, driver, std::move(settings), graph_folder(), 1}, devices,
                     clock);
}

/// A node on a double: jobs of 20 ms until it has sent a message; then its stamp's age.
template <class Message, class Double>
int64_t age_of_first(const std::string& kind, nlohmann::json settings) {
  test::TemporaryFolder folder;
  VirtualClock clock(1'000'000'000);
  const std::string interface = "unix:" + (folder.path / "can").string();
  Double device(interface, clock);
  REQUIRE(device.plug_in().has_value());
  settings["interface"] = interface;
  auto node = made(kind, "can", std::move(settings), clock);
  REQUIRE_MESSAGE(node.has_value(), (node ? "" : node.error().text()));
  Setup setup{clock, graph_folder(), {}, 1, Rate{50, 1}};
  (*node)->setup(setup);
  test::FakeWriter writer(*(*node)->outputs().at(0));
  (*node)->start(clock.now_ns());
  for (uint64_t k = 0; k < 100; ++k) {
    const int64_t release = clock.now_ns() + 20'000'000;
    clock.advance_to(release);
    device.run_to(release);
    Job job(clock, k, release, release + 20'000'000, 0, "full");
    PortAccess::reset(*(*node)->outputs()[0]);
    (*node)->run(job);
    if (writer.template sent<Message>() != nullptr) return release - writer.stamp_ns();
  }
  return -1;
}

}  // namespace

TEST_CASE("hardware: head and base on a bus, from settings to messages") {
  CHECK(age_of_first<HeadState, head::HeadDouble>("camera_head", {{"eyelids", false}}) == 0);
  CHECK(age_of_first<Odometry, base::BaseDouble>("mobile_base", {{"track", "0.4m"}, {"wheel_step", "0.1mm"}}) == 0);
}

TEST_CASE("hardware: what is absent is a failing device; what is written wrongly is bad input") {
  VirtualClock clock;
  struct Case {
    const char *kind, *driver;
    nlohmann::json settings;
    bool bad_input;
    const char* part;
  };
  for (const Case& c :
       {Case{"camera_head", "can", {{"interface", "can99"}}, false, "can99"},
        Case{"camera_head", "can", nlohmann::json::object(), true, "`interface` is missing"},
        Case{"mobile_base", "can", {{"interface", "can99"}}, false, "can99"},
        Case{"mobile_base", "can", {{"interface", "can99"}, {"track", "0m"}}, true, "`track`"},
        Case{"digital_lines", "gpio", {{"chip", "/dev/gpiochip99"}}, false, "/dev/gpiochip99"},
        Case{"digital_lines", "gpio", {{"chip", "/dev/gpiochip99"}, {"inputs", "a,,b"}}, true, "`inputs`"},
        Case{"digital_lines", "gpio", {{"chip", "/dev/gpiochip99"}, {"pulse", "2ms"}}, true, "`pulse`"},
        Case{"stereo_camera", "v4l2", {{"path", "/dev/video99"}, {"rig", "rigs/xb3.yaml"}}, false, "/dev/video99"},
        Case{"stereo_camera", "v4l2", {{"path", "/dev/video99"}}, true, "`rig` is missing"},
        Case{"stereo_camera",
             "v4l2",
             {{"path", "/dev/video99"}, {"rig", "rigs/xb3.yaml"}, {"format", "jpeg"}},
             true,
             "y16, y8i, rgb3, yuyv or grey"},
        Case{"stereo_camera",
             "v4l2",
             {{"path", "/dev/video99"}, {"rig", "rigs/xb3.yaml"}, {"left", 2}},
             true,
             "use two of 0..1"},
        Case{"camera_head", "double", {{"world", "worlds/lab.xml"}}, true, "lives in real time only"},
        Case{"camera_head", "double", {{"world", "worlds/lab.xml"}, {"interface", "can0"}}, true, "`interface`"}}) {
    const auto node = made(c.kind, c.driver, c.settings, clock);
    REQUIRE_FALSE(node.has_value());
    CHECK_MESSAGE(node.error().bad_input == c.bad_input, node.error().text());
    CHECK_MESSAGE(node.error().text().find(c.part) != std::string::npos, node.error().text());
  }
}

TEST_CASE("hardware: doubles refuse what they do not know") {
  const MonotonicClock clock;
  struct Case {
    const char* kind;
    nlohmann::json settings;
    const char* part;
  };
  for (Case c : {Case{"laser_scanner", {{"model", "lms500"}}, "use lms200 or lms400"},
                 Case{"laser_scanner", {{"model", "lms200"}, {"failures", "bus_off 1s..2s"}}, "wrong_baud"},
                 Case{"camera_head", {{"failures", "wrong_baud 1s..2s"}}, "bus_off"},
                 Case{"digital_lines", {{"failures", "silent 1s..2s"}}, "unplugged, frozen"},
                 Case{"mobile_base", {{"drive", "walk"}}, "path or command"},
                 Case{"stereo_camera", {{"rig", "rigs/xb3.yaml"}, {"format", "yuyv"}}, "use y16, y8i, rgb3 or grey"}}) {
    c.settings["world"] = "worlds/lab.xml";
    const auto node = made(c.kind, "double", c.settings, clock);
    REQUIRE_FALSE(node.has_value());
    CHECK(node.error().bad_input);
    CHECK_MESSAGE(node.error().text().find(c.part) != std::string::npos, node.error().text());
  }
}
