// SPDX-License-Identifier: Apache-2.0
// Writer and Reader over iceoryx, for the process that runs the daemon and for its clients alike. Needs a runtime
// (PoshRuntime) that lives longer.
#pragma once
#include <memory>
#include <string>

#include "rt/shm/iceoryx_layout.hpp"
#include "rt/shm/transport.hpp"

namespace takt {

/// One output as both sides of it see it. The same in every process that was given the same ports.
struct IceoryxPort {
  PortPlan plan;
  IceoryxPool pool, note_pool;
  uint32_t pool_index = 0;
  std::string domain;  ///< graph; ports of different domains never meet
  size_t index = 0;
};

std::unique_ptr<Writer> make_iceoryx_writer(const IceoryxPort& port);

/// Waits, at most a second, until the daemon has connected the edge where its output exists already.
std::unique_ptr<Reader> make_iceoryx_reader(const IceoryxPort& port);

}  // namespace takt
