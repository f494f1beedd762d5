// SPDX-License-Identifier: Apache-2.0
// What is set on the computer that a graph runs on: CPUs, idle states, network, names of devices, keys. One file for
// `takt machine` and for images ([docs/machine.md](../../docs/machine.md)).
//
//   const LoadedMachine loaded = load_machine("packaging/machines/vision_pc.yaml");
//   for (const Problem& problem : loaded.problems) fmt::print(stderr, "{}\n", to_string(problem));
//   if (loaded.machine) for (const std::string& word : kernel_arguments(*loaded.machine)) ...
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"

namespace takt::graph {

struct MachineFile {
  struct Interface {
    std::string name;
    std::string address, gateway;  ///< "" where there is none
    bool dhcp = false;
    int bitrate = 0;  ///< of a CAN bus; 0: none
  };
  struct Device {
    std::string name;                       ///< in /dev/takt
    std::string subsystem;                  ///< of the kernel
    std::string serial, path, kernel_name;  ///< what tells it from others; at least one is set
    bool low_latency = false;
  };

  std::string name;
  std::filesystem::path file;
  int cores = 0;                          ///< 0: not said
  std::vector<int> isolated, interrupts;  ///< ascending; interrupts: empty for all that are not isolated
  std::string governor;                   ///< "": the kernel's choice, as below
  std::optional<int> deepest_idle;        ///< C-state
  bool mitigations = true;
  std::vector<std::string> kernel_arguments;
  int64_t watchdog_s = 0;  ///< 0: none
  std::string time_zone;
  std::vector<std::string> time_servers;
  std::vector<Interface> network;
  std::vector<Device> devices;
  std::optional<std::vector<std::string>> options;  ///< of the service takt@NAME; none: its own
  bool service_watchdog = true;
  std::vector<std::filesystem::path> update_keys, ssh_keys;
  std::vector<std::string> packages;
};

struct LoadedMachine {
  std::optional<MachineFile> machine;  ///< present exactly if there is no problem
  std::vector<Problem> problems;       ///< all of them, in their order
};

/// Reads and checks: syntax, schema, CPUs that exist, files of keys that can be read. Any thread.
LoadedMachine load_machine(const std::filesystem::path& file);

/// CPUs that are not isolated, ascending; none if the file does not say how many there are.
std::vector<int> common_cpus(const MachineFile& machine);

}  // namespace takt::graph
