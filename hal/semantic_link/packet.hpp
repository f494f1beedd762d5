// SPDX-License-Identifier: Apache-2.0
// One datagram of the semantic link: a header, a message or a part of one, a check. Pure functions over bytes.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <tl/expected.hpp>

#include "hal/semantic_link/siphash.hpp"

namespace takt::semantic_link {

constexpr uint32_t kMagic = 0x4B4C5354;  // "TSLK"
constexpr uint8_t kVersion = 1;
constexpr size_t kHeaderBytes = 36, kCheckBytes = 8, kOverhead = kHeaderBytes + kCheckBytes;
/// Of one datagram, with header and check, and of one message in however many datagrams.
constexpr size_t kLargestDatagram = 65'000, kLargestMessage = 64'000;
constexpr uint8_t kMostFragments = 64;

/// What a datagram is about: the conversation itself, or one of the messages.
enum class Kind : uint8_t {
  hello = 1,     ///< client to server: wants to be a robot's client
  welcome = 2,   ///< server to client: the session to use
  refusal = 3,   ///< server to client: why not
  alive = 4,     ///< both ways: somebody is there, and what the clocks say
  farewell = 5,  ///< both ways: the sender ends the session
  objects = 16,  ///< server to client, as the next four
  scan,
  odometry,
  outcome,
  status,
  velocity,  ///< client to server, as the next two
  action,
  task,
};
bool known(Kind kind);

struct Header {
  Kind kind = Kind::alive;
  uint8_t fragment = 0, fragments = 1;  ///< this part, of so many
  uint64_t session = 0;                 ///< 0: none yet
  uint32_t sequence = 0;                ///< of datagrams, per session and direction: never twice
  uint32_t number = 0;                  ///< of messages, per session and kind; the same again for one that is repeated
  int64_t stamp_ns = 0;                 ///< of the message; of `hello`, `welcome` and `alive` when it was sent
  uint32_t message_bytes = 0;           ///< of the whole message
};

/// Why bytes are no datagram of this protocol, or no message.
enum class Fault : uint8_t {
  length,   ///< shorter than header and check, or longer than any datagram
  magic,    ///< another protocol
  version,  ///< another version of this one
  check,    ///< damaged, or made without the key
  kind,     ///< no kind of this version
  shape,    ///< fragments that cannot be those of one message
  content,  ///< a message that nobody can mean: cut off, too long, no number, a text without end
};
std::string_view to_text(Fault fault);

struct Packet {
  Header header;
  std::span<const uint8_t> payload;  ///< in the bytes it was read from
};

/// Writes one datagram; returns its size, header and check included. `into` has room for kOverhead more than the
/// payload.
size_t write_packet(const Header& header, std::span<const uint8_t> payload, const Key& key, std::span<uint8_t> into);

/// Any bytes: a datagram whose check holds, and whose header says what can be, or why it is none.
tl::expected<Packet, Fault> read_packet(std::span<const uint8_t> datagram, const Key& key);

/// How many datagrams a message of that size needs if one carries `unit` bytes of it; at least 1.
constexpr size_t fragments_of(size_t message_bytes, size_t unit) {
  return message_bytes <= unit ? 1 : (message_bytes + unit - 1) / unit;
}

/// Bytes of the message in every fragment of it but the last; of a packet that read_packet() gave.
size_t unit_of(const Packet& packet);

}  // namespace takt::semantic_link
