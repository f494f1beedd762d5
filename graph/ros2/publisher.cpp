// SPDX-License-Identifier: Apache-2.0
#include "graph/ros2/publisher.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "graph/ros2/offer.hpp"
#include "graph/world/ros_schemas.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/time/clock.hpp"

namespace takt::ros2 {
namespace {

constexpr int kLookMs = 20;  ///< how long a new reader waits, at most, until the run is asked
constexpr auto kRetry = std::chrono::milliseconds(300);
constexpr int kStateEveryMs = 1000;
constexpr std::string_view kTf = "/tf", kTfStatic = "/tf_static", kDiagnostics = "/diagnostics";

Publication whole_run(std::string_view topic, std::string_view schema) {
  return {std::string(topic), std::string(topic), std::string(schema), profile_of(schema, topic)};
}

std::vector<std::byte> moved(std::string_view parent, std::string_view child, const Transform& t, int64_t stamp_ns) {
  const world::ros::TransformStamped transform{
      {world::time_of(stamp_ns), parent}, child, {{t.x, t.y, t.z}, world::rotation_of(t)}};
  return world::encoded(world::ros::TFMessage{{&transform, 1}});
}

}  // namespace

Publisher::Publisher(dds::Participant& participant, const graph::MessageTypes& types, PublisherOptions options)
    : participant_(participant),
      types_(types),
      options_(std::move(options)),
      encoder_({.jpeg_quality = options_.jpeg_quality}),
      graph_writer_(participant.add_writer(graph_endpoint())) {
  tell_graph();
}

void Publisher::run(const std::atomic<bool>& ending) {
  std::string said;
  for (std::string why = "no run is there; start one with `takt run GRAPH`"; !ending.load();) {
    if (why != said) fmt::print(stderr, "takt ros2: {}\n", said = why);
    std::this_thread::sleep_for(kRetry);
    const auto run = attach::chosen_run(options_.run);
    if (!run) {
      why = run.error();
      continue;
    }
    if (auto connection = attach::connect_to(*run)) why = follow(*connection, ending), said.clear();
  }
}

std::string Publisher::follow(attach::Connection& connection, const std::atomic<bool>& ending) {
  if (const auto described = describe(connection); !described) return described.error();
  if (!connection.write({{"do", "follow"}})) return "the run has ended";
  state_asked_ = false;
  while (!ending.load()) {
    if (!tell_wishes(connection)) break;
    if (!connection.readable(kLookMs)) continue;
    const auto line = connection.read_line();
    taken_ns_ = attach::wall_ns();
    if (!line || !line->is_object() || !take(connection, *line)) break;
  }
  return ending.load() ? "" : "the run has ended";
}

tl::expected<void, std::string> Publisher::describe(attach::Connection& connection) {
  if (!connection.write({{"do", "describe"}})) return tl::unexpected<std::string>("the run has ended");
  const auto graph = connection.read_line();
  if (!graph || !graph->is_object() || !graph->contains("ports"))
    return tl::unexpected<std::string>("the run does not say what it is: it is of another version of Takt");
  const auto offer = offer_of(*graph, types_, options_);
  if (!offer) return tl::unexpected(offer.error());
  diagnostics_.emplace(*graph);
  base_in_odometry_.reset();
  odometry_ = offer->odometry;
  ports_.clear();
  std::map<std::string, Topic> before = std::exchange(topics_, {});
  for (const Json& described : graph->at("ports")) {
    const auto port = std::find_if(offer->ports.begin(), offer->ports.end(),
                                   [&](const Offer::Port& p) { return p.name == described.value("name", ""); });
    if (port == offer->ports.end()) continue;
    Port made{log::FollowedPort(described, types_), {}, false};
    for (const Publication& publication : port->publications) {
      made.topics[publication.form_topic] = publication.topic;
      offer_topic(publication, before);
    }
    ports_.emplace(port->name, std::move(made));
  }
  for (const Publication& publication : whole_run_publications()) offer_topic(publication, before);
  for (const auto& [name, topic] : before) participant_.remove_writer(topic.writer);
  tell_graph();
  taken_ns_ = attach::wall_ns();
  write(std::string(kTfStatic),
        moved(world::ros_frame::kBase, world::ros_frame::kRobot, world::ros_frame::kTaktInRos, taken_ns_));
  fmt::print(stderr, "takt ros2: follows {}, process {}: {} topics\n", graph->value("name", ""), graph->value("pid", 0),
             topics_.size());
  return {};
}

/// A writer that is there already stays, so that its readers do.
void Publisher::offer_topic(const Publication& publication, std::map<std::string, Topic>& before) {
  if (topics_.contains(publication.topic)) return;
  if (const auto old = before.find(publication.topic); old != before.end()) {
    if (old->second.publication.schema == publication.schema) {
      topics_[publication.topic] = old->second;
      before.erase(old);
      return;
    }
  }
  topics_[publication.topic] = {publication, participant_.add_writer(endpoint_of(publication)), false};
}

void Publisher::tell_graph() {
  std::vector<dds::Guid> writers;
  for (const auto& [name, topic] : topics_) writers.push_back(participant_.guid_of(topic.writer));
  participant_.write(graph_writer_, entities(options_.name_space, participant_.guid(), writers), attach::wall_ns());
}

bool Publisher::is_matched(const std::string& topic) const {
  const auto found = topics_.find(topic);
  return found != topics_.end() && found->second.matched;
}

bool Publisher::tell_wishes(attach::Connection& connection) {
  for (auto& [name, topic] : topics_) topic.matched = participant_.readers_of(topic.writer) > 0;
  for (auto& [name, port] : ports_) {
    const bool wanted = std::any_of(port.topics.begin(), port.topics.end(),
                                    [&](const auto& topic) { return is_matched(topic.second); });
    if (wanted == port.asked) continue;
    port.asked = wanted;
    if (!connection.write(wanted ? Json{{"add", name}, {"every_ms", 0}} : Json{{"drop", name}})) return false;
  }
  const bool state = is_matched(std::string(kDiagnostics));
  if (state == state_asked_) return true;
  state_asked_ = state;
  return connection.write({{"state_every_ms", state ? kStateEveryMs : 0}});
}

bool Publisher::take(attach::Connection& connection, const Json& line) {
  if (stamps_.look(attach::wall_ns(), MonotonicClock().now_ns())) ++counts_.clock_steps;
  if (line.contains("state")) {
    write(std::string(kDiagnostics), diagnostics_->of(line.at("state"), taken_ns_));
    return true;
  }
  if (!line.contains("message")) return true;  // a refusal: asked for what is not there
  const auto bytes = connection.read_bytes(line.value("bytes", size_t{0}));
  if (!bytes) return false;
  const std::string name = line.value("message", "");
  const auto port = ports_.find(name);
  if (port == ports_.end()) return true;
  if (!port->second.followed.fill({reinterpret_cast<const std::byte*>(bytes->data()), bytes->size()})) {
    ++counts_.unsound;
    return true;
  }
  publish(name, port->second, stamps_.of(line.value("stamp_ns", int64_t{0})));
  return true;
}

void Publisher::publish(const std::string& name, Port& port, int64_t stamp_ns) {
  const auto wanted = [&](std::string_view form) {
    const auto topic = port.topics.find(std::string(form));
    return topic != port.topics.end() && is_matched(topic->second);
  };
  const std::string node = name.substr(0, name.find('.'));
  const MessageType& type = *port.followed.type;
  for (const world::Form& form : encoder_.forms(type, port.followed.memory.get(), node, stamp_ns, wanted))
    write(port.topics[form.topic], form.bytes);
  if (name == odometry_ || name == options_.map_pose) publish_map(name, port, stamp_ns);
}

/// REP 105: the drift of odom in map, so that base_link has one parent.
void Publisher::publish_map(const std::string& name, const Port& port, int64_t stamp_ns) {
  const void* message = port.followed.memory.get();
  if (name == odometry_) {
    base_in_odometry_ = world::base_in_odometry(*static_cast<const Odometry*>(message));
    return;
  }
  if (!base_in_odometry_ || !is_matched(std::string(kTf))) return;
  const Transform base = world::chained(static_cast<const Pose*>(message)->transform, world::ros_frame::kRosInTakt);
  write(std::string(kTf),
        moved("map", world::ros_frame::kOdometry, world::chained(base, world::inverted(*base_in_odometry_)), stamp_ns));
}

void Publisher::write(const std::string& topic, std::span<const std::byte> cdr) {
  const auto found = topics_.find(topic);
  if (found == topics_.end() || cdr.empty()) return;
  ++(participant_.write(found->second.writer, cdr, taken_ns_) ? counts_.written : counts_.unsent);
}

std::vector<Publication> whole_run_publications() {
  return {whole_run(kTf, "tf2_msgs/msg/TFMessage"), whole_run(kTfStatic, "tf2_msgs/msg/TFMessage"),
          whole_run(kDiagnostics, "diagnostic_msgs/msg/DiagnosticArray")};
}

}  // namespace takt::ros2
