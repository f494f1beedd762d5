// SPDX-License-Identifier: Apache-2.0
// The local transport where one run has several processes: no daemon, no lock, nothing to clean up. Nobody ever waits
// for a process that was killed; what it held is taken back with Transport::reclaim().
#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "rt/shm/pool_memory.hpp"
#include "rt/shm/transport.hpp"

namespace takt {

/// Pools in `file`, which is new. One process makes them, before any other joins. `process` is its number among those
/// of the file, under which its writers and readers hold chunks; no two processes that live at one time share one. A
/// process can write to the pools that it makes writers for, and to nothing else of the others: the rest is read-only.
/// Throws as make_local_transport(ports) does.
std::unique_ptr<Transport> make_local_transport(std::span<const PortPlan> ports, const PoolFile& file,
                                                uint32_t process = 1);
/// The pools that another process made for the same ports. Throws std::logic_error if they were made for others (seen
/// by their size), std::runtime_error if they cannot be mapped.
std::unique_ptr<Transport> join_local_transport(std::span<const PortPlan> ports, const PoolFile& file,
                                                uint32_t process = 2);

}  // namespace takt
