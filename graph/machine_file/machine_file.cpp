// SPDX-License-Identifier: Apache-2.0
#include "graph/machine_file/machine_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <tuple>

#include "graph/language/document.hpp"
#include "graph/language/quantity.hpp"
#include "graph/language/schema.hpp"
#include "graph/language/words.hpp"
#include "rt/file/input_file.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

constexpr int64_t kShortestWatchdog_ns = 10'000'000'000, kLongestWatchdog_ns = 600'000'000'000;

/// Reads one file; each stage appends to the problems and goes on with what is sound. What is missing, of another type
/// or out of range was reported by the schema, and is passed over.
class MachineReader {
 public:
  LoadedMachine read(const std::filesystem::path& file) {
    machine_.file = file;
    document_ = read_document(file, {"machine", 0, 0}, problems_);
    if (!document_.root.is_null()) validate(document_, Schema::machine, problems_);
    if (document_.root.is_object()) read_root();
    const auto key = [](const Problem& p) { return std::tuple(p.position.line, p.position.column, p.text); };
    std::sort(problems_.begin(), problems_.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
    LoadedMachine loaded;
    if (problems_.empty()) loaded.machine = std::move(machine_);
    loaded.problems = std::move(problems_);
    return loaded;
  }

 private:
  void read_root() {
    const json& root = document_.root;
    machine_.name = text(root, "machine");
    machine_.governor = text(root, "governor");
    machine_.time_zone = text(root, "time_zone");
    if (const json idle = root.value("deepest_idle", json()); idle.is_number_integer())
      machine_.deepest_idle = idle.get<int>();
    machine_.mitigations = flag(root, "mitigations", true);
    machine_.kernel_arguments = words(root, "kernel_arguments");
    machine_.time_servers = words(root, "time_servers");
    machine_.packages = words(root, "packages");
    read_watchdog();
    read_cores(map(root, "cores"));
    const json network = map(root, "network"), devices = map(root, "devices");
    for (const auto& [name, value] : network.items()) read_interface(name, value);
    for (const auto& [name, value] : devices.items()) read_device(name, value);
    const json service = map(root, "service");
    if (service.contains("options")) machine_.options = words(service, "options");
    machine_.service_watchdog = flag(service, "watchdog", true);
    machine_.update_keys = keys("updates", "-----BEGIN CERTIFICATE-----", "a certificate (PEM)");
    machine_.ssh_keys = keys("ssh", "", "public keys");
  }

  void read_watchdog() {
    const std::string written = text(document_.root, "watchdog");
    if (written.empty()) return;
    const auto time = parse_duration_ns(written);
    const Position at = document_.value_at("/watchdog");
    if (!time) problem(at, "`watchdog` " + time.error());
    else if (*time < kShortestWatchdog_ns || *time > kLongestWatchdog_ns)
      problem(at, fmt::format("`watchdog` is {}; wanted: 10s to 10min, since a machine that starts takes its time",
                              ticked(written)));
    else machine_.watchdog_s = *time / 1'000'000'000;
  }

  void read_cores(const json& cores) {
    if (const json count = cores.value("count", json()); count.is_number_integer()) machine_.cores = count.get<int>();
    machine_.isolated = cpus(cores, "isolate");
    machine_.interrupts = cpus(cores, "interrupts");
    for (size_t i = 0; i < machine_.isolated.size(); ++i)
      if (machine_.isolated[i] == 0)
        problem(document_.value_at("/cores/isolate"),
                "CPU 0 cannot be isolated: the kernel keeps the time on it. Valid are 1 and above");
    for (const int cpu : machine_.interrupts)
      if (std::binary_search(machine_.isolated.begin(), machine_.isolated.end(), cpu))
        problem(document_.value_at("/cores/interrupts"),
                fmt::format("CPU {} is isolated and takes interrupts; name it once", cpu));
  }

  /// Ascending, of those that there are.
  std::vector<int> cpus(const json& cores, const char* key) {
    std::vector<int> found;
    const json list = cores.value(key, json::array());
    for (size_t i = 0; list.is_array() && i < list.size(); ++i) {
      if (!list[i].is_number_integer()) continue;
      const int cpu = list[i].get<int>();
      if (machine_.cores > 0 && cpu >= machine_.cores)
        problem(document_.value_at(child(child("/cores", key), i)),
                fmt::format("there is no CPU {}: `count` is {}, so CPUs are 0 to {}", cpu, machine_.cores,
                            machine_.cores - 1));
      else found.push_back(cpu);
    }
    std::sort(found.begin(), found.end());
    return found;
  }

  void read_interface(const std::string& name, const json& value) {
    if (!value.is_object()) return;
    MachineFile::Interface interface {
      name, text(value, "address"), text(value, "gateway"), flag(value, "dhcp", false)
    };
    if (const json rate = value.value("bitrate", json()); rate.is_number_integer()) interface.bitrate = rate.get<int>();
    const int ways = !interface.address.empty() + interface.dhcp + (interface.bitrate > 0);
    const std::string pointer = child("/network", name);
    if (ways != 1)
      problem(document_.key_at(pointer),
              fmt::format("interface {} has {} of `address`, `dhcp: true`, `bitrate`; wanted: exactly one",
                          ticked(name), ways == 0 ? "none" : "several"));
    if (!interface.gateway.empty() && interface.address.empty())
      problem(document_.key_at(child(pointer, "gateway")),
              fmt::format("`gateway` of interface {} belongs to an `address`", ticked(name)));
    machine_.network.push_back(std::move(interface));
  }

  void read_device(const std::string& name, const json& value) {
    if (!value.is_object()) return;
    MachineFile::Device device{name,
                               text(value, "subsystem"),
                               text(value, "serial"),
                               text(value, "path"),
                               text(value, "name"),
                               flag(value, "low_latency", false)};
    if (device.serial.empty() && device.path.empty() && device.kernel_name.empty())
      problem(document_.key_at(child("/devices", name)),
              fmt::format("device {} could be any of its kind; say `serial`, `path` or `name`", ticked(name)));
    machine_.devices.push_back(std::move(device));
  }

  std::vector<std::filesystem::path> keys(const char* section, const char* begins, const char* what) {
    std::vector<std::filesystem::path> files;
    const std::vector<std::string> names = words(map(document_.root, section), "keys");
    for (size_t i = 0; i < names.size(); ++i) {
      const std::filesystem::path file = machine_.file.parent_path() / names[i];
      const Position at = document_.value_at(child(child("/", section).substr(1) + "/keys", i));
      std::string why = why_unreadable(file, kLargestText);
      if (why.empty()) {
        std::ifstream in(file);
        std::string line;
        while (line.empty() && std::getline(in, line)) {
        }
        if (!line.starts_with(begins)) why = fmt::format("is no file of {}", what);
        if (line.find("PRIVATE KEY") != std::string::npos) why = "is a private key, which stays with its owner";
      }
      if (!why.empty()) problem(at, fmt::format("{} {}", file.string(), why));
      else files.push_back(file);
    }
    return files;
  }

  static json map(const json& value, const char* key) {
    const json found = value.is_object() ? value.value(key, json::object()) : json::object();
    return found.is_object() ? found : json::object();
  }
  static std::string text(const json& value, const char* key) {
    const json found = value.value(key, json());
    return found.is_string() ? found.get<std::string>() : "";
  }
  static bool flag(const json& value, const char* key, bool standard) {
    const json found = value.value(key, json());
    return found.is_boolean() ? found.get<bool>() : standard;
  }
  static std::vector<std::string> words(const json& value, const char* key) {
    std::vector<std::string> all;
    const json list = value.value(key, json::array());
    for (const json& word : list.is_array() ? list : json::array())
      if (word.is_string()) all.push_back(word.get<std::string>());
    return all;
  }
  void problem(const Position& at, std::string what) { problems_.push_back({at, std::move(what)}); }

  MachineFile machine_;
  Document document_;
  std::vector<Problem> problems_;
};

}  // namespace

LoadedMachine load_machine(const std::filesystem::path& file) { return MachineReader().read(file); }

std::vector<int> common_cpus(const MachineFile& machine) {
  std::vector<int> common;
  for (int cpu = 0; cpu < machine.cores; ++cpu)
    if (!std::binary_search(machine.isolated.begin(), machine.isolated.end(), cpu)) common.push_back(cpu);
  return common;
}

}  // namespace takt::graph
