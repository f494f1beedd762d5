// SPDX-License-Identifier: Apache-2.0
// The way from a graph's device entry to a hardware node.
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "hal/device_node.hpp"
#include "hal/device_types.hpp"
#include "hal/settings/json.hpp"
#include "rt/time/clock.hpp"

namespace takt::sim {
class Simulation;
class Stage;
}  // namespace takt::sim

namespace takt::hal {

class OwnFolder;
class SemanticServers;

/// What a device needs to exist.
struct DeviceConfig {
  std::string id, kind, driver;
  nlohmann::json settings;          ///< one object; values with a unit as text ("0.24m") or as numbers in SI
  std::filesystem::path directory;  ///< relative paths in the settings start here
  uint64_t seed = 0;
  bool plugged =
      true;  ///< false: hardware need not be there. Its node knows sizes from settings and files, and never runs
};

/// What the devices of one process share: the simulated worlds, one per world file and seed, with one robot for each
/// client that a device names; the servers of semantic services. Must outlive the nodes. Composition thread only.
class Devices {
 public:
  Devices();
  ~Devices();
  tl::expected<sim::Simulation*, DeviceError> world(const DeviceConfig& config);
  /// The simulation of the first client of the sim devices (for ground truth, fault injection), or null.
  sim::Simulation* first_world();
  SemanticServers& semantic_servers() { return *servers_; }
  /// A folder of this process for the lines of doubles, made when it is first asked for; empty if that failed.
  const std::filesystem::path& folder();

 private:
  std::map<std::string, std::shared_ptr<sim::Stage>> stages_;                          ///< by file and seed
  std::map<std::pair<std::string, size_t>, std::unique_ptr<sim::Simulation>> robots_;  ///< by that and client
  std::unique_ptr<SemanticServers> servers_;
  std::unique_ptr<OwnFolder> folder_;
};

/// The node of a device kind without a device: ports to look at and to connect, never set up or run. Throws
/// std::logic_error for a kind that has none.
std::unique_ptr<DeviceNode> make_shell(std::string_view kind);

/// Makes the node of a device and opens the device (hardware only if it is `plugged`): everything that can be wrong
/// with files and settings is told here. Errors list the valid alternatives.
tl::expected<std::unique_ptr<DeviceNode>, DeviceError> make_device(const DeviceTypes& types, const DeviceConfig& config,
                                                                   Devices& devices, const Clock& clock);

/// CPU time that the simulator's rendering has used in this process so far (0 without a simulated camera).
struct SimulatorUse {
  int64_t cpu_ns = 0;
  int64_t in_jobs_ns = 0;  ///< of it within jobs of device nodes, which count it as theirs, too
};
SimulatorUse simulator_use();

}  // namespace takt::hal
