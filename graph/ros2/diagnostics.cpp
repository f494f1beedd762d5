// SPDX-License-Identifier: Apache-2.0
#include "graph/ros2/diagnostics.hpp"

#include <deque>

#include "graph/world/ros_schemas.hpp"

namespace takt::ros2 {
namespace {

using world::ros::Health;

/// Texts that the statuses point into.
class Statuses {
 public:
  void add(Health health, std::string name, std::string message, std::string_view run, const Json& values) {
    std::vector<world::ros::KeyValue>& pairs = pairs_.emplace_back();
    for (const auto& [key, value] : values.items())
      if (key != "name")
        pairs.push_back({keep(key), keep(value.is_string() ? value.get<std::string>() : value.dump())});
    all.push_back({static_cast<std::byte>(health), keep(std::move(name)), keep(std::move(message)), run, pairs});
  }
  std::vector<world::ros::DiagnosticStatus> all;

 private:
  std::string_view keep(std::string text) { return texts_.emplace_back(std::move(text)); }
  std::deque<std::string> texts_;
  std::deque<std::vector<world::ros::KeyValue>> pairs_;
};

}  // namespace

Diagnostics::Diagnostics(const Json& graph) : run_(graph.value("name", "")) {
  for (const Json& node : graph.value("nodes", Json::array())) nodes_.push_back(node.value("name", ""));
  bad_.resize(nodes_.size());
}

std::vector<std::byte> Diagnostics::of(const Json& state, int64_t stamp_ns) {
  Statuses statuses;
  const Json nodes = state.value("nodes", Json::array());
  for (size_t i = 0; i < std::min(nodes.size(), nodes_.size()); ++i) {
    const Json& node = nodes[i];
    const uint64_t bad = node.value("deadline_misses", uint64_t{0}) + node.value("skipped", uint64_t{0});
    const bool worse = bad > bad_[i];
    bad_[i] = bad;
    statuses.add(worse ? Health::warn : Health::ok, "takt: " + nodes_[i],
                 worse ? "deadlines were missed" : "deadlines are met", run_, node);
  }
  for (const Json& device : state.value("devices", Json::array())) {
    const std::string how = device.value("state", ""), trouble = device.value("trouble", "");
    statuses.add(how == "ok" ? Health::ok : Health::error, "takt: device " + device.value("name", ""),
                 trouble.empty() ? how : how + ": " + trouble, run_, device);
  }
  return world::encoded(world::ros::DiagnosticArray{{world::time_of(stamp_ns), ""}, statuses.all});
}

}  // namespace takt::ros2
