// SPDX-License-Identifier: Apache-2.0
// Any bytes, to both ends of the semantic link: as they are, and as datagrams of a session whose check holds.
#include <vector>

#include "hal/semantic_link/client.hpp"
#include "hal/semantic_link/server.hpp"
#include "hal/semantic_link/wire.hpp"
#include "tests/conformance/link_network.hpp"
#include "tests/fuzz/session.hpp"
#include "tests/nanoseconds.hpp"

using namespace takt;
using namespace takt::semantic_link;
using takt::fuzz::require, takt::test::Bytes, takt::test::MemoryNetwork;

namespace {

using test::kMs;
constexpr test::Peer kClient = static_cast<test::Peer>(2);

/// What the codec takes it gives back, byte by byte.
void check_codec(std::span<const uint8_t> bytes) {
  const auto packet = read_packet(bytes, {});
  if (packet) {
    Bytes again(packet->payload.size() + kOverhead);
    require(write_packet(packet->header, packet->payload, {}, again) == bytes.size());
    require(std::equal(again.begin(), again.end(), bytes.begin()));
  }
  read_hello(bytes);
  read_welcome(bytes);
  read_refusal(bytes);
  read_alive(bytes);
  for (const MessageKind& info : message_kinds()) {
    Placed message(info);
    if (!read_message(info, bytes, message.get())) continue;
    std::vector<std::byte> again;
    require(write_message(info, message.get(), again) && again.size() == bytes.size());
    require(std::equal(again.begin(), again.end(), std::as_bytes(bytes).begin()));
  }
}

/// Both ends, and what an attacker on the line who has the key could say in their names.
struct Conversation {
  VirtualClock clock{1'000'000'000};
  MemoryNetwork network;
  Server server{network.server(), {}, clock};
  Exchange& ace = *server.add_robot("ace");
  Client client{network.client(), {}, "ace", clock};
  uint32_t sequence = 1'000'000;

  void step() {
    clock.advance_to(clock.now_ns() + 10 * kMs);
    for (int round = 0; round < 2; ++round) server.step(), client.step();
    for (Exchange* exchange : {&ace, &client.exchange()}) {
      for (const MessageKind& info : message_kinds()) {
        if ((info.way == Way::to_server) != (exchange == &ace)) continue;
        const Parcel* parcel = exchange->parcels[index_of(info.kind)].take();
        if (parcel == nullptr) continue;
        Placed message(info);
        require(parcel->stamp_ns <= clock.now_ns());
        require(read_message(info, {reinterpret_cast<const uint8_t*>(parcel->bytes.data()), parcel->bytes.size()},
                             message.get())
                    .has_value());
      }
    }
    network.history.clear();
  }
  /// The session that the newest sign of life belongs to.
  uint64_t session() const {
    for (auto sent = network.history.rbegin(); sent != network.history.rend(); ++sent) {
      const auto packet = read_packet(sent->bytes, {});
      if (packet && packet->header.session != 0) return packet->header.session;
    }
    return 0;
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  std::span<const uint8_t> input(data, size);
  check_codec(input);
  Conversation talk;
  uint64_t session = 0;
  for (int i = 0; i < 8; ++i) {
    talk.clock.advance_to(talk.clock.now_ns() + 10 * kMs);
    talk.server.step(), talk.client.step();
    session = std::max(session, talk.session());
  }
  require(session != 0);
  while (input.size() >= 4) {
    const bool to_client = (input[0] & 1) != 0, whole = (input[0] & 2) != 0, raw = (input[0] & 4) != 0;
    const size_t length = static_cast<size_t>(input[1]) << 8 | input[2];
    const auto piece = input.subspan(3, std::min(length, input.size() - 3));
    input = input.subspan(3 + piece.size());
    const test::Peer from = to_client ? MemoryNetwork::kServer : kClient,
                     there = to_client ? kClient : MemoryNetwork::kServer;
    if (raw || piece.size() < 16) {
      talk.network.deliver(from, there, Bytes(piece.begin(), piece.end()));
    } else {
      Header header;
      WireReader in(piece);
      uint16_t bytes = 0;
      in.get(header.kind, header.fragment, header.fragments, header.number, header.stamp_ns);
      header.session = session;
      header.sequence = talk.sequence++;
      const auto payload = in.rest();
      header.message_bytes = static_cast<uint32_t>(payload.size());
      if (!whole && WireReader(payload).get(bytes)) header.message_bytes = bytes;
      if (whole) header.fragment = 0, header.fragments = 1;
      Bytes datagram(payload.size() + kOverhead);
      write_packet(header, payload, {}, datagram);
      talk.network.deliver(from, there, datagram);
    }
    talk.step();
  }
  return 0;
}
