// SPDX-License-Identifier: Apache-2.0
#include "graph/ros2/offer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "graph/language/words.hpp"
#include "graph/log/followed_port.hpp"
#include "graph/world/ros_encoder.hpp"
#include "graph/world/specimen.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"

namespace takt::ros2 {
namespace {

bool is_type(const Json& port, std::string_view type) { return port.value("type", "") == type; }

/// Why an output of the options is none, or none of that type (empty: any).
std::string problem(const Json& ports, const std::string& name, std::string_view type, std::string_view option) {
  std::vector<std::string> known;
  for (const Json& port : ports)
    if (type.empty() || is_type(port, type)) known.push_back(port.value("name", ""));
  if (name.empty() || std::find(known.begin(), known.end(), name) != known.end()) return "";
  return fmt::format("{} {} is no output{}{}", option, graph::ticked(name),
                     type.empty() ? "" : fmt::format(" of type {}", type),
                     graph::alternatives(name, known, "outputs of this run"));
}

std::string first_odometry(const Json& ports) {
  const auto found =
      std::find_if(ports.begin(), ports.end(), [](const Json& port) { return is_type(port, Odometry::type_name); });
  return found == ports.end() ? "" : found->value("name", "");
}

/// All that messages of an output can show: a picture may also be rectified, which its zeros do not say.
std::vector<world::Outline> outlines_of(const log::FollowedPort& port) {
  if (port.type == nullptr) return {};
  const AlignedBytes message = world::specimen(*port.type, port.capacity);
  for (const Field& field : port.type->fields)
    if (field.name == "camera.focal_px") {
      constexpr double kAny = 1;
      std::memcpy(message.get() + field.offset, &kAny, sizeof kAny);
    }
  return world::RosEncoder().outline(*port.type, message.get());
}

}  // namespace

tl::expected<Offer, std::string> offer_of(const Json& graph, const graph::MessageTypes& types,
                                          const PublisherOptions& options) {
  const Json& ports = graph.at("ports");
  for (const std::string& port : options.ports)
    if (const auto why = problem(ports, port, "", "--port"); !why.empty()) return tl::unexpected(why);
  if (const auto why = problem(ports, options.odometry, Odometry::type_name, "--odometry"); !why.empty())
    return tl::unexpected(why);
  if (const auto why = problem(ports, options.map_pose, Pose::type_name, "--map-pose"); !why.empty())
    return tl::unexpected(why);

  Offer offer;
  offer.odometry = options.odometry.empty() ? first_odometry(ports) : options.odometry;
  for (const Json& described : ports) {
    const std::string name = described.value("name", "");
    if (!options.ports.empty() && std::find(options.ports.begin(), options.ports.end(), name) == options.ports.end())
      continue;
    const log::FollowedPort port(described, types);
    std::vector<world::Outline> outlines = outlines_of(port);
    if (is_type(described, Odometry::type_name) && name != offer.odometry)
      std::erase_if(outlines, [](const world::Outline& outline) { return outline.topic == "/tf"; });
    if (outlines.empty()) offer.left_out.push_back(name);
    else offer.ports.push_back({name, publications(options.name_space, name, outlines, options.pictures)});
    // The drift of odom in map is made of two outputs, whoever reads the rest of them.
    if (name == options.map_pose && !outlines.empty())
      offer.ports.back().publications.push_back({"/tf", "/tf", "tf2_msgs/msg/TFMessage", profile_of("", "/tf")});
  }
  return offer;
}

}  // namespace takt::ros2
