// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/attach/endpoint.hpp"
#include "graph/attach/wall_stamps.hpp"
#include "graph/log/followed_port.hpp"
#include "graph/ros2/diagnostics.hpp"
#include "graph/ros2/offer.hpp"
#include "graph/ros2/topics.hpp"
#include "graph/world/ros_encoder.hpp"
#include "hal/dds/participant.hpp"

namespace takt::ros2 {

/// Follows a run and writes what a reader is matched for; asks the run for nothing else. One message of a port at a
/// time: what comes while it is encoded and written is passed over for the newest. When the run ends, it waits for the
/// next one.
class Publisher {
 public:
  struct Counts {
    uint64_t written = 0, unsent = 0, unsound = 0, clock_steps = 0;
  };
  /// All given outlives this. Throws std::runtime_error.
  Publisher(dds::Participant& participant, const graph::MessageTypes& types, PublisherOptions options);
  /// Until `ending`. What it says goes to stderr.
  void run(const std::atomic<bool>& ending);
  const Counts& counts() const { return counts_; }

 private:
  struct Topic {
    Publication publication;
    size_t writer = 0;
    bool matched = false;
  };
  struct Port {
    log::FollowedPort followed;
    std::map<std::string, std::string> topics;  ///< of a form, the topic
    bool asked = false;
  };
  /// Why it ended, in words.
  std::string follow(attach::Connection& connection, const std::atomic<bool>& ending);
  tl::expected<void, std::string> describe(attach::Connection& connection);
  void offer_topic(const Publication& publication, std::map<std::string, Topic>& before);
  void tell_graph();
  bool tell_wishes(attach::Connection& connection);
  bool take(attach::Connection& connection, const Json& line);
  void publish(const std::string& name, Port& port, int64_t stamp_ns);
  void publish_map(const std::string& name, const Port& port, int64_t stamp_ns);
  void write(const std::string& topic, std::span<const std::byte> cdr);
  bool is_matched(const std::string& topic) const;

  dds::Participant& participant_;
  const graph::MessageTypes& types_;
  const PublisherOptions options_;
  const world::RosEncoder encoder_;
  const size_t graph_writer_;
  std::map<std::string, Topic> topics_;
  std::map<std::string, Port> ports_;
  std::string odometry_;
  std::optional<Diagnostics> diagnostics_;
  std::optional<Transform> base_in_odometry_;
  attach::WallStamps stamps_;
  bool state_asked_ = false;
  int64_t taken_ns_ = 0;  ///< when the message that is published now came, since 1970
  Counts counts_;
};

}  // namespace takt::ros2
