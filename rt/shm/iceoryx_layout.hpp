// SPDX-License-Identifier: Apache-2.0
// Which iceoryx memory pool each output draws from, computed before the daemon starts. Pure arithmetic.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "rt/shm/transport.hpp"

namespace takt {

/// Limits compiled into the iceoryx of Debian 12 (checked against its headers in iceoryx_transport.cpp).
namespace iceoryx_limit {
constexpr uint32_t pools = 32;
constexpr uint32_t history = 16;
constexpr uint32_t queue = 256;
constexpr uint32_t outputs = 253;      ///< 512 publishers, 6 internal, 2 per output
constexpr uint32_t inputs = 512;       ///< 1,024 subscribers, 2 per edge
constexpr uint32_t chunk_header = 40;  ///< in front of each chunk
constexpr uint32_t alignment = 64;     ///< of what we loan
}  // namespace iceoryx_limit

struct IceoryxPool {
  uint32_t loan_bytes = 0;     ///< what to ask iceoryx for, so that it picks this pool and no other
  uint32_t payload_bytes = 0;  ///< as the daemon's configuration wants it: with the slack for alignment
  uint32_t chunks = 0;
  uint64_t bytes() const { return (uint64_t{payload_bytes} + iceoryx_limit::chunk_header) * chunks; }
};

/// iceoryx serves a loan from the smallest pool that fits and never falls back to a larger one. Each output therefore
/// gets a pool of its own by a size of its own (64 B more where two are equal), so that one greedy consumer cannot
/// starve a foreign publisher. Only where there are more outputs than pools do neighbours in size share one.
struct IceoryxLayout {
  std::vector<IceoryxPool> pools;  ///< ascending; pools[0] carries the notes of repeated messages, for all outputs
  std::vector<uint32_t> pool_of_port;
  uint64_t bytes() const;

  /// Throws std::invalid_argument naming the output that exceeds a limit of iceoryx.
  static IceoryxLayout of(std::span<const PortPlan> ports);
};

/// Chunks that `port` can have in use at once over iceoryx. More than PortPlan::chunks(): every reader keeps the newest
/// `history` messages for itself, and a reader that sleeps keeps old ones that nobody else has any more.
uint32_t iceoryx_chunks(const PortPlan& port);

}  // namespace takt
