// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/messages.hpp"

#include <array>

#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/objects_3d.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/ace/terrain.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/pose.hpp"
#include "rt/msg/requests.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"

namespace takt {

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
