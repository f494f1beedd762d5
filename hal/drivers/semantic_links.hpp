// SPDX-License-Identifier: Apache-2.0
// Device kinds semantic_service and semantic_link.
#pragma once
#include <map>
#include <memory>
#include <string>

#include "hal/drivers.hpp"
#include "hal/settings/settings.hpp"

namespace takt::semantic_link {
class LinkRunner;
class Server;
}  // namespace takt::semantic_link

namespace takt::hal {

/// The servers of one process, one per address: services at the same one share it, each with a robot of its own.
class SemanticServers {
 public:
  /// Errors are left in `settings`, or are those of the port.
  tl::expected<std::unique_ptr<DeviceNode>, DeviceError> make_service(const DeviceConfig& config, Settings& settings,
                                                                      const Clock& clock);

 private:
  struct Shared {
    std::weak_ptr<semantic_link::LinkRunner> runner;
    semantic_link::Server* server = nullptr;
  };
  std::map<std::string, Shared> servers_;
};

tl::expected<std::unique_ptr<DeviceNode>, DeviceError> make_semantic_link(const DeviceConfig& config,
                                                                          Settings& settings, const Clock& clock);

}  // namespace takt::hal
