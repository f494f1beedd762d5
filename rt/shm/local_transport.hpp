// SPDX-License-Identifier: Apache-2.0
// The local transport where one run has several processes: no daemon, no lock, nothing to clean up. Nobody ever waits
// for a process that was killed; what it held is taken back with Transport::reclaim().
#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "rt/shm/transport.hpp"

namespace takt {

/// The anonymous shared-memory file behind the pools. Processes forked while it exists can map it, too; it is gone when
/// the last of them is.
class PoolFile {
 public:
  /// Throws std::runtime_error if the kernel refuses.
  PoolFile();
  ~PoolFile();
  PoolFile(const PoolFile&) = delete;
  PoolFile& operator=(const PoolFile&) = delete;

  int descriptor() const { return descriptor_; }
  /// Throws std::runtime_error.
  void resize(uint64_t bytes) const;
  /// Its size. Throws std::runtime_error.
  uint64_t bytes() const;

 private:
  int descriptor_ = -1;
};

/// Pools in `file`, empty. One process makes them, before any other joins. `process` is the number, from 1, under which
/// its writers and readers hold chunks; no two processes that live at one time share one. Throws as
/// make_local_transport(ports) does.
std::unique_ptr<Transport> make_local_transport(std::span<const PortPlan> ports, const PoolFile& file,
                                                uint32_t process = 1);
/// The pools that another process made for the same ports. Throws std::logic_error if they were made for others (seen
/// by their size), std::runtime_error if they cannot be mapped.
std::unique_ptr<Transport> join_local_transport(std::span<const PortPlan> ports, const PoolFile& file,
                                                uint32_t process = 2);

}  // namespace takt
