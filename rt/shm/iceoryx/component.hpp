// SPDX-License-Identifier: Apache-2.0
// What libtakt_iceoryx.so offers to libtakt_core, which loads it when a run asks for iceoryx and links none itself.
#pragma once
#include <memory>
#include <span>
#include <string>

#include "rt/shm/transport.hpp"

namespace takt {

/// The module's only entry, under the name `takt_iceoryx`.
struct IceoryxComponent {
  const char* abi;  ///< kAbi of the module
  std::unique_ptr<Transport> (*make)(std::span<const PortPlan> ports);
  std::unique_ptr<Transport> (*join)(std::span<const PortPlan> ports, const std::string& domain);
};

}  // namespace takt
