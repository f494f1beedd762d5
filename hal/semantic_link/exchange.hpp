// SPDX-License-Identifier: Apache-2.0
// What the jobs of one robot's node and the link's thread hand each other; neither ever waits for the other.
#pragma once
#include <array>
#include <atomic>
#include <vector>

#include "hal/newest.hpp"
#include "hal/semantic_link/messages.hpp"

namespace takt::semantic_link {

/// One message of a kind on its way between job and thread.
struct Parcel {
  std::vector<std::byte> bytes;
  int64_t stamp_ns = 0;  ///< own clock
};

/// Since the start. Those of datagrams that belong to no session are the end's and not one robot's.
struct LinkCounts {
  uint64_t sent = 0, received = 0;  ///< datagrams of sessions
  uint64_t malformed = 0;           ///< no datagram or message of this protocol, whoever sent it
  uint64_t damaged = 0;             ///< the check does not hold: changed on the way, or made without the key
  uint64_t foreign = 0;             ///< of nobody who has a session here, or of another session
  uint64_t replayed = 0;            ///< came before
  uint64_t late = 0;                ///< a newer message of its kind had come, or it was too old to be used
  uint64_t lost = 0;                ///< never came, as far as that is known
  uint64_t incomplete = 0;          ///< messages of which a fragment did not come in time
  uint64_t refused = 0;             ///< hellos that were answered with a refusal
  uint64_t too_large = 0;           ///< messages that were not sent, for what their kind may have
};

/// How a robot's link stands.
struct LinkReport {
  bool attached = false;
  int64_t to_own_ns = 0, bound_ns = 0, round_trip_ns = 0;
  const char* trouble = "";  ///< why it is not attached; a literal
  LinkCounts counts;
};

struct Exchange {
  Exchange() {
    for (const MessageKind& info : message_kinds())
      parcels[index_of(info.kind)].for_each([&](Parcel& slot) { slot.bytes.reserve(most_bytes(info)); });
  }
  /// By index_of(); each kind goes one way only.
  std::array<Newest<Parcel>, kMessageKinds> parcels;
  Newest<LinkReport> report;
  std::atomic<uint64_t> heard{0};  ///< datagrams of the session
  std::atomic<uint64_t> bad{0};    ///< datagrams that were damaged or malformed
  std::atomic<bool> connected{false};
  std::atomic<uint64_t> too_large{0}, too_old{0};  ///< counted by the jobs
};

}  // namespace takt::semantic_link
