// SPDX-License-Identifier: Apache-2.0
// The side of `takt web` that faces a run.
#pragma once
#include <atomic>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "graph/attach/endpoint.hpp"
#include "graph/attach/machine_use.hpp"
#include "graph/attach/wall_stamps.hpp"
#include "graph/language/message_types.hpp"
#include "graph/log/followed_port.hpp"
#include "graph/web/hub.hpp"
#include "graph/world/encoder.hpp"
#include "rt/own_thread.hpp"

namespace takt::web {

/// Follows a run on a thread of its own: asks it for what somebody looks at, makes the views, hands them to the hub.
/// When the run ends, it waits for the next one.
class Link {
 public:
  struct Options {
    int run = 0;  ///< process id; 0: the one that there is
    int64_t state_every_ms = 500;
  };
  /// All given outlives this.
  Link(Hub& hub, const graph::MessageTypes& types, const Options& options);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  /// Asks the run, on a connection of its own: a line of the attach protocol. Blocks up to 5 s. Any thread.
  Json ask(const Json& question) const;

 private:
  struct Port : log::FollowedPort {
    using log::FollowedPort::FollowedPort;
    double asked_hz = -1;  ///< what the run was asked for; negative: nothing
  };
  void work();
  /// The end of a run, in words.
  std::string follow(attach::Connection& connection);
  bool describe(attach::Connection& connection);
  std::vector<Channel> channels_of(const std::string& name, const Port& port) const;
  bool tell_wishes(attach::Connection& connection);
  bool take(attach::Connection& connection, const Json& line);
  void show(const std::string& name, Port& port, const Json& line, const std::string& packed);
  void show_value(const View& view, const Port& port, const Json& line, const std::string& packed);
  void show_topics(const std::string& name, const Port& port, bool filled, int64_t stamp_ns,
                   std::span<const std::byte> packed);
  void take_state(const Json& line);

  Hub& hub_;
  const graph::MessageTypes& types_;
  const Options options_;
  std::atomic<bool> ending_{false};
  std::atomic<int> run_{0};
  std::map<std::string, Port> ports_;
  uint64_t wants_ = 0;
  int64_t epoch_ns_ = 0;
  const world::Encoder encoder_;
  attach::MachineUse use_;
  attach::WallStamps stamps_;
  OwnThread thread_;
};

}  // namespace takt::web
