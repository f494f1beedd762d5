// SPDX-License-Identifier: Apache-2.0
#include "graph/ros2/topics.hpp"

#include <fmt/format.h>
#include <openssl/sha.h>

#include <algorithm>

#include "graph/world/ros_encoder.hpp"
#include "graph/world/ros_schemas.hpp"

namespace takt::ros2 {
namespace {

constexpr std::string_view kRaw = "image_raw", kCompressed = "image_raw/compressed";

bool left_out(const world::Outline& outline, std::span<const world::Outline> all, Pictures pictures) {
  const std::string_view topic = outline.topic;
  if (topic.ends_with(kCompressed)) return pictures == Pictures::image;
  const bool has_jpeg = std::any_of(all.begin(), all.end(), [&](const world::Outline& other) {
    return other.topic == outline.topic + "/compressed";
  });
  return topic.ends_with(kRaw) && has_jpeg && pictures == Pictures::compressed;
}

world::ros::Gid gid_of(const dds::Guid& guid) { return {guid}; }

}  // namespace

dds::Profile profile_of(std::string_view schema, std::string_view topic) {
  constexpr int kDepth = 10, kTransforms = 100;  // as rclcpp's default and tf2_ros have them
  if (schema.starts_with("sensor_msgs/")) return {};
  if (schema == "nav_msgs/msg/OccupancyGrid") return {.reliable = true, .transient_local = true, .depth = 1};
  if (topic == "/tf_static") return {.reliable = true, .transient_local = true, .depth = 1};
  if (topic == "/tf") return {.reliable = true, .depth = kTransforms};
  return {.reliable = true, .depth = kDepth};
}

std::string words(const dds::Profile& profile) {
  return fmt::format("{}, {}, keep last {}", profile.reliable ? "reliable" : "best effort",
                     profile.transient_local ? "transient local" : "volatile", profile.depth);
}

std::string topic_of(std::string_view name_space, std::string_view port, std::string_view form_topic) {
  if (form_topic.starts_with('/')) return std::string(form_topic);
  std::string topic = fmt::format("{}/takt/{}", name_space, port);
  std::replace(topic.begin(), topic.end(), '.', '/');
  return form_topic.empty() ? topic : topic + "/" + std::string(form_topic);
}

std::vector<Publication> publications(std::string_view name_space, std::string_view port,
                                      std::span<const world::Outline> outlines, Pictures pictures) {
  std::vector<Publication> all;
  for (const world::Outline& outline : outlines) {
    if (left_out(outline, outlines, pictures)) continue;
    const std::string topic = topic_of(name_space, port, outline.topic);
    all.push_back({outline.topic, topic, outline.schema, profile_of(outline.schema, topic)});
  }
  return all;
}

bool is_namespace(std::string_view text) {
  bool begins = false;  // a part
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_', digit = c >= '0' && c <= '9';
    if (i == 0 ? c != '/' : c == '/' ? begins : !(letter || (digit && !begins))) return false;
    begins = c == '/';
  }
  return !begins;
}

std::string type_hash(std::string_view schema) {
  const std::string text = world::ros_type_description(schema);
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest);
  std::string hash = "RIHS01_";
  for (const unsigned char byte : digest) hash += fmt::format("{:02x}", byte);
  return hash;
}

dds::Endpoint endpoint_of(const Publication& publication) {
  return {"rt" + publication.topic, world::dds_type_name(publication.schema), publication.profile,
          fmt::format("typehash={};", type_hash(publication.schema))};
}

dds::Endpoint graph_endpoint() {
  return {"ros_discovery_info",
          world::dds_type_name("rmw_dds_common/msg/ParticipantEntitiesInfo"),
          {.reliable = true, .transient_local = true, .depth = 1},
          ""};
}

std::string enclave() { return "enclave=/;"; }

std::vector<std::byte> entities(std::string_view name_space, const dds::Guid& participant,
                                std::span<const dds::Guid> writers) {
  std::vector<world::ros::Gid> gids(writers.size());
  std::transform(writers.begin(), writers.end(), gids.begin(), gid_of);
  const world::ros::NodeEntitiesInfo node{name_space.empty() ? "/" : name_space, "takt", {}, gids};
  return world::encoded(world::ros::ParticipantEntitiesInfo{gid_of(participant), {&node, 1}});
}

}  // namespace takt::ros2
