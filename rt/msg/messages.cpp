// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/messages.hpp"

// offsetof on these standard-layout-but-for-deleted-copy structs is well defined with every compiler we support.
#pragma GCC diagnostic ignored "-Winvalid-offsetof"

namespace takt {
namespace {
template <size_t N>
std::span<const Field> as_span(const std::array<Field, N>& fields) {
  return fields;
}
}  // namespace

#define CAMERA_FIELDS(M)                                                                   \
  TAKT_NESTED_FIELD(M, camera, focal_px, "px"), TAKT_NESTED_FIELD(M, camera, cu_px, "px"), \
      TAKT_NESTED_FIELD(M, camera, cv_px, "px"), TAKT_NESTED_FIELD(M, camera, baseline_m, "m")
#define TRANSFORM_FIELDS(M, t)                                                                              \
  TAKT_NESTED_FIELD(M, t, x, "m"), TAKT_NESTED_FIELD(M, t, y, "m"), TAKT_NESTED_FIELD(M, t, z, "m"),        \
      TAKT_NESTED_FIELD(M, t, qw, "1"), TAKT_NESTED_FIELD(M, t, qx, "1"), TAKT_NESTED_FIELD(M, t, qy, "1"), \
      TAKT_NESTED_FIELD(M, t, qz, "1")
#define FIELDS(M, ...)                                                \
  std::span<const Field> M::fields() {                                \
    static constexpr auto list = std::to_array<Field>({__VA_ARGS__}); \
    return as_span(list);                                             \
  }
#define F(M, member, unit) TAKT_FIELD(M, member, unit)

FIELDS(Image, F(Image, width, "px"), F(Image, height, "px"), F(Image, channels, "1"), F(Image, health, ""),
       CAMERA_FIELDS(Image), F(Image, pixels, "1"))
FIELDS(StereoPair, F(StereoPair, width, "px"), F(StereoPair, height, "px"), F(StereoPair, channels, "1"),
       F(StereoPair, health, ""), F(StereoPair, frame_number, "1"), CAMERA_FIELDS(StereoPair),
       TRANSFORM_FIELDS(StereoPair, sensor_in_robot), F(StereoPair, left, "1"), F(StereoPair, right, "1"))
FIELDS(DisparityMap, F(DisparityMap, width, "px"), F(DisparityMap, height, "px"), F(DisparityMap, disparities, "px"),
       CAMERA_FIELDS(DisparityMap), F(DisparityMap, disparity, "px"), F(DisparityMap, confidence, "1"),
       F(DisparityMap, fraction, "1/64 px"))
FIELDS(PointCloud, TRANSFORM_FIELDS(PointCloud, sensor_in_robot), CAMERA_FIELDS(PointCloud),
       F(PointCloud, step_px, "px"), F(PointCloud, points, "m"), F(PointCloud, colours, "1"))
FIELDS(LaserScan, F(LaserScan, first_angle_rad, "rad"), F(LaserScan, step_rad, "rad"), F(LaserScan, max_range_m, "m"),
       F(LaserScan, sweep_s, "s"), F(LaserScan, scan_number, "1"), TRANSFORM_FIELDS(LaserScan, sensor_in_robot),
       F(LaserScan, range_m, "m"))
FIELDS(Odometry, F(Odometry, x_m, "m"), F(Odometry, y_m, "m"), F(Odometry, theta_rad, "rad"),
       F(Odometry, speed_m_s, "m/s"), F(Odometry, turn_rad_s, "rad/s"))
FIELDS(Pose, TRANSFORM_FIELDS(Pose, transform), F(Pose, covariance, ""))
FIELDS(Motion, F(Motion, from_stamp_ns, "ns"), TRANSFORM_FIELDS(Motion, camera_in_previous),
       TRANSFORM_FIELDS(Motion, pose), F(Motion, confidence, "1"), F(Motion, rms_px, "px"), F(Motion, corners, "1"),
       F(Motion, matched, "1"), F(Motion, inliers, "1"), F(Motion, valid, ""), F(Motion, keyframe, ""))
FIELDS(Detections, F(Detections, image_width, "px"), F(Detections, image_height, "px"), F(Detections, searched, "1"),
       F(Detections, boxes, "px"))
FIELDS(Objects3d, F(Objects3d, searched, "1"), F(Objects3d, supported, ""), F(Objects3d, support_a, "1"),
       F(Objects3d, support_b, "1"), F(Objects3d, support_m, "m"), F(Objects3d, objects, ""))
FIELDS(BodyPoses, F(BodyPoses, joints, "1"), F(BodyPoses, candidates, "1"), F(BodyPoses, searched, "1"),
       F(BodyPoses, bodies, ""))
FIELDS(Grid, F(Grid, width, "1"), F(Grid, height, "1"), F(Grid, cell_m, "m"), F(Grid, origin_x_m, "m"),
       F(Grid, origin_y_m, "m"), TRANSFORM_FIELDS(Grid, grid_in_map), F(Grid, cells, "1"))
FIELDS(HeadState, F(HeadState, pan_rad, "rad"), F(HeadState, tilt_rad, "rad"), F(HeadState, roll_rad, "rad"),
       F(HeadState, pan_rad_s, "rad/s"), F(HeadState, tilt_rad_s, "rad/s"), F(HeadState, moving, ""))
FIELDS(HeadCommand, F(HeadCommand, pan_rad, "rad"), F(HeadCommand, tilt_rad, "rad"))
FIELDS(VelocityCommand, F(VelocityCommand, speed_m_s, "m/s"), F(VelocityCommand, turn_rad_s, "rad/s"))
FIELDS(DigitalState, F(DigitalState, levels, ""), F(DigitalState, changed, ""))
FIELDS(StopCommand, F(StopCommand, reasons, ""), F(StopCommand, nearest_m, "m"), F(StopCommand, scan_age_s, "s"))
FIELDS(Requests, F(Requests, wanted, ""))
FIELDS(TextStatus, F(TextStatus, text, ""))
FIELDS(Terrain, F(Terrain, kind, ""), F(Terrain, hypotheses, "1"), F(Terrain, correlations, "1"))
FIELDS(ObjectReports, F(ObjectReports, in_map, ""), F(ObjectReports, names, ""), F(ObjectReports, places, ""),
       F(ObjectReports, attributes, ""))
FIELDS(RobotTask, F(RobotTask, number, "1"), F(RobotTask, text, ""))
FIELDS(ActionCommand, F(ActionCommand, number, "1"), F(ActionCommand, action, ""), F(ActionCommand, objects, ""))
FIELDS(ActionOutcome, F(ActionOutcome, number, "1"), F(ActionOutcome, state, ""), F(ActionOutcome, duration_s, "s"),
       F(ActionOutcome, reason, ""))

#undef F
#undef FIELDS
#undef TRANSFORM_FIELDS
#undef CAMERA_FIELDS

std::span<const MessageType* const> message_types() {
  static const std::array<const MessageType*, 24> types{
      &MessageType::of<Image>(),        &MessageType::of<StereoPair>(),    &MessageType::of<DisparityMap>(),
      &MessageType::of<PointCloud>(),   &MessageType::of<LaserScan>(),     &MessageType::of<Odometry>(),
      &MessageType::of<Pose>(),         &MessageType::of<Motion>(),        &MessageType::of<Detections>(),
      &MessageType::of<Objects3d>(),    &MessageType::of<BodyPoses>(),     &MessageType::of<Grid>(),
      &MessageType::of<HeadState>(),    &MessageType::of<HeadCommand>(),   &MessageType::of<VelocityCommand>(),
      &MessageType::of<DigitalState>(), &MessageType::of<StopCommand>(),   &MessageType::of<Requests>(),
      &MessageType::of<TextStatus>(),   &MessageType::of<Terrain>(),       &MessageType::of<ObjectReports>(),
      &MessageType::of<RobotTask>(),    &MessageType::of<ActionCommand>(), &MessageType::of<ActionOutcome>()};
  return types;
}

}  // namespace takt
