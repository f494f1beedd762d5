// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/server.hpp"

#include <algorithm>

namespace takt::semantic_link {

Exchange* Server::add_robot(std::string name) {
  const auto same = [&](const Robot& robot) { return robot.name == name; };
  if (std::any_of(robots_.begin(), robots_.end(), same)) return nullptr;
  return &robots_.emplace_back(std::move(name)).exchange;
}

void Server::take(const Packet& packet, Peer from, int64_t now_ns) {
  if (packet.header.kind == Kind::hello) return answer(packet, from, now_ns);
  for (Robot& robot : robots_) {
    if (robot.session.active() && robot.session.id() == packet.header.session && robot.session.peer() == from)
      return robot.session.take(packet, now_ns);
    Robot::Welcomed& welcomed = robot.welcomed;
    if (welcomed.id == 0 || welcomed.id != packet.header.session || welcomed.peer != from) continue;
    robot.session.begin(from, welcomed.id, welcomed.nonce, now_ns);
    welcomed = {};
    return robot.session.take(packet, now_ns);
  }
  count_foreign();
}

void Server::answer(const Packet& packet, Peer from, int64_t now_ns) {
  const auto hello = read_hello(packet.payload);
  if (!hello) {
    ++counts_.malformed;
    return;
  }
  const auto robot = std::find_if(robots_.begin(), robots_.end(),
                                  [&](const Robot& r) { return r.name == std::string_view(hello->robot.data()); });
  const auto refuse = [&](Reason reason) {
    ++counts_.refused;
    send_note(Kind::refusal, 0, RefusalNote{hello->nonce, reason}, from, now_ns);
  };
  if (hello->layout != layout()) return refuse(Reason::other_messages);
  if (robot == robots_.end()) return refuse(Reason::unknown_robot);
  const Session& session = robot->session;
  if (session.active() && !session.over(now_ns)) {
    // One that arrives again after its client was welcomed changes nothing.
    if (session.nonce() != hello->nonce) refuse(Reason::taken);
    return;
  }
  Robot::Welcomed& welcomed = robot->welcomed;
  if (welcomed.id == 0 || welcomed.nonce != hello->nonce || welcomed.peer != from)
    welcomed = {from, std::max<uint64_t>(random_number(), 1), hello->nonce};
  send_note(Kind::welcome, welcomed.id, Welcome{hello->nonce, packet.header.stamp_ns, now_ns}, from, clock_.now_ns());
}

int64_t Server::send_due(int64_t now_ns) {
  int64_t next_ns = now_ns + kAlive_ns;
  for (Robot& robot : robots_) {
    if (robot.session.active() && robot.session.over(now_ns)) robot.session.end();
    next_ns = std::min(next_ns, robot.session.send_due(now_ns, outlet_));
    robot.session.publish(counts_, "no client");
  }
  return next_ns;
}

void Server::port_changed(bool open) {
  for (Robot& robot : robots_) {
    if (!open) robot.session.end();
    robot.exchange.connected.store(open, std::memory_order_release);
    robot.session.publish(counts_, open ? "no client" : "the port is gone");
  }
}

void Server::say_farewell() {
  for (Robot& robot : robots_) {
    robot.session.say_farewell(clock_.now_ns(), outlet_);
    robot.session.end();
  }
}

}  // namespace takt::semantic_link
