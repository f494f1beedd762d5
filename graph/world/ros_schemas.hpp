// SPDX-License-Identifier: Apache-2.0
// The messages that every ROS 2 has (common_interfaces, geometry2, vision_msgs 4), as schemas: their members in the
// order of the .msg files, so that their CDR is what a ROS 2 node reads.
//
//   encoded(ros::Odometry{{time_of(stamp_ns), "odom"}, "base_link", {pose_of(pose)}, {}});
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "graph/world/schemas.hpp"

namespace takt::world::ros {

struct Header {
  Time stamp;
  std::string_view frame_id;
  TAKT_SCHEMA(Header, "std_msgs/Header", stamp, frame_id)
};
struct String {
  std::string_view data;
  TAKT_SCHEMA(String, "std_msgs/String", data)
};
struct Clock {
  Time clock;
  TAKT_SCHEMA(Clock, "rosgraph_msgs/Clock", clock)
};

struct Image {
  Header header;
  uint32_t height = 0, width = 0;
  std::string_view encoding;
  uint8_t is_bigendian = 0;
  uint32_t step = 0;
  Rows data;
  TAKT_SCHEMA(Image, "sensor_msgs/Image", header, height, width, encoding, is_bigendian, step, data)
};
struct CompressedImage {
  Header header;
  std::string_view format;
  std::span<const uint8_t> data;
  TAKT_SCHEMA(CompressedImage, "sensor_msgs/CompressedImage", header, format, data)
};
struct RegionOfInterest {
  uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;
  bool do_rectify = false;
  TAKT_SCHEMA(RegionOfInterest, "sensor_msgs/RegionOfInterest", x_offset, y_offset, height, width, do_rectify)
};
struct CameraInfo {
  Header header;
  uint32_t height = 0, width = 0;
  std::string_view distortion_model;
  std::span<const double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi;
  TAKT_SCHEMA(CameraInfo, "sensor_msgs/CameraInfo", header, height, width, distortion_model, d, k, r, p, binning_x,
              binning_y, roi)
};

/// PointField::datatype.
constexpr uint8_t kFloat32 = 7;
struct PointField {
  std::string_view name;
  uint32_t offset = 0;
  uint8_t datatype = 0;
  uint32_t count = 1;
  TAKT_SCHEMA(PointField, "sensor_msgs/PointField", name, offset, datatype, count)
};
struct PointCloud2 {
  Header header;
  uint32_t height = 1, width = 0;
  std::span<const PointField> fields;
  bool is_bigendian = false;
  uint32_t point_step = 0, row_step = 0;
  PackedPoints data;  ///< bgr0
  bool is_dense = false;
  TAKT_SCHEMA(PointCloud2, "sensor_msgs/PointCloud2", header, height, width, fields, is_bigendian, point_step, row_step,
              data, is_dense)
};

/// Ranges of a scan: without a return they are infinite, as REP 117 has it.
struct Returns {
  using Element = float;
  std::span<const float> range_m;  ///< 0: no return
  size_t size() const { return range_m.size(); }
  void fill(std::byte* to) const;
};
struct LaserScan {
  Header header;
  float angle_min = 0, angle_max = 0, angle_increment = 0, time_increment = 0, scan_time = 0, range_min = 0,
        range_max = 0;
  Returns ranges;
  std::span<const float> intensities;
  TAKT_SCHEMA(LaserScan, "sensor_msgs/LaserScan", header, angle_min, angle_max, angle_increment, time_increment,
              scan_time, range_min, range_max, ranges, intensities)
};

struct PoseWithCovariance {
  PoseOf pose;
  std::array<double, 36> covariance{};
  TAKT_SCHEMA(PoseWithCovariance, "geometry_msgs/PoseWithCovariance", pose, covariance)
};
struct PoseWithCovarianceStamped {
  Header header;
  PoseWithCovariance pose;
  TAKT_SCHEMA(PoseWithCovarianceStamped, "geometry_msgs/PoseWithCovarianceStamped", header, pose)
};
struct PoseStamped {
  Header header;
  PoseOf pose;
  TAKT_SCHEMA(PoseStamped, "geometry_msgs/PoseStamped", header, pose)
};
struct Twist {
  Vector3 linear, angular;
  TAKT_SCHEMA(Twist, "geometry_msgs/Twist", linear, angular)
};
struct TwistWithCovariance {
  Twist twist;
  std::array<double, 36> covariance{};
  TAKT_SCHEMA(TwistWithCovariance, "geometry_msgs/TwistWithCovariance", twist, covariance)
};
struct Odometry {
  Header header;
  std::string_view child_frame_id;
  PoseWithCovariance pose;
  TwistWithCovariance twist;
  TAKT_SCHEMA(Odometry, "nav_msgs/Odometry", header, child_frame_id, pose, twist)
};

struct MapMetaData {
  Time map_load_time;
  float resolution = 0;
  uint32_t width = 0, height = 0;
  PoseOf origin;
  TAKT_SCHEMA(MapMetaData, "nav_msgs/MapMetaData", map_load_time, resolution, width, height, origin)
};
/// Cells of a grid in percent: 0 free to 100 occupied, -1 unknown.
struct Percent {
  using Element = int8_t;
  ImageView<const int16_t> cells;  ///< 0 free to 1000 occupied, negative: unknown
  size_t size() const { return static_cast<size_t>(cells.width) * static_cast<size_t>(cells.height); }
  void fill(std::byte* to) const;
};
struct OccupancyGrid {
  Header header;
  MapMetaData info;
  Percent data;
  TAKT_SCHEMA(OccupancyGrid, "nav_msgs/OccupancyGrid", header, info, data)
};

struct TransformOf {
  Vector3 translation;
  Quaternion rotation;
  TAKT_SCHEMA(TransformOf, "geometry_msgs/Transform", translation, rotation)
};
struct TransformStamped {
  Header header;
  std::string_view child_frame_id;
  TransformOf transform;
  TAKT_SCHEMA(TransformStamped, "geometry_msgs/TransformStamped", header, child_frame_id, transform)
};
struct TFMessage {
  std::span<const TransformStamped> transforms;
  TAKT_SCHEMA(TFMessage, "tf2_msgs/TFMessage", transforms)
};

struct KeyValue {
  std::string_view key, value;
  TAKT_SCHEMA(KeyValue, "diagnostic_msgs/KeyValue", key, value)
};
/// DiagnosticStatus::level.
enum class Health : uint8_t { ok, warn, error, stale };
struct DiagnosticStatus {
  std::byte level{};
  std::string_view name, message, hardware_id;
  std::span<const KeyValue> values;
  TAKT_SCHEMA(DiagnosticStatus, "diagnostic_msgs/DiagnosticStatus", level, name, message, hardware_id, values)
};
struct DiagnosticArray {
  Header header;
  std::span<const DiagnosticStatus> status;
  TAKT_SCHEMA(DiagnosticArray, "diagnostic_msgs/DiagnosticArray", header, status)
};

struct ObjectHypothesis {
  std::string_view class_id;
  double score = 0;
  TAKT_SCHEMA(ObjectHypothesis, "vision_msgs/ObjectHypothesis", class_id, score)
};
struct ObjectHypothesisWithPose {
  ObjectHypothesis hypothesis;
  PoseWithCovariance pose;
  TAKT_SCHEMA(ObjectHypothesisWithPose, "vision_msgs/ObjectHypothesisWithPose", hypothesis, pose)
};
struct Point2D {
  double x = 0, y = 0;
  TAKT_SCHEMA(Point2D, "vision_msgs/Point2D", x, y)
};
struct Pose2D {
  Point2D position;
  double theta = 0;
  TAKT_SCHEMA(Pose2D, "vision_msgs/Pose2D", position, theta)
};
struct BoundingBox2D {
  Pose2D center;
  double size_x = 0, size_y = 0;
  TAKT_SCHEMA(BoundingBox2D, "vision_msgs/BoundingBox2D", center, size_x, size_y)
};
struct Detection2D {
  Header header;
  std::span<const ObjectHypothesisWithPose> results;
  BoundingBox2D bbox;
  std::string_view id;
  TAKT_SCHEMA(Detection2D, "vision_msgs/Detection2D", header, results, bbox, id)
};
struct Detection2DArray {
  Header header;
  std::span<const Detection2D> detections;
  TAKT_SCHEMA(Detection2DArray, "vision_msgs/Detection2DArray", header, detections)
};
struct BoundingBox3D {
  PoseOf center;
  Vector3 size;
  TAKT_SCHEMA(BoundingBox3D, "vision_msgs/BoundingBox3D", center, size)
};
struct Detection3D {
  Header header;
  std::span<const ObjectHypothesisWithPose> results;
  BoundingBox3D bbox;
  std::string_view id;
  TAKT_SCHEMA(Detection3D, "vision_msgs/Detection3D", header, results, bbox, id)
};
struct Detection3DArray {
  Header header;
  std::span<const Detection3D> detections;
  TAKT_SCHEMA(Detection3DArray, "vision_msgs/Detection3DArray", header, detections)
};

/// Of an endpoint of DDS, as ROS 2 writes it since Iron: 16 bytes. Humble and before had 24.
struct Gid {
  std::array<uint8_t, 16> data{};
  TAKT_SCHEMA(Gid, "rmw_dds_common/Gid", data)
};
struct NodeEntitiesInfo {
  std::string_view node_namespace, node_name;
  std::span<const Gid> reader_gid_seq, writer_gid_seq;
  TAKT_SCHEMA(NodeEntitiesInfo, "rmw_dds_common/NodeEntitiesInfo", node_namespace, node_name, reader_gid_seq,
              writer_gid_seq)
};
struct ParticipantEntitiesInfo {
  Gid gid;
  std::span<const NodeEntitiesInfo> node_entities_info_seq;
  TAKT_SCHEMA(ParticipantEntitiesInfo, "rmw_dds_common/ParticipantEntitiesInfo", gid, node_entities_info_seq)
};

/// What RosEncoder and the topics of a whole run are made of.
using Messages = std::tuple<Image, CompressedImage, CameraInfo, PointCloud2, LaserScan, Odometry, PoseStamped,
                            PoseWithCovarianceStamped, OccupancyGrid, TFMessage, DiagnosticArray, Detection2DArray,
                            Detection3DArray, String, Clock>;

}  // namespace takt::world::ros
