// SPDX-License-Identifier: Apache-2.0
// What a message shows of itself (rt/msg/viewer.hpp), as values of ROS 2's messages. The sink is that of shown.hpp.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "graph/world/ros_encoder.hpp"
#include "graph/world/ros_schemas.hpp"
#include "rt/msg/viewer.hpp"
#include "rt/record/jpeg_compressor.hpp"

namespace takt::world {

template <class Sink>
class RosShown final : public Viewer {
 public:
  RosShown(Sink& sink, std::string_view node, int64_t stamp_ns, int jpeg_quality)
      : sink_(sink), node_(node), time_(time_of(stamp_ns)), jpeg_(jpeg_quality) {}

  void picture(const ImageView<const uint8_t>& image, std::string_view part) override {
    if (std::min(image.width, image.height) <= 0 || (image.channels != 1 && image.channels != 3)) return;
    const std::string topic = below(part, "image_raw");
    raw_image(image, image.channels == 3 ? "bgr8" : "mono8", topic);
    if (!sink_.wants(topic + "/compressed", ros::CompressedImage::schema_name)) return;
    const auto jpeg = jpeg_.compress(image);
    if (!jpeg.empty()) sink_.take(topic + "/compressed", ros::CompressedImage{own_frame(), "jpeg", jpeg});
  }
  /// 16UC1: 65535 where the disparity is invalid.
  void disparity(const ImageView<const int16_t>& map, int) override {
    if (std::min(map.width, map.height) > 0) raw_image(map, "16UC1", "image_raw");
  }
  void cloud(std::span<const Point> points, std::span<const Colour> colours) override {
    static constexpr ros::PointField kFields[]{{"x", 0, ros::kFloat32, 1},
                                               {"y", 4, ros::kFloat32, 1},
                                               {"z", 8, ros::kFloat32, 1},
                                               {"rgb", 12, ros::kFloat32, 1}};
    const auto count = static_cast<uint32_t>(points.size());
    show("", [&] {
      constexpr uint32_t kStep = PackedPoints::kStride;
      return ros::PointCloud2{own_frame(), 1,     count,         kFields,
                              false,       kStep, count * kStep, {points, colours, PackedPoints::Order::bgr0},
                              true};
    });
  }
  void scan(const Viewer::Scan& scan) override {
    scan_ = true;
    show("", [&] {
      const double steps = scan.range_m.empty() ? 0 : static_cast<double>(scan.range_m.size() - 1);
      const auto f = [](double value) { return static_cast<float>(value); };
      return ros::LaserScan{own_frame(),
                            f(scan.first_angle_rad),
                            f(scan.first_angle_rad + steps * scan.step_rad),
                            f(scan.step_rad),
                            f(steps > 0 ? scan.sweep_s / steps : 0),
                            0,
                            0,
                            f(scan.max_range_m > 0 ? scan.max_range_m : farthest(scan.range_m)),
                            {scan.range_m},
                            {}};
    });
  }
  void grid(const Cells& grid) override {
    if (std::min(grid.cells.width, grid.cells.height) <= 0) return;
    show("", [&] {
      return ros::OccupancyGrid{
          {time_, ros_frame::kRobot},
          {time_, static_cast<float>(grid.cell_m), static_cast<uint32_t>(grid.cells.width),
           static_cast<uint32_t>(grid.cells.height), pose_of({.x = grid.origin_x_m, .y = grid.origin_y_m})},
          {grid.cells}};
    });
  }
  void pose(const Transform& pose, std::string_view frame) override {
    show("", [&] {
      return ros::PoseStamped{{time_, ros_frame::name(frame)}, pose_of(chained(pose, ros_frame::kRosInTakt))};
    });
  }
  void text(std::string_view text) override {
    show("", [&] { return ros::String{text}; });
  }
  void mounted(const Transform& sensor_in_robot) override {
    // The beams of a scan count from the x axis in ROS 2, from the y axis here.
    transform(ros_frame::kRobot, node_, scan_ ? chained(sensor_in_robot, ros_frame::kRosInTakt) : sensor_in_robot);
  }
  void camera(const Camera& camera, std::string_view part) override {
    if (std::min(camera.width, camera.height) <= 0) return;
    show(below(part, "camera_info"), [&] {
      static constexpr double kNone[5]{};  // it is rectified
      const auto& [f, u, v, baseline_m] = camera.model;
      return ros::CameraInfo{own_frame(),
                             static_cast<uint32_t>(camera.height),
                             static_cast<uint32_t>(camera.width),
                             "plumb_bob",
                             kNone,
                             {f, 0, u, 0, f, v, 0, 0, 1},
                             {1, 0, 0, 0, 1, 0, 0, 0, 1},
                             {f, 0, u, -f * camera.right_of_first_m, 0, f, v, 0, 0, 0, 1, 0},
                             0,
                             0,
                             {}};
    });
  }
  void things(std::span<const Thing> things, std::string_view frame) override {
    show("", [&] {
      const ros::Header header{time_, ros_frame::name(frame)};
      hypotheses_.resize(things.size());
      boxes_.clear();
      for (size_t i = 0; i < things.size(); ++i) {
        const Thing& thing = things[i];
        const PoseOf pose = pose_of(thing.pose);
        hypotheses_[i] = {{thing.name, thing.confidence}, {pose, {}}};
        boxes_.push_back(
            {header, {&hypotheses_[i], 1}, {pose, {thing.length_m, thing.width_m, thing.height_m}}, thing.name});
      }
      return ros::Detection3DArray{header, boxes_};
    });
  }
  /// `child` seen from `parent`, for /tf.
  void transform(std::string_view parent, std::string_view child, const Transform& t) {
    show("/tf", [&] {
      moved_ = {{time_, parent}, child, {{t.x, t.y, t.z}, rotation_of(t)}};
      return ros::TFMessage{{&moved_, 1}};
    });
  }
  template <class Make>
  void show(const std::string& topic, const Make& make) {
    if (sink_.wants(topic, decltype(make())::schema_name)) sink_.take(topic, make());
  }
  Time time() const { return time_; }
  ros::Header own_frame() const { return {time_, node_}; }

 private:
  static std::string below(std::string_view part, std::string_view name) {
    return std::string(part) + (part.empty() ? "" : "/") + std::string(name);
  }
  static double farthest(std::span<const float> range_m) {
    return range_m.empty() ? 0 : static_cast<double>(*std::max_element(range_m.begin(), range_m.end()));
  }
  template <class T>
  void raw_image(const ImageView<const T>& image, std::string_view encoding, const std::string& topic) {
    const Rows rows = Rows::of(image);
    show(topic, [&] {
      return ros::Image{own_frame(),
                        static_cast<uint32_t>(image.height),
                        static_cast<uint32_t>(image.width),
                        encoding,
                        0,
                        static_cast<uint32_t>(rows.bytes_a_row),
                        rows};
    });
  }

  Sink& sink_;
  std::string_view node_;
  Time time_;
  record::JpegCompressor jpeg_;
  bool scan_ = false;
  ros::TransformStamped moved_;
  std::vector<ros::ObjectHypothesisWithPose> hypotheses_;
  std::vector<ros::Detection3D> boxes_;
};

}  // namespace takt::world
