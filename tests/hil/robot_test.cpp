// SPDX-License-Identifier: Apache-2.0
// In the guest of tests/hil/run: a graph of the robot on the kernel's drivers, as processes, with devices that are
// pulled and put back while it runs.
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
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
  /// Whether there is something to read from it: what it has said, or that it has ended.
  bool has_said() const {
    pollfd said{said_[0], POLLIN, 0};
    return poll(&said, 1, 0) > 0;
  }
  /// The next of what it has said; empty once it has ended. Waits for it.
  std::string next() const {
    char part[4096];
    const ssize_t n = ::read(said_[0], part, sizeof part);
    return {part, static_cast<size_t>(std::max<ssize_t>(n, 0))};
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
  /// Asks it to end, as Ctrl-C does.
  void stop() const { kill(process_, SIGINT); }
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

/// The USB adapter, by the vendor of its chip.
void plug_adapter(bool in) {
  shell("for device in $(grep -l 0403 /sys/bus/usb/devices/*/idVendor); do echo " + std::to_string(in ? 1 : 0) +
        " > ${device%idVendor}authorized; done");
}

/// What `takt top` says of the running graph's devices. One process for all questions: its start alone costs an
/// emulated machine seconds, in which the graph does not get them.
class Devices {
 public:
  /// Comes true before long; an emulated machine takes its time.
  template <class Condition>
  bool until(Condition condition) {
    const int64_t end = takt::MonotonicClock().now_ns() + 60 * kSecond;
    do {
      sleep_for(kSecond);
      read();
      if (condition()) return true;
    } while (takt::MonotonicClock().now_ns() < end);
    for (const auto& [name, device] : devices_) MESSAGE(name, ": ", device.dump());
    return false;
  }
  bool well(const std::string& device) const {
    const auto found = devices_.find(device);
    return found != devices_.end() && found->second.at("state") == "ok" && found->second.at("received") > 0;
  }
  /// How often each was lost so far.
  std::map<std::string, int> losses() const {
    std::map<std::string, int> all;
    for (const auto& [name, device] : devices_) all[name] = device.at("losses").get<int>();
    return all;
  }

 private:
  void read() {
    if (!top_) top_ = std::make_unique<Takt>(std::vector<std::string>{"top", "--json"});
    while (top_ && top_->has_said()) {
      const std::string part = top_->next();
      if (part.empty()) top_.reset();  // there is no run yet
      for (const char c : part) {
        if (c != '\n') {
          line_ += c;
          continue;
        }
        take(Json::parse(std::exchange(line_, ""), nullptr, false));
      }
    }
  }
  void take(const Json& answer) {
    if (!answer.is_object()) return;
    for (const Json& node : answer.at("nodes"))
      if (node.contains("device")) devices_[node.at("name")] = node.at("device");
  }

  std::unique_ptr<Takt> top_;
  std::string line_;
  std::map<std::string, Json> devices_;  ///< by their names, as told last
};

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
  Takt run({"run", TAKT_SOURCE_DIR "/tests/hil/robot.yaml", "--for", "150s", "--output", "/tmp/rig", "--report",
            "/tmp/rig.json"});
  const std::vector<std::string> pulled{"head", "base", "front_laser", "head_camera"};
  Devices devices;
  const auto all_well = [&] {
    return std::all_of(pulled.begin(), pulled.end(), [&](const auto& name) { return devices.well(name); });
  };
  if (!devices.until(all_well)) {
    run.stop();
    FAIL(run.output());
  }
  const auto before = devices.losses();
  const auto lost = [&](const std::string& name) { return devices.losses()[name] == before.at(name) + 1; };
  eyes.reset();
  REQUIRE(devices.until([&] { return lost("head_camera"); }));
  shell("echo 1 > $(readlink -f /sys/class/net/can0/device)/remove");
  REQUIRE(devices.until([&] { return lost("head") && lost("base"); }));
  eyes = std::make_unique<Takt>(camera);
  shell("echo 1 > /sys/bus/pci/rescan && " TAKT_SOURCE_DIR "/tests/hil/can_up can0");
  REQUIRE(devices.until([&] { return devices.well("head") && devices.well("base") && devices.well("head_camera"); }));
  plug_adapter(false);
  REQUIRE(devices.until([&] { return lost("front_laser"); }));
  plug_adapter(true);
  REQUIRE(devices.until(all_well));
  auto expected = before;  // each was lost once, by what was done here, and by nothing else
  for (const std::string& device : pulled) ++expected[device];
  CHECK(devices.losses() == expected);
  sleep_for(kSecond);  // in the mode full again
  // Not by `takt stop`, whose start would keep the camera's double from its frames for seconds.
  run.stop();
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
