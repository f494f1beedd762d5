// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "graph/ace/ace_registry.hpp"
#include "hal/devices.hpp"
#include "hal/sim/simulation.hpp"
#include "hal/sim/worlds.hpp"
#include "rt/msg/image.hpp"
#include "rt/time/rate.hpp"
#include "tests/conformance/fake_writer.hpp"
#include "tests/graph_folder.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/replay/carmen_file.hpp"

using namespace takt;
using namespace takt::hal;
using test::graph_folder;
using test::has;

namespace {

DeviceConfig config(const std::string& kind, const std::string& driver, nlohmann::json settings) {
  return {"thing", kind, driver, std::move(settings), graph_folder(), 1};
}
std::string error(const DeviceConfig& c) {
  Devices devices;
  VirtualClock clock;
  const auto node = make_device(ace_registry().devices, c, devices, clock);
  return node ? "" : node.error().text();
}
const nlohmann::json kWorld = {{"world", "worlds/lab.xml"}};

}  // namespace

TEST_CASE("unknown kinds, drivers and settings list the valid ones") {
  CHECK(has(error(config("radar", "sim", kWorld)),
            "actor, camera_head, digital_lines, interaction, laser_scanner, mobile_base, object_sensor, semantic_link, "
            "semantic_service, stereo_camera"));
  CHECK(has(error(config("stereo_camera", "v4l", kWorld)), "known drivers: sim, replay, v4l2"));
  CHECK(has(error(config("laser_scanner", "sim", {{"world", "worlds/lab.xml"}, {"beans", 3}})),
            "unknown setting `beans`"));
  CHECK(has(error(config("laser_scanner", "sim", nlohmann::json::object())), "`world` is missing"));
  CHECK(has(error(config("laser_scanner", "sim", {{"world", "worlds/none.xml"}})), "worlds/none.xml"));
  CHECK(has(error(config("stereo_camera", "sim", kWorld)), "`rig` is missing"));
  CHECK(has(error(config("stereo_camera", "replay", nlohmann::json::object())), "`directory`"));
  CHECK(has(error(config("mobile_base", "sim", {{"world", "worlds/lab.xml"}, {"drive", "walk"}})), "path or command"));
}

TEST_CASE("every simulated kind can be made with every setting that its listing calls required, and no other") {
  VirtualClock clock;
  const Registry registry = ace_registry();
  for (const DeviceKind& kind : registry.devices.all()) {
    if (kind.drivers.front().name != "sim") continue;
    Devices devices;
    nlohmann::json settings = nlohmann::json::object();
    for (const SettingInfo& setting : kind.settings) {
      if (!setting.required || (!setting.driver.empty() && setting.driver != "sim")) continue;
      settings[std::string(setting.name)] = setting.name == "world" ? "worlds/lab.xml" : "rigs/xb3.yaml";
    }
    const auto node =
        make_device(ace_registry().devices, config(std::string(kind.name), "sim", settings), devices, clock);
    CHECK_MESSAGE(node.has_value(), (node ? "" : node.error().text()));
    for (const SettingInfo& setting : kind.settings) CHECK_FALSE(setting.doc.empty());
  }
}

