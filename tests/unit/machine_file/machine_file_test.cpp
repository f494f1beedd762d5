// SPDX-License-Identifier: Apache-2.0
#include "graph/machine_file/machine_file.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>

#include "graph/language/document.hpp"
#include "graph/language/schema.hpp"
#include "graph/machine_file/settings.hpp"
#include "rt/machine/parse.hpp"

using namespace takt::graph;
namespace fs = std::filesystem;

namespace {

/// A machine file in a folder of its own, which goes with it.
class WrittenMachine {
 public:
  explicit WrittenMachine(const std::string& text) {
    std::string name = (fs::temp_directory_path() / "takt-machine-XXXXXX").string();
    REQUIRE(mkdtemp(name.data()) != nullptr);
    folder_ = name;
    add("machine.yaml", "takt: 1\nmachine: robot\n" + text);
  }
  ~WrittenMachine() { fs::remove_all(folder_); }
  WrittenMachine(const WrittenMachine&) = delete;

  void add(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  LoadedMachine load() const { return load_machine(folder_ / "machine.yaml"); }

 private:
  fs::path folder_;
};

std::string all(const LoadedMachine& loaded) {
  std::string text;
  for (const Problem& problem : loaded.problems) text += to_string(problem) + "\n";
  return text;
}

MachineFile sound(const std::string& text) {
  LoadedMachine loaded = WrittenMachine(text).load();
  INFO(all(loaded));
  REQUIRE(loaded.machine);
  return *loaded.machine;
}

/// One problem, on `line` of what stands below the first two.
void wrong(const std::string& text, int line, const std::string& words) {
  const LoadedMachine loaded = WrittenMachine(text).load();
  INFO(all(loaded));
  CHECK(!loaded.machine);
  REQUIRE(loaded.problems.size() == 1);
  CHECK(loaded.problems[0].position.line == line + 2);
  CHECK(loaded.problems[0].text.find(words) != std::string::npos);
}

const SystemFile* find(const std::vector<SystemFile>& files, const std::string& path) {
  for (const SystemFile& file : files)
    if (file.path == path) return &file;
  return nullptr;
}

}  // namespace

TEST_CASE("a file that says nothing sets nothing") {
  const MachineFile machine = sound("");
  CHECK(machine.name == "robot");
  CHECK(system_files(machine).empty());
  CHECK(kernel_arguments(machine).empty());
}

TEST_CASE("isolated CPUs keep interrupts, kernel work and other services away, and stay in the service's mask") {
  const MachineFile machine = sound("cores: {count: 6, isolate: [5, 2, 3]}\n");
  CHECK(machine.isolated == std::vector<int>{2, 3, 5});
  CHECK(common_cpus(machine) == std::vector<int>{0, 1, 4});
  CHECK(kernel_arguments(machine) ==
        std::vector<std::string>{"nohz_full=2-3,5", "rcu_nocbs=2-3,5", "irqaffinity=0-1,4"});
  const auto files = system_files(machine);
  const SystemFile* const manager = find(files, "/etc/systemd/system.conf.d/61-takt-machine.conf");
  REQUIRE(manager);
  CHECK(manager->content.find("CPUAffinity=0-1,4\n") != std::string::npos);
  const SystemFile* const service = find(files, "/etc/systemd/system/takt@.service.d/61-takt-machine.conf");
  REQUIRE(service);
  CHECK(service->content.find("CPUAffinity=0-5\n") != std::string::npos);
}

TEST_CASE("the service waits for devices that have names, and takes the machine's options") {
  const auto text = [](const std::string& keys) {
    const auto files = system_files(sound(keys));
    const SystemFile* const file = find(files, "/etc/systemd/system/takt@.service.d/61-takt-machine.conf");
    return file != nullptr ? file->content.substr(file->content.find('[')) : "";
  };
  CHECK(text("devices:\n  laser: {subsystem: tty, serial: A7}\n") ==
        "[Unit]\nWants=dev-takt-laser.device\nAfter=dev-takt-laser.device\n");
  CHECK(text("service: {options: [--policy, fifo], watchdog: false}\n") ==
        "[Service]\nEnvironment=\"TAKT_OPTIONS=--policy fifo\"\nWatchdogSec=0\n");
  CHECK(text("service: {options: []}\n") == "[Service]\nEnvironment=\"TAKT_OPTIONS=\"\n");
  CHECK(text("service: {}\n") == "");
}

TEST_CASE("each key becomes what Debian reads") {
  const MachineFile machine = sound(
      "cores: {count: 4, interrupts: [1]}\ngovernor: performance\ndeepest_idle: 1\nmitigations: false\n"
      "kernel_arguments: [usbcore.autosuspend=-1]\nwatchdog: 1min\ntime_zone: Europe/Berlin\ntime_servers: [a.b, c]\n"
      "network:\n  can0: {bitrate: 500000}\n  lan: {address: 10.0.0.2/24, gateway: 10.0.0.1}\n  wan: {dhcp: true}\n"
      "devices:\n  laser: {subsystem: tty, serial: A7, low_latency: true}\n  camera: {subsystem: video4linux, path: "
      "p-1}\n"
      "packages: [firmware-realtek]\n");
  CHECK(kernel_arguments(machine) == std::vector<std::string>{"irqaffinity=1", "processor.max_cstate=1",
                                                              "intel_idle.max_cstate=1", "takt.watchdog",
                                                              "mitigations=off", "usbcore.autosuspend=-1"});
  CHECK(machine.packages == std::vector<std::string>{"firmware-realtek"});
  const auto files = system_files(machine);
  CHECK(std::is_sorted(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.path < b.path; }));
  const auto says = [&](const std::string& path, const std::string& words) {
    INFO(path << ": " << words);
    const SystemFile* const file = find(files, path);
    REQUIRE(file);
    CHECK(file->content.find(words) != std::string::npos);
  };
  says("/etc/systemd/network/61-takt-can0.network", "[CAN]\nBitRate=500000\n");
  says("/etc/systemd/network/61-takt-lan.network", "Address=10.0.0.2/24\nGateway=10.0.0.1\n");
  says("/etc/systemd/network/61-takt-wan.network", "DHCP=yes\n");
  says("/etc/systemd/timesyncd.conf.d/61-takt-machine.conf", "NTP=a.b c\n");
  says("/etc/systemd/system.conf.d/61-takt-machine.conf", "RuntimeWatchdogSec=60s\n");
  says("/etc/tmpfiles.d/61-takt-machine.conf", "scaling_governor - - - - performance\n");
  says("/etc/udev/rules.d/61-takt-machine.rules",
       "SUBSYSTEM==\"tty\", ENV{ID_SERIAL_SHORT}==\"A7\", SYMLINK+=\"takt/laser\"");
  says("/etc/udev/rules.d/61-takt-machine.rules", "latency_timer");
  says("/etc/udev/rules.d/61-takt-machine.rules", "ENV{ID_PATH}==\"p-1\", SYMLINK+=\"takt/camera\"");
  const SystemFile* const zone = find(files, "/etc/localtime");
  REQUIRE(zone);
  CHECK(zone->link == "/usr/share/zoneinfo/Europe/Berlin");
  CHECK(grub_file(machine).content.find("mitigations=off usbcore.autosuspend=-1\"") != std::string::npos);
}

