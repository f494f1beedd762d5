// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <deque>

#include "hal/semantic_link/link_end.hpp"

namespace takt::semantic_link {

/// Serves robots by name, each to one client at a time. A client has a robot from its first datagram after the welcome,
/// which shows that it hears the server where it says it is, until it takes leave or has been silent for kSilent_ns;
/// who asks meanwhile is refused.
class Server final : public LinkEnd {
 public:
  using LinkEnd::LinkEnd;
  /// Before the first step. Null if that robot is there already. At most 31 characters.
  Exchange* add_robot(std::string name);
  void say_farewell() override;

 private:
  struct Robot {
    explicit Robot(std::string robots_name) : name(std::move(robots_name)) {}
    std::string name;
    Exchange exchange;
    Session session{Way::to_server, exchange};
    struct Welcomed {
      Peer peer{};
      uint64_t id = 0, nonce = 0;  ///< id 0: nobody
    } welcomed;
  };
  void take(const Packet& packet, Peer from, int64_t now_ns) override;
  int64_t send_due(int64_t now_ns) override;
  void port_changed(bool open) override;
  void answer(const Packet& packet, Peer from, int64_t now_ns);

  std::deque<Robot> robots_;
};

}  // namespace takt::semantic_link
