// SPDX-License-Identifier: Apache-2.0
// What libtakt_dds.so offers, which make_dds_wire() loads: programs that use no network link no DDS.
#pragma once
#include <memory>

#include "graph/machines/wire.hpp"

namespace takt::machines {

/// The module's only entry, under the name `takt_dds`.
struct DdsComponent {
  const char* abi;  ///< kAbi of the module
  std::unique_ptr<Wire> (*make)(const WireOptions& options);
};

}  // namespace takt::machines
