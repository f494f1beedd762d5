// SPDX-License-Identifier: Apache-2.0
// In the guest of tests/hil/run: a graph of the robot on the kernel's drivers, as processes, with devices that are
// pulled and put back while it runs.
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
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
  Takt run({"run", TAKT_SOURCE_DIR "/tests/hil/robot.yaml", "--for", "45s", "--output", "/tmp/rig", "--report",
            "/tmp/rig.json"});
  const auto runs = [] { return std::system("\"$HIL_TAKT\" top --once > /dev/null 2>&1") == 0; };
  for (int tries = 0; tries < 60 && !runs(); ++tries) sleep_for(500 * kMs);
  sleep_for(6 * kSecond);  // the scanner needs some to begin
  eyes.reset();
  sleep_for(2 * kSecond);
  shell("echo 1 > $(readlink -f /sys/class/net/can0/device)/remove");
  sleep_for(3 * kSecond);
  eyes = std::make_unique<Takt>(camera);
  shell("echo 1 > /sys/bus/pci/rescan && " TAKT_SOURCE_DIR "/tests/hil/can_up can0");
  sleep_for(4 * kSecond);
  plug_adapter(false);
  sleep_for(3 * kSecond);
  plug_adapter(true);
  const std::string output = run.output();
  INFO(output);
  const int code = run.wait();
  CHECK((code == 0 || code == 1));  // 1: a deadline was missed, which says nothing of an emulated machine

  const Json report = Json::parse(std::ifstream("/tmp/rig.json"), nullptr, false);
  REQUIRE(report.is_object());
  for (const char* name : {"head", "base", "front_laser", "head_camera", "lines"}) {
    const Json device = named(report.at("devices"), name);
    INFO(device.dump());
    CHECK(device.at("state") == "ok");
    CHECK((device.at("losses") > 0) == (name != std::string("lines")));  // the scanner takes its time at the start, too
  }
  for (const char* name : {"obstacle_stop", "scan_matching", "robot_pose", "stereo", "ego_motion"}) {
    const Json node = named(report.at("nodes"), name);
    INFO(node.at("released").dump(), " released, ", node.at("completed").dump(), " completed");
    CHECK(node.at("completed").get<int>() > node.at("released").get<int>() / 2);
    CHECK(node.at("new_inputs").get<int>() > 0);
  }
}
