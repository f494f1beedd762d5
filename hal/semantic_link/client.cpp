// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/client.hpp"

#include <algorithm>

namespace takt::semantic_link {
namespace {

const char* to_text(Reason reason) {
  switch (reason) {
    case Reason::unknown_robot: return "the server has no robot of this name";
    case Reason::taken: return "the robot has a client already";
    case Reason::other_messages: return "the server was built with other messages";
  }
  return "?";
}

}  // namespace

Client::Client(std::unique_ptr<DatagramPort> port, const Key& key, std::string_view robot, const Clock& clock)
    : LinkEnd(std::move(port), key, clock) {
  std::copy_n(robot.begin(), std::min(robot.size(), hello_.robot.size() - 1), hello_.robot.begin());
  hello_.layout = layout();
  search();
}

void Client::search() {
  session_.end();
  hello_.nonce = random_number();
  hello_ns_ = INT64_MIN;
  trouble_ = "the server does not answer";
}

void Client::take(const Packet& packet, Peer from, int64_t now_ns) {
  const Header& h = packet.header;
  if (session_.active()) {
    if (h.session == session_.id() && from == session_.peer() && h.kind != Kind::welcome)
      return session_.take(packet, now_ns);
    // An answer to a hello that was sent twice comes twice.
    if (h.session != session_.id() || h.kind != Kind::welcome) count_foreign();
    return;
  }
  if (h.kind == Kind::welcome) {
    const auto welcome = read_welcome(packet.payload);
    if (welcome && welcome->nonce == hello_.nonce && h.session != 0) {
      session_.begin(from, h.session, hello_.nonce, now_ns);
      session_.learn_clock(welcome->sent_ns, welcome->heard_ns, h.stamp_ns, now_ns);
      return;
    }
  } else if (h.kind == Kind::refusal) {
    const auto refusal = read_refusal(packet.payload);
    if (refusal && refusal->nonce == hello_.nonce) {
      ++counts_.refused;
      trouble_ = to_text(refusal->reason);
      return;
    }
  }
  count_foreign();
}

int64_t Client::send_due(int64_t now_ns) {
  if (session_.active() && session_.over(now_ns)) search();
  int64_t next_ns = session_.send_due(now_ns, outlet_);
  if (!session_.active()) {
    if (hello_ns_ == INT64_MIN || now_ns - hello_ns_ >= kHello_ns) {
      send_note(Kind::hello, 0, hello_, Peer::server, now_ns);
      hello_ns_ = now_ns;
    }
    next_ns = std::min(next_ns, hello_ns_ + kHello_ns);
  }
  session_.publish(counts_, trouble_);
  return next_ns;
}

void Client::port_changed(bool open) {
  if (!open) search();
  exchange_.connected.store(open, std::memory_order_release);
  session_.publish(counts_, open ? trouble_ : "the port is gone");
}

void Client::say_farewell() {
  session_.say_farewell(clock_.now_ns(), outlet_);
  search();
}

}  // namespace takt::semantic_link