TEST_CASE("a job of the camera node sends one pair with the stamp of its release") {
  VirtualClock clock(1'000'000'000);
  Devices devices;
  auto settings = kWorld;
  settings["rig"] = "rigs/xb3.yaml";
  auto made = make_device(ace_registry().devices, config("stereo_camera", "sim", settings), devices, clock);
  REQUIRE(made.has_value());
  DeviceNode& node = **made;
  Setup setup{clock, graph_folder(), {}, 1, Rate{15, 1}};
  node.setup(setup);
  OutputPort& output = *node.outputs().at(0);
  CHECK(output.name() == "pair");
  CHECK(output.capacity().width == 640);
  test::FakeWriter writer(output);
  const Rate rate{15, 1};
  for (uint64_t k = 0; k < 3; ++k) {
    const int64_t release = rate.release_ns(1'000'000'000, static_cast<int64_t>(k));
    clock.advance_to(release);
    Job job(clock, k, release, release + 66'000'000, 0, "full");
    PortAccess::reset(output);
    node.run(job);
    const auto* pair = writer.sent<StereoPair>();
    REQUIRE(pair != nullptr);
    CHECK(writer.stamp_ns() == release);
    CHECK(pair->frame_number == k);
    CHECK(pair->left.size == 640u * 480u * 3u);
    CHECK(pair->camera.baseline_m == doctest::Approx(0.24));
    CHECK(pair->health == 0);
    CHECK_FALSE(job.without_result());
  }
  node.finish();
}

TEST_CASE("a replayed camera ends the run after its last frame") {
  VirtualClock clock;
  Devices devices;
  const auto image = (graph_folder() / "worlds/lab.pgm").string();
  auto made =
      make_device(ace_registry().devices,
                  config("stereo_camera", "replay",
                         {{"left", image}, {"right", image}, {"focal", 100}, {"baseline", "0.1m"}, {"frames", 2}}),
                  devices, clock);
  REQUIRE_MESSAGE(made.has_value(), (made ? "" : made.error().text()));
  DeviceNode& node = **made;
  Setup setup{clock, graph_folder(), {}, 1, Rate{15, 1}};
  node.setup(setup);
  test::FakeWriter writer(*node.outputs().at(0));
  std::vector<bool> ended, sent;
  for (uint64_t k = 0; k < 3; ++k) {
    const int64_t release = Rate{15, 1}.release_ns(0, static_cast<int64_t>(k));
    clock.advance_to(release);
    Job job(clock, k, release, release + 66'000'000, 0, "full");
    PortAccess::reset(*node.outputs()[0]);
    node.run(job);
    ended.push_back(job.ended());
    sent.push_back(writer.sent<StereoPair>() != nullptr);
  }
  CHECK(ended == std::vector<bool>{false, false, true});
  CHECK(sent == std::vector<bool>{true, true, false});
}

TEST_CASE("laser and base nodes replay a CARMEN log and end with it") {
  const test::CarmenFile log(test::odom_line(0, {}) + test::flaser_line(0, 181, 1) +
                             test::odom_line(0.1, {0.05, 0, 0}) + test::flaser_line(0.1, 181, 2) +
                             test::odom_line(0.2, {0.1, 0, 0}));
  VirtualClock clock;
  for (const auto& [kind, sends] : std::initializer_list<std::pair<const char*, std::vector<bool>>>{
           {"laser_scanner", {true, false, true, false, false}}, {"mobile_base", {true, true, true, true, false}}}) {
    Devices devices;
    auto made = make_device(ace_registry().devices,
                            config(kind, "replay", {{"log", log.path.string()}, {"start", "0s"}}), devices, clock);
    REQUIRE_MESSAGE(made.has_value(), (made ? "" : made.error().text()));
    DeviceNode& node = **made;
    Setup setup{clock, graph_folder(), {}, 1, Rate{15, 1}};
    node.setup(setup);
    node.start(0);
    test::FakeWriter writer(*node.outputs().at(0));
    std::vector<bool> sent;
    bool ended = false;
    for (uint64_t k = 0; k < 5; ++k) {  // 0, 67, 133, 200 and 267 ms
      const int64_t release = Rate{15, 1}.release_ns(0, static_cast<int64_t>(k));
      Job job(clock, k, release, release + 66'000'000, 0, "full");
      PortAccess::reset(*node.outputs()[0]);
      node.run(job);
      sent.push_back(PortAccess::sent(*node.outputs()[0]));
      CHECK(job.without_result() == (!sent.back() && !job.ended()));
      CHECK_FALSE(ended);
      ended = job.ended();
    }
    CHECK(sent == sends);
    CHECK(ended);
  }
}

TEST_CASE("settings of a replayed laser and base") {
  const test::CarmenFile log(test::odom_line(0, {}) + test::flaser_line(0, 181, 1));
  const auto with = [&](const char* kind, const std::string& name, const nlohmann::json& value) {
    nlohmann::json settings = {{"log", log.path.string()}};
    settings[name] = value;
    return error(config(kind, "replay", settings));
  };
  CHECK(with("laser_scanner", "range", "5m") == "");
  CHECK(with("laser_scanner", "mount", {{"y", "0.3m"}}) == "");
  CHECK(has(with("laser_scanner", "range", "0m"), "`range` is not positive"));
  for (const char* kind : {"laser_scanner", "mobile_base"}) {
    CHECK(with(kind, "speed", 2) == "");
    CHECK(has(with(kind, "speed", 0), "`speed`"));
    CHECK(has(with(kind, "start", "5"), "`start`"));
    CHECK(has(with(kind, "start", "1e300s"), "`start`"));
    CHECK(has(with(kind, "start", "5s"), "at or after 5"));
    CHECK(has(with(kind, "drive", "path"), "unknown setting `drive`"));
    CHECK(has(error(config(kind, "replay", nlohmann::json::object())), "`log` is missing"));
    CHECK(has(error(config(kind, "replay", {{"log", "none.log"}})), "none.log: cannot be opened"));
  }
}

TEST_CASE("laser, head, base and line nodes send one message a job, and share one world") {
  VirtualClock clock;
  Devices devices;
  for (const auto& [kind, port] :
       std::initializer_list<std::pair<const char*, const char*>>{{"laser_scanner", "scan"},
                                                                  {"camera_head", "state"},
                                                                  {"mobile_base", "odometry"},
                                                                  {"digital_lines", "state"},
                                                                  {"object_sensor", "objects"},
                                                                  {"actor", "outcome"}}) {
    auto made = make_device(ace_registry().devices, config(kind, "sim", kWorld), devices, clock);
    REQUIRE_MESSAGE(made.has_value(), (made ? "" : made.error().text()));
    DeviceNode& node = **made;
    Setup setup{clock, graph_folder(), {}, 1, Rate{15, 1}};
    node.setup(setup);
    CHECK(node.outputs().at(0)->name() == port);
    test::FakeWriter writer(*node.outputs()[0]);
    Job job(clock, 0, 0, 66'000'000, 0, "full");
    node.run(job);
    CHECK(PortAccess::sent(*node.outputs()[0]));
    CHECK_FALSE(job.without_result());
  }
  CHECK(sim::first_world(devices) != nullptr);
}

TEST_CASE("devices of one world file and seed share it; its first client may be named or not") {
  const test::TemporaryFolder folder;
  const std::string file =
      folder
          .write("two.xml",
                 "<world resolution=\"0.5m\"><rows>######## #......# #......# ########</rows>"
                 "<client name=\"ace\" x=\"1m\" y=\"1m\"/><client name=\"bea\" x=\"3m\" y=\"1m\"/></world>")
          .string();
  Devices devices;
  const auto world = [&](const char* client, uint64_t seed) {
    DeviceConfig wanted = config("mobile_base", "sim", {{"world", file}, {"client", client}});
    wanted.seed = seed;
    const auto made = sim::world_of(wanted, devices);
    REQUIRE_MESSAGE(made.has_value(), (made ? "" : made.error().text()));
    return *made;
  };
  CHECK(world("", 1) == world("ace", 1));
  CHECK(world("ace", 1) != world("bea", 1));
  CHECK(&world("ace", 1)->stage() == &world("bea", 1)->stage());
  CHECK(&world("ace", 1)->stage() != &world("ace", 2)->stage());
  CHECK(has(error(config("actor", "sim", {{"world", file}, {"client", "cid"}})), "ace, bea"));
  CHECK(has(error(config("actor", "sim", {{"world", file}})), "has no actions"));
}

TEST_CASE("settings of the object sensor") {
  const auto with = [](const char* name, const nlohmann::json& value) {
    nlohmann::json settings = kWorld;
    settings[name] = value;
    return error(config("object_sensor", "sim", settings));
  };
  CHECK(with("types", "cup, bottle") == "");
  CHECK(with("fov", "90deg") == "");
  CHECK(has(with("types", "jug"), "known types: table, shelf"));
  CHECK(has(with("miss", 2), "0..1"));
  CHECK(has(with("noise", "-1m"), "noise not negative"));
}

TEST_CASE("settings of the SICK drivers") {
  const auto with = [](const char* driver, nlohmann::json settings) {
    return error(config("laser_scanner", driver, std::move(settings)));
  };
  // Right settings, and no scanner.
  const auto absent = config("laser_scanner", "lms200",
                             {{"port", "/dev/none"},
                              {"fov", "100deg"},
                              {"resolution", "0.25deg"},
                              {"range", "32m"},
                              {"baud", 500000},
                              {"mount", {{"z", "0.25m"}}}});
  Devices devices;
  VirtualClock clock;
  const auto node = make_device(ace_registry().devices, absent, devices, clock);
  REQUIRE_FALSE(node);
  CHECK_FALSE(node.error().bad_input);
  CHECK(has(node.error().text(), "/dev/none: No such file"));
  CHECK(has(with("lms200", nlohmann::json::object()), "`port` is missing"));
  CHECK(has(with("lms200", {{"port", "/dev/none"}, {"baud", 57600}}), "`baud` is no rate"));
  CHECK(has(with("lms200", {{"port", "/dev/none"}, {"fov", "90deg"}}), "100deg or 180deg"));
  CHECK(has(with("lms200", {{"port", "/dev/none"}, {"resolution", "0.3deg"}}), "0.25deg"));
  CHECK(has(with("lms200", {{"port", "/dev/none"}, {"range", "10m"}}), "8m, 16m, 32m, or 80m"));
  CHECK(has(with("lms200", {{"port", "/dev/none"}, {"resolution", "0.25deg"}}), "too fast for `baud`"));
  CHECK(has(with("lms400", nlohmann::json::object()), "`address` or `port`"));
  CHECK(has(with("lms400", {{"port", "/dev/none"}, {"address", "127.0.0.1:1"}}), "`address` or `port`"));
  CHECK(has(with("lms400", {{"port", "/dev/none"}}), "/dev/none: No such file"));
  CHECK(has(with("lms400", {{"address", "laser"}}), "`laser` is no address"));
  CHECK(has(with("lms400", {{"address", "127.0.0.1:1"}, {"scan_rate", 100}}), "200..500Hz"));
  CHECK(has(with("lms400", {{"address", "127.0.0.1:1"}, {"fov", "90deg"}}), "out of range"));
}

TEST_CASE("settings of a semantic service and of its link") {
  const test::TemporaryFolder folder;
  const auto with = [](const char* kind, const char* driver, nlohmann::json settings, const char* robot = "ace") {
    settings["robot"] = robot;
    return error(config(kind, driver, std::move(settings)));
  };
  for (const char* kind : {"semantic_service", "semantic_link"}) {
    CHECK(with(kind, "udp", {{"address", "127.0.0.1:47113"}}) == "");
    CHECK(has(with(kind, "udp", {}, ""), "`robot` is ``"));
    CHECK(has(with(kind, "udp", {}, "a_name_of_more_than_thirty_one_characters"), "1 to 31"));
    CHECK(has(with(kind, "udp", {{"address", "localhost:4700"}}), "`address` is `localhost:4700`"));
    CHECK(has(with(kind, "udp", {{"address", "127.0.0.1"}}), "such as 127.0.0.1:4700"));
    CHECK(has(with(kind, "udp", {{"address", "0.0.0.0:47113"}}), "there is no `key`"));
    const auto key = folder.write("key", "0123456789abcdef0123456789abcde").string();
    CHECK(has(with(kind, "udp", {{"key", key}}), "32 hexadecimal digits"));
    CHECK(has(with(kind, "dbus", {{"service", "semantic"}}), "words with dots between"));
    CHECK(has(with(kind, "dbus", {{"bus", "none"}}), "session, system or an address"));
    CHECK(has(with(kind, "dbus", {{"bus", "unix:path=/nowhere/bus"}}), "use driver: udp"));
    CHECK(has(with(kind, "udp", {{"bus", "session"}}), "unknown setting `bus`"));
  }
  CHECK(has(with("semantic_service", "udp", {{"watchdog", "0s"}}), "`watchdog`"));
  CHECK(has(with("semantic_link", "udp", {{"lag", "61s"}}), "`lag`"));
  Devices devices;
  VirtualClock clock;
  const auto service = [&](const char* robot) {
    return make_device(ace_registry().devices,
                       config("semantic_service", "udp", {{"address", "127.0.0.1:47113"}, {"robot", robot}}), devices,
                       clock);
  };
  const auto ace = service("ace"), again = service("ace"), eve = service("eve");
  CHECK(ace.has_value());
  CHECK(eve.has_value());  // another robot of the same server
  REQUIRE_FALSE(again.has_value());
  CHECK(has(again.error().text(), "`robot` ace is served at 127.0.0.1:47113 already"));
}
