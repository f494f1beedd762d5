// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <vector>

#include "hal/semantic_link/session.hpp"
#include "rt/time/clock.hpp"

namespace takt::semantic_link {

/// One end of the link: reads what comes at its port, and does what is due. Has no thread: step() does its work. One
/// thread at a time, but for robots' exchanges.
class LinkEnd {
 public:
  LinkEnd(std::unique_ptr<DatagramPort> port, const Key& key, const Clock& clock);
  LinkEnd(const LinkEnd&) = delete;
  LinkEnd& operator=(const LinkEnd&) = delete;
  virtual ~LinkEnd() = default;

  DeviceResult open();
  void close();
  /// Takes what has come, sends what is due; opens a lost port again, every 250 ms. Returns when it is to be called
  /// again, unless wait() says so before.
  int64_t step();
  pollfd wait() const { return open_ ? port_->wait() : pollfd{-1, 0, 0}; }
  /// Takes leave of everybody: the other ends need not wait for silence.
  virtual void say_farewell() = 0;

 protected:
  /// A datagram whose check holds.
  virtual void take(const Packet& packet, Peer from, int64_t now_ns) = 0;
  /// Returns when the next one is due. `open`: there is a port to send through.
  virtual int64_t send_due(int64_t now_ns) = 0;
  /// The port is there again, or gone.
  virtual void port_changed(bool open) = 0;
  void count_foreign() { ++counts_.foreign; }
  /// Of a conversation that has no session yet.
  template <class Note>
  void send_note(Kind kind, uint64_t session, const Note& note, Peer to, int64_t now_ns) {
    std::array<uint8_t, kLargestNote> bytes;
    const size_t size = write_note(note, bytes);
    Header header;
    header.kind = kind;
    header.session = session;
    header.stamp_ns = now_ns;
    header.message_bytes = static_cast<uint32_t>(size);
    outlet_.send(to, header, std::span(bytes).first(size));
  }

  const Clock& clock_;
  LinkCounts counts_;  ///< of what belongs to no session
  std::unique_ptr<DatagramPort> port_;
  const Key key_;
  Outlet outlet_;

 private:
  bool receive_one(int64_t now_ns);
  void set_open(bool open);

  bool open_ = false;
  int64_t open_again_ns_ = 0;
  std::vector<uint8_t> bytes_;
};

/// 64 bits that nobody can foresee.
uint64_t random_number();

}  // namespace takt::semantic_link
