// SPDX-License-Identifier: Apache-2.0
// What a message shows of itself (rt/msg/viewer.hpp), as values of the well-known schemas. What becomes of them, a sink
// decides: CDR (encoder.cpp), JSON (graph/log/foxglove.cpp).
//
//   struct Sink {
//     bool wants(const std::string& topic, std::string_view schema);  // false: do not even make it
//     template <Schema S> void take(const std::string& topic, const S& value);  // which is valid during the call
//   } sink;
//   Shown shown(sink, "front_laser", stamp_ns, 75);
//   type.show(message, shown);
//   if (shown.fields_say_more()) ...  // a form by the message's own fields belongs to topic ""
#pragma once
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "graph/world/scene.hpp"
#include "graph/world/schemas.hpp"
#include "rt/msg/viewer.hpp"
#include "rt/record/jpeg_compressor.hpp"

namespace takt::world {

template <class Sink>
class Shown final : public Viewer {
 public:
  /// `jpeg_quality`: 0: pictures as RawImage.
  Shown(Sink& sink, std::string_view node, int64_t stamp_ns, int jpeg_quality)
      : sink_(sink), node_(node), time_(time_of(stamp_ns)), quality_(jpeg_quality), jpeg_(jpeg_quality) {}

  /// Things were shown, and nothing that stands for the whole message.
  bool fields_say_more() const { return things_ && !whole_; }

  void picture(const ImageView<const uint8_t>& image, std::string_view part) override {
    whole_ = true;
    if (std::min(image.width, image.height) <= 0 || (image.channels != 1 && image.channels != 3)) return;
    if (quality_ == 0) return raw_image(image, image.channels == 3 ? "bgr8" : "mono8", suffix(part), "picture");
    const auto topic = wanted<CompressedImage>(suffix(part), "picture");
    if (!topic) return;
    const auto jpeg = jpeg_.compress(image);
    if (!jpeg.empty()) sink_.take(*topic, CompressedImage{time_, node_, jpeg, "jpeg"});
  }
  /// 16UC1: 65535 where the disparity is invalid.
  void disparity(const ImageView<const int16_t>& map, int) override {
    whole_ = true;
    if (std::min(map.width, map.height) > 0) raw_image(map, "16UC1", "", "disparity");
  }
  void cloud(std::span<const Point> points, std::span<const Colour> colours) override {
    static constexpr PackedElementField kFields[]{
        {"x", 0, Numeric::f32},     {"y", 4, Numeric::f32},    {"z", 8, Numeric::f32},    {"red", 12, Numeric::u8},
        {"green", 13, Numeric::u8}, {"blue", 14, Numeric::u8}, {"alpha", 15, Numeric::u8}};
    whole_ = true;
    show("", "cloud", [&] {
      return CloudOfPoints{time_, node_, {}, PackedPoints::kStride, kFields, {points, colours}};
    });
  }
  void scan(const Viewer::Scan& scan) override {
    whole_ = true;
    const auto steps = static_cast<double>(scan.range_m.empty() ? 0 : scan.range_m.size() - 1);
    show("", "scan", [&] {
      return world::Scan{time_,          node_, {}, scan.first_angle_rad, scan.first_angle_rad + steps * scan.step_rad,
                         {scan.range_m}, {}};
    });
  }
  void grid(const Cells& grid) override {
    static constexpr PackedElementField kFields[]{{"occupancy", 0, Numeric::i16}};  // as Cells::cells
    whole_ = true;
    if (std::min(grid.cells.width, grid.cells.height) <= 0) return;
    const auto columns = static_cast<uint32_t>(grid.cells.width);
    show("", "grid", [&] {
      return GridOfCells{time_,
                         "robot",
                         pose_of({.x = grid.origin_x_m, .y = grid.origin_y_m}),
                         columns,
                         {grid.cell_m, grid.cell_m},
                         columns * uint32_t{sizeof(int16_t)},
                         sizeof(int16_t),
                         kFields,
                         Rows::of(grid.cells)};
    });
  }
  void pose(const Transform& pose, std::string_view frame) override {
    whole_ = true;
    show("", "pose", [&] { return PoseInFrame{time_, frame, pose_of(pose)}; });
  }
  void text(std::string_view text) override {
    whole_ = true;
    show("", "text", [&] { return Log{time_, number_of(LogLevel::info), text, node_, "", 0}; });
  }
  void mounted(const Transform& sensor_in_robot) override {
    const Transform& t = sensor_in_robot;
    show("/tf", "mount", [&] { return FrameTransform{time_, "robot", node_, {t.x, t.y, t.z}, rotation_of(t)}; });
  }
  void camera(const Camera& camera, std::string_view part) override {
    if (std::min(camera.width, camera.height) <= 0) return;
    const auto& [f, u, v, baseline_m] = camera.model;
    const std::array<double, 9> k{f, 0, u, 0, f, v, 0, 0, 1};
    const std::array<double, 12> p{f, 0, u, -f * camera.right_of_first_m, 0, f, v, 0, 0, 0, 1, 0};
    static constexpr double kNone[5]{};  // it is rectified
    show(suffix(part) + ".calibration", "calibration", [&] {
      return CameraCalibration{time_,
                               node_,
                               static_cast<uint32_t>(camera.width),
                               static_cast<uint32_t>(camera.height),
                               "plumb_bob",
                               kNone,
                               k,
                               {1, 0, 0, 0, 1, 0, 0, 0, 1},
                               p};
    });
  }
  void things(std::span<const Thing> things, std::string_view frame) override {
    things_ = true;
    const auto topic = wanted<SceneUpdate>(".scene", "scene");
    if (topic) sink_.take(*topic, Scene(things, frame, time_).update());
  }

 private:
  static std::string suffix(std::string_view part) { return (part.empty() ? "" : ".") + std::string(part); }

  template <class T>
  void raw_image(const ImageView<const T>& image, std::string_view encoding, std::string topic, std::string_view kind) {
    const Rows rows = Rows::of(image);
    show(std::move(topic), kind, [&] {
      return RawImage{time_,
                      node_,
                      static_cast<uint32_t>(image.width),
                      static_cast<uint32_t>(image.height),
                      encoding,
                      static_cast<uint32_t>(rows.bytes_a_row),
                      rows};
    });
  }

  /// The topic of a form, if it is wanted. Two forms of a message have two topics.
  template <Schema S>
  std::optional<std::string> wanted(std::string topic, std::string_view kind) {
    for (int i = 1; std::find(topics_.begin(), topics_.end(), topic) != topics_.end(); ++i)
      topic += i == 1 ? "." + std::string(kind) : "." + std::to_string(i);
    topics_.push_back(topic);
    if (!sink_.wants(topic, S::schema_name)) return std::nullopt;
    return topic;
  }

  template <class Make>
  void show(std::string topic, std::string_view kind, const Make& make) {
    if (const auto free = wanted<decltype(make())>(std::move(topic), kind)) sink_.take(*free, make());
  }

  Sink& sink_;
  std::string_view node_;
  Time time_;
  int quality_;
  record::JpegCompressor jpeg_;
  std::vector<std::string> topics_;  ///< so far
  bool whole_ = false, things_ = false;
};

}  // namespace takt::world
