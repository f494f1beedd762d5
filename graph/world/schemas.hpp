// SPDX-License-Identifier: Apache-2.0
// The schemas that other programs know: those of Foxglove, as ROS 2 messages, and what they use.
//
//   encoded(PoseInFrame{time_of(stamp_ns), "map", pose_of(transform)});
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include "graph/world/schema.hpp"
#include "rt/log_line.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/point.hpp"

namespace takt::world {

struct Time {
  int32_t sec = 0;
  uint32_t nanosec = 0;
  TAKT_SCHEMA(Time, "builtin_interfaces/Time", sec, nanosec)
};
struct Duration {
  int32_t sec = 0;
  uint32_t nanosec = 0;
  TAKT_SCHEMA(Duration, "builtin_interfaces/Duration", sec, nanosec)
};
struct Position {
  double x = 0, y = 0, z = 0;
  TAKT_SCHEMA(Position, "geometry_msgs/Point", x, y, z)
};
struct Vector3 {
  double x = 0, y = 0, z = 0;
  TAKT_SCHEMA(Vector3, "geometry_msgs/Vector3", x, y, z)
};
struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
  TAKT_SCHEMA(Quaternion, "geometry_msgs/Quaternion", x, y, z, w)
};
struct PoseOf {
  Position position;
  Quaternion orientation;
  TAKT_SCHEMA(PoseOf, "geometry_msgs/Pose", position, orientation)
};

/// Saturates where its seconds do not fit.
Time time_of(int64_t ns);
PoseOf pose_of(const Transform& transform);
Quaternion rotation_of(const Transform& transform);

/// Rows of an image without what lies between them.
struct Rows {
  using Element = uint8_t;
  const std::byte* first = nullptr;
  size_t rows = 0, bytes_a_row = 0;
  ptrdiff_t step_bytes = 0;  ///< from one row to the next
  template <class T>
  static Rows of(const ImageView<const T>& image) {
    return {reinterpret_cast<const std::byte*>(image.data), static_cast<size_t>(image.height),
            static_cast<size_t>(image.width) * static_cast<size_t>(image.channels) * sizeof(T),
            image.stride * static_cast<ptrdiff_t>(sizeof(T))};
  }
  size_t size() const { return rows * bytes_a_row; }
  void fill(std::byte* to) const {
    if (bytes_a_row == 0) return;
    for (size_t row = 0; row < rows; ++row)
      std::memcpy(to + row * bytes_a_row, first + static_cast<ptrdiff_t>(row) * step_bytes, bytes_a_row);
  }
};

/// Points with their colours, 16 bytes each: x, y, z, then the bytes of the colour.
struct PackedPoints {
  using Element = uint8_t;
  static constexpr size_t kStride = 16;
  enum class Order : uint8_t {
    rgba,  ///< opaque
    bgr0,  ///< what RViz and PCL read as `rgb`
  };
  std::span<const Point> points;
  std::span<const Colour> colours;  ///< of the first points; the others are white
  Order order = Order::rgba;
  size_t size() const { return points.size() * kStride; }
  void fill(std::byte* to) const;
};

/// Numbers that a schema wants in double precision.
struct Widened {
  using Element = double;
  std::span<const float> values;
  size_t size() const { return values.size(); }
  void fill(std::byte* to) const;
};

struct CompressedImage {
  Time timestamp;
  std::string_view frame_id;
  std::span<const uint8_t> data;
  std::string_view format;
  TAKT_SCHEMA(CompressedImage, "foxglove_msgs/CompressedImage", timestamp, frame_id, data, format)
};
struct RawImage {
  Time timestamp;
  std::string_view frame_id;
  uint32_t width = 0, height = 0;
  std::string_view encoding;
  uint32_t step = 0;
  Rows data;
  TAKT_SCHEMA(RawImage, "foxglove_msgs/RawImage", timestamp, frame_id, width, height, encoding, step, data)
};
struct CameraCalibration {
  Time timestamp;
  std::string_view frame_id;
  uint32_t width = 0, height = 0;
  std::string_view distortion_model;
  std::span<const double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  TAKT_SCHEMA(CameraCalibration, "foxglove_msgs/CameraCalibration", timestamp, frame_id, width, height,
              distortion_model, d, k, r, p)
};

/// PackedElementField::type.
enum class Numeric : uint8_t { u8 = 1, i16 = 4, f32 = 7 };
struct PackedElementField {
  std::string_view name;
  uint32_t offset = 0;
  uint8_t type = 0;
  constexpr PackedElementField() = default;
  constexpr PackedElementField(std::string_view name_, uint32_t offset_, Numeric type_)
      : name(name_), offset(offset_), type(static_cast<uint8_t>(type_)) {}
  TAKT_SCHEMA(PackedElementField, "foxglove_msgs/PackedElementField", name, offset, type)
};
struct CloudOfPoints {
  Time timestamp;
  std::string_view frame_id;
  PoseOf pose;
  uint32_t point_stride = 0;
  std::span<const PackedElementField> fields;
  PackedPoints data;
  TAKT_SCHEMA(CloudOfPoints, "foxglove_msgs/PointCloud", timestamp, frame_id, pose, point_stride, fields, data)
};
struct Scan {
  Time timestamp;
  std::string_view frame_id;
  PoseOf pose;
  double start_angle = 0, end_angle = 0;
  Widened ranges;
  std::span<const double> intensities;
  TAKT_SCHEMA(Scan, "foxglove_msgs/LaserScan", timestamp, frame_id, pose, start_angle, end_angle, ranges, intensities)
};
struct Vector2 {
  double x = 0, y = 0;
  TAKT_SCHEMA(Vector2, "foxglove_msgs/Vector2", x, y)
};
struct GridOfCells {
  Time timestamp;
  std::string_view frame_id;
  PoseOf pose;
  uint32_t column_count = 0;
  Vector2 cell_size;
  uint32_t row_stride = 0, cell_stride = 0;
  std::span<const PackedElementField> fields;
  Rows data;
  TAKT_SCHEMA(GridOfCells, "foxglove_msgs/Grid", timestamp, frame_id, pose, column_count, cell_size, row_stride,
              cell_stride, fields, data)
};
struct PoseInFrame {
  Time timestamp;
  std::string_view frame_id;
  PoseOf pose;
  TAKT_SCHEMA(PoseInFrame, "foxglove_msgs/PoseInFrame", timestamp, frame_id, pose)
};
struct PosesInFrame {
  Time timestamp;
  std::string_view frame_id;
  std::span<const PoseOf> poses;
  TAKT_SCHEMA(PosesInFrame, "foxglove_msgs/PosesInFrame", timestamp, frame_id, poses)
};
struct FrameTransform {
  Time timestamp;
  std::string_view parent_frame_id, child_frame_id;
  Vector3 translation;
  Quaternion rotation;
  TAKT_SCHEMA(FrameTransform, "foxglove_msgs/FrameTransform", timestamp, parent_frame_id, child_frame_id, translation,
              rotation)
};
struct FrameTransforms {
  std::span<const FrameTransform> transforms;
  TAKT_SCHEMA(FrameTransforms, "foxglove_msgs/FrameTransforms", transforms)
};

/// Log::level
constexpr uint8_t number_of(LogLevel level) { return static_cast<uint8_t>(static_cast<uint8_t>(level) + 1); }
struct Log {
  Time timestamp;
  uint8_t level = number_of(LogLevel::info);
  std::string_view message, name, file;
  uint32_t line = 0;
  TAKT_SCHEMA(Log, "foxglove_msgs/Log", timestamp, level, message, name, file, line)
};

}  // namespace takt::world
