// SPDX-License-Identifier: Apache-2.0
// What can befall the messages of an output, as plain data.
#pragma once
#include <cstdint>
#include <limits>

namespace takt::faults {

inline constexpr int64_t kForever = std::numeric_limits<int64_t>::max();

/// What happens to a message that its node publishes. What it is for a reader stands in docs/faults.md.
enum class MessageFaultKind : uint8_t {
  drop,        ///< never published
  delay,       ///< visible `by_ns` later
  duplicate,   ///< published twice, with one stamp
  corrupt,     ///< numbers changed, see damage.hpp
  truncate,    ///< arrays shortened, see damage.hpp
  freeze,      ///< the content of the first message of the window again and again, under new stamps
  reorder,     ///< held back until the next one is published: two neighbours swap places
  clock_step,  ///< its stamp is off by `by_ns`
  exhaust,     ///< somebody holds every message of the output, until there is no chunk to write into
};

/// One fault of one output.
struct MessageFault {
  MessageFaultKind kind = MessageFaultKind::drop;
  uint64_t port = 0;                      ///< index into the ports of the transport
  int64_t from_ns = 0, to_ns = kForever;  ///< instants of publication it strikes at: [from, to), since the epoch
  double probability = 1;                 ///< 0..1 that a message in that window is struck
  int64_t by_ns = 0;                      ///< of delay (>= 0) and clock_step (either sign)
  uint64_t seed = 0;

  bool covers(int64_t since_epoch_ns) const { return since_epoch_ns >= from_ns && since_epoch_ns < to_ns; }
};

/// 64 bits that depend on nothing but their arguments, evenly spread: finaliser of SplitMix64 (Steele, Lea, Flood
/// 2014), once per argument. Whether a message is struck must not depend on what happened to others.
constexpr uint64_t mixed(uint64_t x) {
  x += 0x9e3779b97f4a7c15;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}
constexpr uint64_t mixed(uint64_t seed, uint64_t a, uint64_t b) { return mixed(mixed(mixed(seed) ^ a) ^ b); }

/// Whether this fault is to strike the `number`-th message (from 1 on) that the node has published on the port.
constexpr bool strikes(const MessageFault& fault, uint64_t number) {
  return static_cast<double>(mixed(fault.seed, fault.port, number) >> 11) * 0x1p-53 < fault.probability;
}

}  // namespace takt::faults
