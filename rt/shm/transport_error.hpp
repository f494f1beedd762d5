// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/transport_error.hpp>: core, experimental.
#pragma once
#include <stdexcept>

namespace takt {

/// The machine, not the graph, keeps a transport from starting (exit 3): a foreign daemon, leftovers of another user,
/// too little shared memory. The message names the file or process at fault and the command that mends it.
struct TransportError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace takt
