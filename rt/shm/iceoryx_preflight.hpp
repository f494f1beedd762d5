// SPDX-License-Identifier: Apache-2.0
// What must be true of the machine before an iceoryx daemon may start here. The daemon itself aborts the process where
// one of these fails, so everything is tried first.
#pragma once
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace takt {

/// Places and identity, injectable for tests.
struct IceoryxPlaces {
  std::filesystem::path run = "/tmp";  ///< locks and sockets (compiled into iceoryx)
  std::filesystem::path shm = "/dev/shm";
  std::filesystem::path locks = "/proc/locks";
  uid_t user;           ///< effective user of this process
  std::string segment;  ///< file name of the pools in shm: iceoryx names it after the group of the process
  static IceoryxPlaces of_this_machine();
};

/// Removes the socket and the lock of the iceoryx runtime of a process that was killed.
void remove_iceoryx_leftovers(const IceoryxPlaces& places, pid_t dead);

/// Throws TransportError with the fix if a daemon runs already, if leftovers of another user are in the way, or if
/// `needed_bytes` do not fit into shared memory. Leftovers of this user are harmless: the daemon replaces them, and
/// sockets and locks of runtimes whose process is dead are removed here.
void iceoryx_preflight(const IceoryxPlaces& places, uint64_t needed_bytes);

/// The right to start a daemon in these places, from the preflight until the daemon's own lock is there: two runs that
/// start at once would both find no daemon, and the second would abort. Throws TransportError if another process has
/// it. Held by the processes that are forked meanwhile, too; release() ends it for all.
class DaemonClaim {
 public:
  explicit DaemonClaim(const IceoryxPlaces& places);
  ~DaemonClaim() { release(); }
  DaemonClaim(const DaemonClaim&) = delete;
  DaemonClaim& operator=(const DaemonClaim&) = delete;
  void release();

 private:
  int folder_ = -1;
};

}  // namespace takt
