// SPDX-License-Identifier: Apache-2.0
// One record of what a run keeps, while it runs.
//
//   const auto served = serve("out", sink, watch);   // returns once the run has ended, or watch.enough()
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <tl/expected.hpp>

#include "rt/record/mcap/file_sink.hpp"

namespace takt::flight {

/// Where the ring of a run lies: in OUTPUT, OUTPUT/flight, or the folder itself.
std::filesystem::path ring_of(const std::filesystem::path& folder);
/// Whether a process writes to the ring: it has the folder of its run.
bool run_lives(const std::filesystem::path& ring);

struct Watch {
  std::function<bool()> lives;   ///< whether the run goes on; what is in the ring then is all there will be
  std::function<bool()> enough;  ///< true ends the record with the next chunk
  std::function<void()> wait;    ///< for the next look at the ring
  std::function<void(const std::string&)> say = {};  ///< a line for whoever looks on
};

struct Served {
  std::string run, end;  ///< why it ended: "the run has ended"
  uint64_t messages = 0, bytes = 0, files = 0;
  uint64_t gaps = 0;
  std::string refused;  ///< why the sink took no more; what it has can be read up to its last chunk
};

/// Follows the newest run of a ring, from the beginning of its newest file on: whole chunks, as soon as they are there.
/// The ring is the buffer of a slow sink: what it drops before its turn comes is a gap, told in the record (metadata
/// `takt gap`) and by `say`. In memory are one chunk and at most 16 MB of the record's index. Error: no run left a ring
/// there, or it cannot be read.
tl::expected<Served, std::string> serve(const std::filesystem::path& ring, mcap::Sink& sink, const Watch& watch);

}  // namespace takt::flight
