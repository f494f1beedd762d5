// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <string_view>
#include <vector>

#include "hal/semantic_link/assembly.hpp"
#include "hal/semantic_link/clock_map.hpp"
#include "hal/semantic_link/datagram_port.hpp"
#include "hal/semantic_link/exchange.hpp"
#include "hal/semantic_link/replay_window.hpp"

namespace takt::semantic_link {

constexpr int64_t kAlive_ns = 50'000'000;      ///< between two signs of life
constexpr int64_t kRepeat_ns = 200'000'000;    ///< between two datagrams of a lasting message
constexpr int64_t kSilent_ns = 1'000'000'000;  ///< without a datagram for so long a session is over

/// Where datagrams go out, with the check that they get.
struct Outlet {
  DatagramPort& port;
  const Key& key;
  std::vector<uint8_t> bytes = std::vector<uint8_t>(kLargestDatagram);  ///< in which they are written
  void send(Peer to, const Header& header, std::span<const uint8_t> payload) {
    port.send(to, std::span(bytes).first(write_packet(header, payload, key, bytes)));
  }
};

/// The conversation of one robot with one peer at a time, the same at both ends: what comes is taken once, the newest
/// of each kind, with its stamp on the own clock; what goes out is sent and, where it lasts, repeated. Takes its memory
/// once; all instants are given. One thread at a time.
class Session {
 public:
  /// `incoming`: the way of the messages that are taken.
  Session(Way incoming, Exchange& exchange);

  /// Forgets the conversation before. `nonce` is that of the hello it began with.
  void begin(Peer peer, uint64_t id, uint64_t nonce, int64_t now_ns);
  void end();
  bool active() const { return active_; }
  Peer peer() const { return peer_; }
  uint64_t id() const { return id_; }
  uint64_t nonce() const { return nonce_; }
  /// Nothing has come for long, the other end has taken leave, or the numbers are used up.
  bool over(int64_t now_ns) const { return now_ns - heard_ns_ > kSilent_ns || left_ || next_sequence_ == UINT32_MAX; }

  /// A datagram of this session and peer.
  void take(const Packet& packet, int64_t now_ns);
  /// A round trip that began before the session; see ClockMap.
  void learn_clock(int64_t sent_ns, int64_t heard_ns, int64_t answered_ns, int64_t now_ns);
  /// Sends what is due. Messages that nobody takes wait, the newest of each lasting kind. Returns when it is to be
  /// called again.
  int64_t send_due(int64_t now_ns, Outlet& outlet);
  void say_farewell(int64_t now_ns, Outlet& outlet);

  /// `end_counts` are added to the session's own.
  void publish(const LinkCounts& end_counts, const char* trouble);
  LinkCounts& counts() { return counts_; }

 private:
  struct Incoming {
    explicit Incoming(const MessageKind& info) : assembly(most_bytes(info)), message(info) {}
    Assembly assembly;
    Placed message;
    uint32_t delivered = 0;
  };
  struct Outgoing {
    const Parcel* parcel = nullptr;
    uint32_t number = 0;
    int64_t sent_ns = 0;
    bool fresh = false;
  };
  void take_message(const Packet& packet, int64_t now_ns);
  void collect();
  void send_message(const MessageKind& info, Outgoing& out, int64_t now_ns, Outlet& outlet);
  void send(const Header& header, std::span<const uint8_t> payload, Outlet& outlet);

  Way incoming_way_;
  Exchange& exchange_;
  std::vector<Incoming> incoming_;  ///< by index_of() less first_in_
  size_t first_in_;
  std::array<Outgoing, kMessageKinds> outgoing_{};  ///< by index_of()

  bool active_ = false, left_ = false;
  Peer peer_{};
  uint64_t id_ = 0, nonce_ = 0;
  uint32_t next_sequence_ = 1;
  int64_t heard_ns_ = 0, alive_ns_ = 0;
  Alive echo_;  ///< for the next sign of life
  ReplayWindow window_;
  ClockMap clock_;
  LinkCounts counts_;
  uint64_t lost_before_ = 0;
};

}  // namespace takt::semantic_link
