// SPDX-License-Identifier: Apache-2.0
#include <chrono>

#include "hal/device_types.hpp"
#include "hal/devices.hpp"
#include "hal/driver_parts.hpp"
#include "hal/laser/laser_node.hpp"
#include "hal/ros2/ros2_laser.hpp"

namespace takt::ros2 {
namespace {

constexpr int64_t kMostBeams = 20'000, kMostDomain = 232;

int64_t wall_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

hal::NodeResult make_laser(const hal::DeviceConfig& config, Settings& settings, hal::Devices&, const Clock& clock) {
  const TopicName topic{settings.text("address", "127.0.0.1"),
                        static_cast<int>(settings.count("domain", 0, 0, kMostDomain)), settings.text("topic", ""),
                        "sensor_msgs::msg::dds_::LaserScan_"};
  if (!topic.topic.starts_with('/')) settings.fail("`topic` is no name of ROS 2", "begin it with a slash: /scan");
  Ros2Laser::Parts parts;
  parts.id = config.id;
  parts.rule.beams = static_cast<uint32_t>(settings.count("beams", 0, 2, kMostBeams));
  const double fov_rad = settings.quantity("fov", Dimension::angle);
  parts.rule.first_angle_rad = -fov_rad / 2;
  parts.rule.step_rad = fov_rad / std::max(parts.rule.beams - 1.0, 1.0);
  parts.rule.max_range_m = settings.quantity("range", Dimension::length);
  parts.rule.frame = settings.text("frame", "");
  if (!(fov_rad > 0)) settings.fail("`fov` is no angle", "from the first beam to the last one, such as 270deg");
  if (!(parts.rule.max_range_m > 0)) settings.fail("`range` is no distance", "how far it reaches, such as 30m");
  constexpr double kMostLatency_s = 10;
  parts.stamps.latency_ns = hal::time_ns(settings, "latency", 0, kMostLatency_s);
  parts.rate_hz = hal::rate_of(settings).hz();
  parts.sensor_in_robot = settings.mount("mount");
  parts.listen = [topic] { return make_source(topic); };
  parts.wall_ns = wall_now_ns;
  return hal::closed<LaserNode>(std::unique_ptr<LaserScanner>(std::make_unique<Ros2Laser>(std::move(parts), clock)),
                                settings);
}

}  // namespace
}  // namespace takt::ros2

namespace takt {

void register_ros2_devices(hal::DeviceTypes& types) {
  using enum hal::SettingKind;
  types.add(
      "laser_scanner", {"ros2", "a scan that a node of ROS 2 publishes", hal::hardware(ros2::make_laser),
                        hal::DriverSort::neighbour},
      {
          {"topic", "ros2", text, true, "of sensor_msgs/msg/LaserScan, such as /scan", true},
          {"address", "ros2", text, false, "IP address of the interface to ROS 2; 127.0.0.1", true},
          {"domain", "ros2", count, false, "of DDS (ROS_DOMAIN_ID), 0 to 232; 0", true},
          {"beams", "ros2", count, true, "of each scan; those with another number are refused"},
          {"fov", "ros2", angle, true, "from the first beam to the last one, centred ahead"},
          {"range", "ros2", length, true, "beyond it there is no return"},
          {"frame", "ros2", text, false, "frame_id that scans must have; any"},
          {"latency", "ros2", time, false,
           "of a scan, at most, by wall clocks that agree; without it a scan counts from its arrival, and its age is "
           "not known"},
      });
}

}  // namespace takt
