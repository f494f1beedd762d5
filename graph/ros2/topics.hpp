// SPDX-License-Identifier: Apache-2.0
// What ROS 2 calls a thing: topics, types, profiles, nodes, as its middleware spells them on DDS.
//
//   for (const Publication& p : publications(port, type_outlines, options)) print(p.topic, p.schema, words(p.profile));
//   endpoint_of(p);  // topic "rt/takt/front_laser/scan", type "sensor_msgs::msg::dds_::LaserScan_"
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "graph/world/encoder.hpp"
#include "hal/dds/participant.hpp"

namespace takt::ros2 {

/// How pictures are published.
enum class Pictures : uint8_t { compressed, image, both };

/// A topic that an output, or the run as a whole, feeds.
struct Publication {
  std::string form_topic;  ///< of world::Form
  std::string topic;       ///< "/takt/head_camera/pair/left/image_raw/compressed"
  std::string schema;      ///< "sensor_msgs/msg/CompressedImage"
  dds::Profile profile;
};

/// Best effort and the newest one for what sensors see, as rclcpp's SensorDataQoS offers it; reliable for the rest;
/// maps also for who comes late, as nav2 asks for them.
dds::Profile profile_of(std::string_view schema, std::string_view topic);
/// "best effort, volatile, keep last 1".
std::string words(const dds::Profile& profile);

/// "/takt/head_camera/pair" and what is behind it; a form's topic that begins with a slash is the whole topic.
std::string topic_of(std::string_view name_space, std::string_view port, std::string_view form_topic);

/// What is published of an output "NODE.PORT".
std::vector<Publication> publications(std::string_view name_space, std::string_view port,
                                      std::span<const world::Outline> outlines, Pictures pictures);

/// Whether ROS 2 takes it: "", or parts of letters, digits and _ that begin with no digit, each behind a slash.
bool is_namespace(std::string_view text);

/// "RIHS01_..." of a message that Takt writes.
std::string type_hash(std::string_view schema);

dds::Endpoint endpoint_of(const Publication& publication);
/// What the graph of ROS 2 is read from, see entities().
dds::Endpoint graph_endpoint();
/// USER_DATA of the participant.
std::string enclave();
/// CDR of ParticipantEntitiesInfo: one node NAMESPACE/takt with these writers.
std::vector<std::byte> entities(std::string_view name_space, const dds::Guid& participant,
                                std::span<const dds::Guid> writers);

}  // namespace takt::ros2
