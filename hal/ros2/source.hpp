// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace takt::ros2 {

/// A topic of ROS 2 to listen to, best effort, the newest ones.
struct TopicName {
  std::string address;  ///< IP address of the interface; nothing is heard on any other
  int domain = 0;       ///< 0 to 232
  std::string topic;    ///< "/scan"
  std::string type;     ///< "sensor_msgs::msg::dds_::LaserScan_"
};

/// Messages of a topic, as CDR. Blocks: for a thread of its own.
class Source {
 public:
  virtual ~Source() = default;
  /// Waits until something comes, at most so long; then each(bytes) for all that is there.
  virtual void take(int64_t patience_ns, const std::function<void(std::span<const std::byte>)>& each) = 0;
};

/// Over DDS (Cyclone), from a module that is loaded then. Throws std::runtime_error with the next step.
std::unique_ptr<Source> make_source(const TopicName& topic);

/// The module's only entry, under the name `takt_ros2`.
struct SourceComponent {
  const char* abi;  ///< kAbi of the module
  std::unique_ptr<Source> (*make)(const TopicName& topic);
};

}  // namespace takt::ros2
