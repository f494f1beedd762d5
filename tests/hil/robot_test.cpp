// SPDX-License-Identifier: Apache-2.0
// In the guest of tests/hil/run: a graph of the robot on the kernel's drivers, as processes, with devices that are
// pulled and put back while it runs.
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/hil/guest.hpp"

using namespace takt::test;
using Json = nlohmann::json;

namespace {

/// The command takt, as a user types it. Ends with the object.
class Takt {
 public:
  explicit Takt(std::vector<std::string> arguments) {
    REQUIRE(pipe2(said_, O_CLOEXEC) == 0);
    const char* program = std::getenv("HIL_TAKT");
    REQUIRE_MESSAGE(program != nullptr, "HIL_TAKT names the command takt");
    arguments.insert(arguments.begin(), program);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
      posix_spawn_file_actions_adddup2(&actions, said_[1], stream);
    REQUIRE(posix_spawn(&process_, program, &actions, nullptr, argv.data(), environ) == 0);
    posix_spawn_file_actions_destroy(&actions);
    ::close(std::exchange(said_[1], -1));
  }
  Takt(const Takt&) = delete;
  Takt& operator=(const Takt&) = delete;
  ~Takt() {
    if (process_ > 0) {
      kill(process_, SIGTERM);
      wait();
    }
    ::close(said_[0]);
  }
  /// Of a double: returns once it has said where it is to be found.
  void wait_for_place() const {
    std::string line;
    for (char c = ' '; c != '\n' && ::read(said_[0], &c, 1) == 1;) line += c;
    REQUIRE_MESSAGE(line.find(" at ") != std::string::npos, line);
  }
  /// What it has said, until it ends.
  std::string output() const {
    std::string all(1 << 16, ' ');
    size_t size = 0;
    for (ssize_t n; size < all.size() && (n = ::read(said_[0], &all[size], all.size() - size)) > 0;)
      size += static_cast<size_t>(n);
    all.resize(size);
    return all;
  }
  /// Its exit code once it ends, -1 if by a signal.
  int wait() {
    int status = 0;
    waitpid(std::exchange(process_, 0), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t process_ = 0;
  int said_[2] = {-1, -1};
};

constexpr int64_t kSecond = 1000 * kMs;

/// The USB adapter, by the vendor of its chip.
void plug_adapter(bool in) {
  shell("for device in $(grep -l 0403 /sys/bus/usb/devices/*/idVendor); do echo " + std::to_string(in ? 1 : 0) +
        " > ${device%idVendor}authorized; done");
}

/// What `takt top` says of the running graph's devices, by their names; empty while there is no such run.
std::map<std::string, Json> devices() {
  std::string said;
  FILE* top = popen("\"$HIL_TAKT\" top --once --json 2> /dev/null", "re");
  REQUIRE(top != nullptr);
  for (int c; (c = std::fgetc(top)) != EOF;) said += static_cast<char>(c);
  pclose(top);
  std::map<std::string, Json> found;
  const Json answer = Json::parse(said, nullptr, false);
  if (!answer.is_object()) return found;
  for (const Json& node : answer.at("nodes"))
    if (node.contains("device")) found[node.at("name")] = node.at("device");
  return found;
}

/// How often each device was lost so far.
std::map<std::string, int> losses() {
  std::map<std::string, int> all;
  for (const auto& [name, device] : devices()) all[name] = device.at("losses").get<int>();
  return all;
}

bool well(const std::string& device) {
  const auto all = devices();
  const auto found = all.find(device);
  return found != all.end() && found->second.at("state") == "ok" && found->second.at("received") > 0;
}

/// Whether that comes true; an emulated machine takes its time.
template <class Condition>
bool until(Condition condition) {
  for (int tries = 0; tries < 60; ++tries) {
    if (condition()) return true;
    sleep_for(500 * kMs);
  }
  return false;
}

Json named(const Json& list, const std::string& name) {
  for (const Json& entry : list)
    if (entry.at("name") == name) return entry;
  FAIL("the report has no " << name);
  return {};
}

}  // namespace

TEST_CASE("hil: takt run on all devices, three of them pulled and put back") {
  const char* lines = std::getenv("HIL_GPIO_LINES");
  REQUIRE(lines != nullptr);
  std::ofstream(lines + std::string("/sim_gpio1/pull")) << "pull-up" << std::flush;  // no emergency stop is pressed
  const std::vector<std::string> camera{"double", "camera", "--video", "/dev/video0",
                                        "--rate", "2",      "--rig",   TAKT_SOURCE_DIR "/tests/hil/robot_camera.yaml"};
  const Takt head({"double", "head", "--can", "can1"}), base({"double", "base", "--can", "can1"});
  auto eyes = std::make_unique<Takt>(camera);
  for (const Takt* device : std::initializer_list<const Takt*>{&head, &base, eyes.get()}) device->wait_for_place();
  Takt run({"run", TAKT_SOURCE_DIR "/tests/hil/robot.yaml", "--for", "120s", "--output", "/tmp/rig", "--report",
            "/tmp/rig.json"});
  const std::vector<std::string> pulled{"head", "base", "front_laser", "head_camera"};
  REQUIRE(until([&] { return std::all_of(pulled.begin(), pulled.end(), well); }));
  const auto before = losses();
  eyes.reset();
  CHECK(until([&] { return losses()["head_camera"] == before.at("head_camera") + 1; }));
  shell("echo 1 > $(readlink -f /sys/class/net/can0/device)/remove");
  CHECK(until([&] {
    auto now = losses();
    return now["head"] == before.at("head") + 1 && now["base"] == before.at("base") + 1;
  }));
  eyes = std::make_unique<Takt>(camera);
  shell("echo 1 > /sys/bus/pci/rescan && " TAKT_SOURCE_DIR "/tests/hil/can_up can0");
  CHECK(until([&] { return well("head") && well("base") && well("head_camera"); }));
  plug_adapter(false);
  CHECK(until([&] { return losses()["front_laser"] == before.at("front_laser") + 1; }));
  plug_adapter(true);
  CHECK(until([&] { return std::all_of(pulled.begin(), pulled.end(), well); }));
  auto expected = before;  // each was lost once, by what was done here, and by nothing else
  for (const std::string& device : pulled) ++expected[device];
  CHECK(losses() == expected);
  sleep_for(kSecond);  // in the mode full again
  shell("\"$HIL_TAKT\" stop > /dev/null");
  const std::string output = run.output();
  INFO(output);
  const int code = run.wait();

  const Json report = Json::parse(std::ifstream("/tmp/rig.json"), nullptr, false);
  REQUIRE(report.is_object());
  for (const auto& [name, count] : expected) {
    const Json device = named(report.at("devices"), name);
    INFO(device.dump());
    CHECK(device.at("state") == "ok");
    CHECK(device.at("losses") == count);
  }
  // Without the camera no_stereo, without the base or the scanner safe_stop, and full once all are there.
  std::vector<std::string> modes;
  for (const Json& mode : report.at("modes")) modes.push_back(mode.at("name"));
  INFO(report.at("modes").dump());
  auto at = modes.begin();
  for (const char* wanted : {"full", "no_stereo", "safe_stop", "full", "safe_stop", "full"}) {
    at = std::find(at, modes.end(), wanted);
    REQUIRE_MESSAGE(at != modes.end(), wanted);
  }
  CHECK(modes.back() == "full");
  // An emulated machine may be late; nothing else may make the run fail.
  bool in_time = true;
  for (const Json& node : report.at("nodes")) {
    in_time = in_time && (node.at("criticality") != "high" || node.at("deadline_misses") == 0) &&
              (node.at("rate_hz").is_null() || node.at("completed").get<int>() + 1 >= node.at("released").get<int>());
  }
  CHECK(code == (in_time ? 0 : 1));
  for (const char* name : {"obstacle_stop", "scan_matching", "robot_pose", "stereo", "ego_motion"}) {
    const Json node = named(report.at("nodes"), name);
    INFO(node.at("released").dump(), " released, ", node.at("completed").dump(), " completed");
    CHECK(node.at("completed").get<int>() > node.at("released").get<int>() / 2);
    CHECK(node.at("new_inputs").get<int>() > 0);
  }
}
