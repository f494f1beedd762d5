// SPDX-License-Identifier: Apache-2.0
// The one place that names every processing node; a new node folder adds its line here.
#include "graph/ace/ace_registry.hpp"

namespace takt {
void register_stereo(NodeTypes& types);
void register_ego_motion(NodeTypes& types);
void register_mapping_3d(NodeTypes& types);
void register_object_detection(NodeTypes& types);
void register_ground_map(NodeTypes& types);
void register_picture(NodeTypes& types);
void register_moments(NodeTypes& types);
void register_obstacle_stop(NodeTypes& types);
void register_semantic(NodeTypes& types);
void register_semantic_map(NodeTypes& types);
void register_object_locator(NodeTypes& types);
void register_head_behaviour(NodeTypes& types);
void register_drive_arbiter(NodeTypes& types);
void register_load(NodeTypes& types);
void register_cloud_filter(NodeTypes& types);
void register_traffic_signs(NodeTypes& types);
void register_object_3d(NodeTypes& types);
void register_body_pose(NodeTypes& types);
void register_scan_matching(NodeTypes& types);
void register_robot_pose(NodeTypes& types);
void register_traversability(NodeTypes& types);
void register_person_tracking(NodeTypes& types);
void register_laser_fusion(NodeTypes& types);
void register_laser_cloud(NodeTypes& types);
void register_robot_client(NodeTypes& types);
void register_cruise(NodeTypes& types);
void register_mission(NodeTypes& types);

Registry ace_registry() {
  Registry registry;
  NodeTypes& types = registry.nodes;
  register_stereo(types);
  register_ego_motion(types);
  register_mapping_3d(types);
  register_object_detection(types);
  register_ground_map(types);
  register_picture(types);
  register_moments(types);
  register_obstacle_stop(types);
  register_semantic(types);
  register_semantic_map(types);
  register_object_locator(types);
  register_head_behaviour(types);
  register_drive_arbiter(types);
  register_load(types);
  register_cloud_filter(types);
  register_traffic_signs(types);
  register_object_3d(types);
  register_body_pose(types);
  register_scan_matching(types);
  register_robot_pose(types);
  register_traversability(types);
  register_person_tracking(types);
  register_laser_fusion(types);
  register_laser_cloud(types);
  register_robot_client(types);
  register_cruise(types);
  register_mission(types);
  hal::register_devices(registry.devices);
  return registry;
}

}  // namespace takt
