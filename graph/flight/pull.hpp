// SPDX-License-Identifier: Apache-2.0
// Takes the files of the flight recorder off another machine.
//
//   const Pulled pulled = pull({.from = "user@robot:out", .to = "frozen"});
//   if (!pulled.error.empty()) ...
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace takt::flight {

struct PulledFile {
  enum State : uint8_t {
    there,    ///< only listed
    here,     ///< it was pulled before
    fetched,  ///< whole, its hash is that of the robot
    open,     ///< of the ring: the run writes it, or was killed while it did
    gone,     ///< listed, and no longer there when it was to be read
    other,    ///< here is another file of that name
  };
  std::string name;  ///< "ace-20261129-184012-4711-0001-mark.mcap"
  bool of_ring = false;
  State state = there;
  uint64_t bytes = 0;
  uint64_t resumed_at = 0;  ///< so many bytes an earlier pull had left, and they were right
  bool again = false;       ///< what an earlier pull had left was damaged
  std::string sha256;       ///< of what was fetched
};
/// "fetched"
const char* word(PulledFile::State state);

struct PullOptions {
  std::string from;                    ///< HOST:FOLDER, as scp takes it; the folder OUTPUT, OUTPUT/flight or one in it
  std::filesystem::path to;            ///< made if it is not there; may be empty with `list`
  std::string ssh = kSsh;              ///< what RemoteShell::over() takes
  double most_bytes_s = 0;             ///< 0: as fast as it goes
  bool ring = false;                   ///< also the files of the ring that are closed
  bool list = false;                   ///< fetches nothing
  std::function<bool()> stopped = {};  ///< asked again and again; true ends the pull
  std::function<void(const PulledFile&)> told = {};  ///< called once for each
  /// A connection that is gone is noticed within a minute.
  static constexpr const char* kSsh = "ssh -o ServerAliveInterval=15";
};

struct Pulled {
  enum Fault : uint8_t {
    none,
    input,   ///< the call must be another one
    system,  ///< a machine, the connection, a disk
    broken,  ///< stopped, or what came is not what was sent
  };
  std::string host, folder;
  std::vector<PulledFile> files;
  uint64_t fetched_bytes = 0;  ///< over the connection, with those that came in vain
  Fault fault = none;
  std::string error;  ///< why not all that is there is here
};

/// Frozen files, the oldest first. On the robot nothing is changed; it needs sh, stat, head, tail, tr, sha256sum. A
/// file gets its name once its SHA-256 is the robot's; until then it is NAME.part, and the next pull goes on with that.
Pulled pull(const PullOptions& options);

/// How long a transfer waits that must not be faster, after so many bytes in so much time.
constexpr int64_t pause_ns(uint64_t bytes, int64_t elapsed_ns, double most_bytes_s) {
  if (most_bytes_s <= 0) return 0;
  const auto due_ns = static_cast<int64_t>(static_cast<double>(bytes) * 1e9 / most_bytes_s);
  return due_ns > elapsed_ns ? due_ns - elapsed_ns : 0;
}

}  // namespace takt::flight
