// SPDX-License-Identifier: Apache-2.0
#include "hal/ros2/source.hpp"
#include "rt/component.hpp"

namespace takt::ros2 {

std::unique_ptr<Source> make_source(const TopicName& topic) {
  static const auto& ros2 = load_component<SourceComponent>(
      "libtakt_ros2.so", "takt_ros2",
      "driver ros2 needs cyclonedds (package takt-ros2, or Takt built with cyclonedds-dev)");
  return ros2.make(topic);
}

}  // namespace takt::ros2
