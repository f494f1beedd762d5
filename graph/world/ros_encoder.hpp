// SPDX-License-Identifier: Apache-2.0
// Messages as the nodes of ROS 2 read them: plain CDR in the messages that every installation has.
//
//   const world::RosEncoder encoder({.jpeg_quality = 75});
//   for (const world::Form& form : encoder.forms(type, message, "head_camera", stamp_ns, listens))
//     send(form.topic,    // "left/image_raw/compressed", below the topic of the port; "/tf"
//          form.schema,   // "sensor_msgs/msg/CompressedImage"
//          form.bytes);
//
// A picture is offered as it is (`image_raw`) and as JPEG (`image_raw/compressed`): `wanted` decides what is made. All
// functions may be called by several threads at once. They allocate: never call them in a job.
#pragma once
#include "graph/world/encoder.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/odometry.hpp"

namespace takt::world {

/// Names of frames and what lies between Takt's and those of REP 103 and 105.
namespace ros_frame {
constexpr std::string_view kBase = "base_link", kRobot = "robot", kOdometry = "odom";
/// x to the right, y ahead, in a frame whose x is ahead and y to the left.
constexpr Transform kTaktInRos{.qw = 0.70710678118654752, .qz = -0.70710678118654752};
/// The other way round.
constexpr Transform kRosInTakt{.qw = 0.70710678118654752, .qz = 0.70710678118654752};
/// "odom" of "odometry"; others keep their names.
std::string_view name(std::string_view takt_frame);
}  // namespace ros_frame

class RosEncoder {
 public:
  struct Options {
    int jpeg_quality = 75;  ///< 1 to 100
  };
  RosEncoder() = default;
  explicit RosEncoder(Options options) : options_(options) {}

  /// All forms of a message, or those that are wanted. `stamp_ns`: as ROS 2 counts, since 1970. `node`: whose message
  /// it is; the frame of its sensor. A message that is not sound() has none, nor has one that shows nothing.
  std::vector<Form> forms(const MessageType& type, const void* message, std::string_view node, int64_t stamp_ns,
                          const Wanted& wanted = {}) const;
  /// Topics and schemas of what forms() would give.
  std::vector<Outline> outline(const MessageType& type, const void* message) const;

 private:
  Options options_;
};

/// "sensor_msgs::msg::dds_::Image_" of "sensor_msgs/msg/Image".
std::string dds_type_name(std::string_view schema);
/// See type_description.hpp; empty: no message of ROS 2 that this program writes.
std::string ros_type_description(std::string_view schema);
/// Its definition and those that it uses, as ros2msg; empty as above.
std::string ros_definition(std::string_view schema);

/// `child` seen from where `parent` is seen from.
Transform chained(const Transform& parent, const Transform& child);
Transform inverted(const Transform& child_in_parent);
Transform base_in_odometry(const Odometry& odometry);

}  // namespace takt::world
