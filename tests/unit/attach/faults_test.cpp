// SPDX-License-Identifier: Apache-2.0
// `takt fault` over the socket: what is listed, refused and posted.
#include <doctest/doctest.h>
#include <sched.h>
#include <unistd.h>

#include <cstdlib>

#include "graph/ace/ace_registry.hpp"
#include "graph/attach/endpoint.hpp"
#include "graph/attach/server.hpp"
#include "hal/device_node.hpp"
#include "hal/settings/failures.hpp"
#include "rt/sched/param_mail.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

namespace {

using namespace takt;
using test::has;
using Json = nlohmann::ordered_json;

class Lamp final : public Device {
 public:
  DeviceResult open() override { return {}; }
  void close() override {}
  DeviceResult start(int64_t) override { return {}; }
  void stop() override {}
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  FaultSwitch* faults() override { return &failures_.by_hand(); }

 private:
  FailureSchedule failures_{{}};
};

class LampNode final : public DeviceNode {
 public:
  Device& device() override { return lamp_; }
  void setup(Setup&) override {}
  void run(Job&) override {}

 private:
  Lamp lamp_;
};

/// A run with a simulated lamp and a real one.
struct Lamps {
  test::TemporaryFolder folder{"/tmp"};
  Registry registry = ace_registry();
  LampNode simulated, real;
  graph::GraphSpec spec;
  Plan plan;
  std::unique_ptr<RunBoard> board;
  std::unique_ptr<Transport> transport = make_local_transport(plan.ports);
  std::unique_ptr<attach::Server> server;

  Lamps() {
    setenv("XDG_RUNTIME_DIR", folder.path.c_str(), 1);
    add("lamp", "sim", simulated, simulated.known_faults());
    add("beacon", "serial", real, 0);
    board = std::make_unique<RunBoard>(plan);
    server = std::make_unique<attach::Server>(attach::Subject{registry, spec, plan, *board, *transport});
  }
  void add(const char* id, const char* driver, DeviceNode& node, uint32_t faults) {
    graph::DeviceSpec device;
    device.id = id, device.driver = driver;
    spec.devices.push_back(device);
    TaskPlan task;
    task.name = id, task.node = &node, task.device = true, task.source.faults = faults;
    plan.tasks.push_back(task);
    node.end_setup();
  }
  /// `job`: the node takes what is posted meanwhile, as between two of its jobs.
  Json ask(const Json& question, bool job = false) {
    auto connection = attach::connect_to(getpid());
    REQUIRE(connection);
    REQUIRE(connection->write(question));
    if (ParamMail& mail = board->mail(0); job) {
      while (mail.state.load() != ParamMail::posted) sched_yield();
      REQUIRE(deliver(mail, simulated));
      keep(board->kept(0, mail.param), mail, 0);
      mail.state.store(ParamMail::taken);
    }
    return connection->read_line().value_or(Json());
  }
  std::string error(const char* device, const char* fault) {
    return ask({{"do", "fault"}, {"device", device}, {"fault", fault}, {"on", true}}).value("error", "");
  }
  std::string on() { return ask({{"do", "fault"}})["devices"][0]["on"]; }
};

}  // namespace

TEST_CASE("the faults of a run: of its simulated devices, with what is switched on") {
  Lamps scene;
  const Json all = scene.ask({{"do", "fault"}})["devices"];
  REQUIRE(all.size() == 1);
  CHECK(all[0] == Json{{"device", "lamp"}, {"on", "none"}, {"faults", {"silent", "unplugged", "garbage", "frozen"}}});
  CHECK(scene.ask({{"do", "fault"}, {"device", "lamp"}})["devices"] == all);
}

TEST_CASE("one fault at a time is switched on; only that one is switched off") {
  Lamps scene;
  const auto change = [&](const char* fault, bool on, bool job) {
    return scene.ask({{"do", "fault"}, {"device", "lamp"}, {"fault", fault}, {"on", on}}, job);
  };
  CHECK(change("silent", true, true) == Json{{"ok", true}});
  CHECK(scene.on() == "silent");
  CHECK(scene.simulated.faults()->on() == Misbehaviour::silent);
  CHECK(change("frozen", true, true) == Json{{"ok", true}});
  CHECK(scene.on() == "frozen");
  CHECK(change("silent", false, false) == Json{{"ok", true}});
  CHECK(scene.on() == "frozen");
  CHECK(change("frozen", false, true) == Json{{"ok", true}});
  CHECK(scene.on() == "none");
  CHECK(scene.simulated.faults()->on() == Misbehaviour::none);
  const Json told = scene.ask({{"do", "get"}, {"param", "lamp.fault"}})["parameters"][0];
  CHECK(told["value"] == "none");
  CHECK(told["from"] == "set");
  CHECK(scene.ask({{"do", "get"}, {"param", "beacon.fault"}})["parameters"][0]["from"] == "default");
}

TEST_CASE("what cannot be switched is refused with the valid choices, and nothing is posted") {
  Lamps scene;
  CHECK(has(scene.error("lamps", "silent"), "there is no device `lamps`; did you mean `lamp`?"));
  CHECK(has(scene.error("lamp", "slient"), "device lamp has no fault `slient`; did you mean `silent`?"));
  CHECK(has(scene.error("lamp", "none"), "frozen, garbage, silent, unplugged"));
  for (const std::string& refused :
       {scene.error("beacon", "silent"), scene.ask({{"do", "fault"}, {"device", "beacon"}}).value("error", "")}) {
    CHECK(has(refused, "device beacon (driver serial) has no faults"));
    CHECK(has(refused, "lamp"));
  }
  CHECK(scene.board->mail(0).state.load() == ParamMail::empty);
}