TEST_CASE("what cannot be is reported at its place, with what can") {
  wrong("coers: {count: 2}\n", 1, "did you mean `cores`");
  wrong("cores: {isolate: [1]}\n", 1, "lacks `count`");
  wrong("cores: {count: 2, isolate: [2]}\n", 1, "there is no CPU 2: `count` is 2, so CPUs are 0 to 1");
  wrong("cores: {count: 2, isolate: [0]}\n", 1, "CPU 0 cannot be isolated");
  wrong("cores: {count: 2, isolate: [1], interrupts: [1]}\n", 1, "CPU 1 is isolated and takes interrupts");
  wrong("governor: fast\n", 1, "performance");
  wrong("watchdog: 5s\n", 1, "10s to 10min");
  wrong("watchdog: 20\n", 1, "a time with its unit");
  wrong("watchdog: 20 parsecs\n", 1, "watchdog");
  wrong("network:\n  can0: {}\n", 2, "has none of `address`, `dhcp: true`, `bitrate`");
  wrong("network:\n  eth0: {dhcp: true, bitrate: 50000}\n", 2, "has several of");
  wrong("network:\n  eth0: {dhcp: true, gateway: 10.0.0.1}\n", 2, "belongs to an `address`");
  wrong("network:\n  much_too_long_a_name: {dhcp: true}\n", 2, "at most 15");
  wrong("devices:\n  laser: {subsystem: tty}\n", 2, "say `serial`, `path` or `name`");
  wrong("devices:\n  laser: {subsystem: tty, serial: 'a\"b'}\n", 2, "its serial number");
  wrong("time_zone: ../../etc/passwd\n", 1, "zone database");
  wrong("kernel_arguments: ['a b']\n", 1, "without blanks");
  wrong("updates: {keys: [none.pem]}\n", 1, "none.pem");
}

TEST_CASE("keys are files that can be read, and no private ones") {
  const WrittenMachine machine("updates:\n  keys: [update.pem]\nssh: {keys: [me.pub]}\n");
  machine.add("update.pem", "-----BEGIN CERTIFICATE-----\nMII\n");
  machine.add("me.pub", "ssh-ed25519 AAAA me\n");
  const LoadedMachine loaded = machine.load();
  INFO(all(loaded));
  REQUIRE(loaded.machine);
  CHECK(loaded.machine->update_keys.at(0).filename() == "update.pem");
  CHECK(loaded.machine->ssh_keys.at(0).filename() == "me.pub");
  machine.add("update.pem", "-----BEGIN PRIVATE KEY-----\nMII\n");
  machine.add("me.pub", "-----BEGIN OPENSSH PRIVATE KEY-----\n");
  const LoadedMachine refused = machine.load();
  REQUIRE(refused.problems.size() == 2);
  for (const Problem& problem : refused.problems)
    CHECK(problem.text.find("is a private key, which stays with its owner") != std::string::npos);
}

TEST_CASE("the machine files that are shipped are sound") {
  size_t files = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(TAKT_SOURCE_DIR) / "packaging/machines")) {
    if (entry.path().extension() != ".yaml") continue;
    const LoadedMachine loaded = load_machine(entry.path());
    INFO(all(loaded));
    CHECK(loaded.machine);
    ++files;
  }
  CHECK(files >= 2);
}
