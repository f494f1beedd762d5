// SPDX-License-Identifier: Apache-2.0
#include "graph/world/ros_encoder.hpp"

#include <cmath>
#include <tuple>

#include "graph/world/ros_shown.hpp"
#include "graph/world/sinks.hpp"
#include "graph/world/type_description.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/pose.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt::world {
namespace {

/// ROS 2 has more to say of it than a pose.
template <class Sink>
void show_odometry(const Odometry& odometry, RosShown<Sink>& shown) {
  const Transform base = base_in_odometry(odometry);
  shown.show("", [&] {
    return ros::Odometry{{shown.time(), ros_frame::kOdometry},
                         ros_frame::kBase,
                         {pose_of(base), {}},
                         {{{odometry.speed_m_s, 0, 0}, {0, 0, odometry.turn_rad_s}}, {}}};
  });
  shown.transform(ros_frame::kOdometry, ros_frame::kBase, base);
}

template <class Sink>
void show_pose(const Pose& pose, RosShown<Sink>& shown) {
  shown.show("", [&] {
    ros::PoseWithCovarianceStamped value{{shown.time(), "map"},
                                         {pose_of(chained(pose.transform, ros_frame::kRosInTakt)), {}}};
    std::copy(std::begin(pose.covariance), std::end(pose.covariance), value.pose.covariance.begin());
    return value;
  });
}

template <class Sink>
void show_detections(const Detections& detections, RosShown<Sink>& shown) {
  std::vector<std::string> classes;
  std::vector<ros::ObjectHypothesisWithPose> hypotheses;
  std::vector<ros::Detection2D> boxes;
  shown.show("", [&] {
    for (const Detection& box : detections.boxes.items())
      classes.push_back(std::to_string(static_cast<int>(box.class_id)));
    for (size_t i = 0; i < classes.size(); ++i)
      hypotheses.push_back({{classes[i], static_cast<double>(detections.boxes[i].score)}, {}});
    for (size_t i = 0; i < classes.size(); ++i) {
      const Detection& box = detections.boxes[i];
      const double width = box.width_px, height = box.height_px;
      boxes.push_back({shown.own_frame(),
                       {&hypotheses[i], 1},
                       {{{box.x_px + width / 2, box.y_px + height / 2}, 0}, width, height},
                       {}});
    }
    return ros::Detection2DArray{shown.own_frame(), boxes};
  });
}

template <class Sink>
void show_message(const MessageType& type, const void* message, Sink& sink, std::string_view node, int64_t stamp_ns,
                  int quality) {
  RosShown<Sink> shown(sink, node, stamp_ns, quality);
  if (type.name == Odometry::type_name) return show_odometry(*static_cast<const Odometry*>(message), shown);
  if (type.name == Pose::type_name) return show_pose(*static_cast<const Pose*>(message), shown);
  if (type.name == Detections::type_name) return show_detections(*static_cast<const Detections*>(message), shown);
  if (type.show != nullptr) type.show(message, shown);
}

/// What `of` makes of the message with that name; empty: there is none.
template <class... S, class Of>
std::string of_message(std::string_view schema, const std::tuple<S...>*, const Of& of) {
  std::string text;
  (void)((full_name(S::schema_name) == schema && (text = of(std::type_identity<S>{}), true)) || ...);
  return text;
}
constexpr const ros::Messages* kMessages = nullptr;

bool may_show(const MessageType& type, const void* message) { return type.sound == nullptr || type.sound(message); }

}  // namespace

std::string_view ros_frame::name(std::string_view takt_frame) {
  return takt_frame == "odometry" ? kOdometry : takt_frame;
}

std::vector<Form> RosEncoder::forms(const MessageType& type, const void* message, std::string_view node,
                                    int64_t stamp_ns, const Wanted& wanted) const {
  FormSink sink{wanted};
  if (may_show(type, message)) show_message(type, message, sink, node, stamp_ns, options_.jpeg_quality);
  return std::move(sink.forms);
}

std::vector<Outline> RosEncoder::outline(const MessageType& type, const void* message) const {
  OutlineSink sink;
  if (may_show(type, message)) show_message(type, message, sink, "", 0, options_.jpeg_quality);
  return std::move(sink.outlines);
}

std::string dds_type_name(std::string_view schema) {
  const size_t first = schema.find('/'), last = schema.rfind('/');
  return std::string(schema.substr(0, first)) + "::msg::dds_::" + std::string(schema.substr(last + 1)) + "_";
}

std::string ros_type_description(std::string_view schema) {
  return of_message(schema, kMessages, []<class S>(std::type_identity<S>) { return type_description<S>(); });
}

std::string ros_definition(std::string_view schema) {
  return of_message(schema, kMessages, []<class S>(std::type_identity<S>) { return definition<S>(); });
}

Transform chained(const Transform& parent, const Transform& child) {
  return compose({parent, {}}, {child, {}}).transform;
}

Transform base_in_odometry(const Odometry& odometry) {
  return {.x = odometry.x_m,
          .y = odometry.y_m,
          .qw = std::cos(odometry.theta_rad / 2),
          .qz = std::sin(odometry.theta_rad / 2)};
}

Transform inverted(const Transform& child_in_parent) { return inverse({child_in_parent, {}}).transform; }

}  // namespace takt::world
