// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/random.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::sim {
namespace {

std::atomic<int64_t> g_ahead_ns{0}, g_in_read_ns{0};

}  // namespace

SimulatorCost simulator_cost() {
  return {g_ahead_ns.load(std::memory_order_relaxed), g_in_read_ns.load(std::memory_order_relaxed)};
}

void CostCounter::add(const SimulatorCost& cost) {
  ahead_ns_.fetch_add(cost.ahead_ns, std::memory_order_relaxed);
  in_read_ns_.fetch_add(cost.in_read_ns, std::memory_order_relaxed);
  g_ahead_ns.fetch_add(cost.ahead_ns, std::memory_order_relaxed);
  g_in_read_ns.fetch_add(cost.in_read_ns, std::memory_order_relaxed);
}

tl::expected<size_t, DeviceError> Simulation::find_client(const Stage& stage, const std::string& device_id,
                                                          const std::filesystem::path& file,
                                                          const std::string& client) {
  const auto& clients = stage.world().clients;
  if (client.empty()) return size_t{0};
  const auto found = std::find_if(clients.begin(), clients.end(), [&](const Client& c) { return c.name == client; });
  if (found != clients.end()) return static_cast<size_t>(found - clients.begin());
  std::string names;
  for (const Client& c : clients) names.append(names.empty() ? "" : ", ").append(c.name);
  return device_error(device_id, file.string() + ": no client `" + client + "`",
                      "name one of the <client> elements: " + names);
}

tl::expected<std::unique_ptr<Simulation>, DeviceError> Simulation::load(const std::string& device_id,
                                                                        const std::filesystem::path& file,
                                                                        const std::string& client, uint64_t seed) {
  auto stage = Stage::load(device_id, file, seed);
  if (!stage) return tl::unexpected(stage.error());
  const auto index = find_client(**stage, device_id, file, client);
  if (!index) return tl::unexpected(index.error());
  return std::make_unique<Simulation>(std::move(*stage), *index);
}

/// Robots of one world have noise of their own.
uint64_t Simulation::seed() const { return client_ == 0 ? stage_->seed() : mix(stage_->seed(), 0xC11E27, client_); }

bool Simulation::settled(bool with_head, int64_t at_ns) const {
  return stage_->settled(at_ns) && (!with_head || body().head_settled(at_ns));
}

uint32_t Simulation::line_count() const {
  uint32_t count = 1;
  for (const WorldLine& line : world().lines) count = std::max(count, line.index + 1);
  return count;
}

uint32_t Simulation::lines(int64_t at_ns) const {
  uint32_t levels = world().lines.empty() ? 1u : 0u;
  const double t = static_cast<double>(at_ns - epoch_ns()) * 1e-9;
  for (const WorldLine& line : world().lines) {
    bool level = line.rest;
    for (const LinePulse& pulse : line.pulses) {
      if (t >= pulse.from_s && t < pulse.until_s) level = !line.rest;
    }
    if (level) levels |= 1u << line.index;
  }
  const auto mask = static_cast<uint32_t>(forced_mask_.load()), forced = static_cast<uint32_t>(forced_level_.load());
  return (levels & ~mask) | (forced & mask);
}

void Simulation::force_line(uint32_t index, int level) {
  const uint64_t bit = 1ull << (index & 31);
  if (level > 0) forced_level_.fetch_or(bit);
  else forced_level_.fetch_and(~bit);
  if (level >= 0) forced_mask_.fetch_or(bit);
  else forced_mask_.fetch_and(~bit);
}

CameraPose Simulation::camera_pose(const StereoRig& rig, int which, const RobotState& robot, double pan, double tilt) {
  const Transform t = camera_in_robot(rig, pan, tilt);
  const double c = std::cos(robot.theta_rad), s = std::sin(robot.theta_rad);
  Mat3 robot_in_map;  // robot axes: x right, y forward = driving direction, z up
  robot_in_map << s, c, 0, -c, s, 0, 0, 0, 1;
  CameraPose pose;
  pose.rotation = robot_in_map * Eigen::Quaterniond(t.qw, t.qx, t.qy, t.qz).toRotationMatrix();
  pose.position = Vec3(robot.x_m, robot.y_m, 0) + robot_in_map * Vec3(t.x, t.y, t.z);
  if (which == 1) {
    pose.position += rig.baseline_m * pose.rotation.col(0);
    if (!rig.rectified) {
      const auto& r = rig.right_rotation_rad;
      pose.rotation = pose.rotation * (Eigen::AngleAxisd(r[2], Vec3::UnitZ()) * Eigen::AngleAxisd(r[1], Vec3::UnitY()) *
                                       Eigen::AngleAxisd(r[0], Vec3::UnitX()))
                                          .toRotationMatrix();
    }
  }
  return pose;
}

CameraPose Simulation::camera_pose(const StereoRig& rig, int which, int64_t at_ns) const {
  const HeadReading head_state = head(at_ns);
  return camera_pose(rig, which, robot(at_ns), head_state.pan_rad, head_state.tilt_rad);
}

void Simulation::true_depth(const StereoRig& rig, int64_t at_ns, float* depth) const {
  Renderer renderer({rig.width, rig.height, rig.focal_px, rig.cu_px, rig.cv_px});
  std::vector<uint8_t> image(static_cast<size_t>(rig.width) * static_cast<size_t>(rig.height));
  Snapshot snapshot = make_snapshot();
  look(at_ns, snapshot);
  renderer.render(snapshot.scene, camera_pose(rig, 0, at_ns), {}, 0, {image.data(), rig.width, rig.height, 1}, depth);
}

void Simulation::true_disparity(const StereoRig& rig, int64_t at_ns, float* disparity) const {
  true_depth(rig, at_ns, disparity);
  const auto fb = static_cast<float>(rig.focal_px * rig.baseline_m);
  const int pixels = rig.width * rig.height;
  for (int i = 0; i < pixels; ++i) disparity[i] = disparity[i] > 0 ? fb / disparity[i] : 0.0f;
}

std::optional<std::string> Simulation::attribute(std::string_view object, std::string_view attribute,
                                                 int64_t at_ns) const {
  const States& states = stage_->states();
  const auto index = states.object(object);
  const auto variable = index ? states.attribute(*index, attribute) : std::nullopt;
  const ValueId value = variable ? states.at(*variable, at_ns - epoch_ns()) : kUnknown;
  if (value == kUnknown) return std::nullopt;
  return std::string(states.text(value));
}

std::optional<Vec2> Simulation::position(std::string_view object, int64_t at_ns) const {
  const auto index = stage_->states().object(object);
  const auto placed = index ? stage_->placed(*index, at_ns) : std::nullopt;
  if (!placed) return std::nullopt;
  return placed->position;
}

bool Simulation::sees(size_t object, int64_t at_ns, double fov, double range, const Snapshot& snapshot,
                      Placed& placed) const {
  const auto where = stage_->placed(object, at_ns);
  if (!where || where->shape->empty()) return false;
  placed = *where;
  const RobotState s = robot(at_ns);
  const Vec2 origin(s.x_m, s.y_m), offset = placed.position - origin;
  const double distance = offset.norm();
  if (distance < 1e-6 || distance > range) return false;
  const double bearing = std::remainder(std::atan2(offset.y(), offset.x()) - s.theta_rad, 2 * std::numbers::pi);
  if (std::abs(bearing) > fov / 2) return false;
  // The nearest thing on the way may be the object itself: allow for its own extent.
  const auto& box = placed.shape->box;
  const double extent = box ? std::hypot(box->width_m, box->depth_m) / 2 : 0.4;
  const double z = box ? box->z_m + placed.lift_m + box->height_m / 2 : 1.0;
  const Vec3 eye(origin.x(), origin.y(), z), ahead(offset.x() / distance, offset.y() / distance, 0);
  return stage_->cast_ray(snapshot, eye, ahead, distance) >= distance - extent - 1e-3;
}

std::vector<const WorldObject*> Simulation::visible_objects(int64_t at_ns, double fov, double range) const {
  Snapshot snapshot = make_snapshot();
  look(at_ns, snapshot);
  std::vector<const WorldObject*> seen;
  Placed placed;
  for (size_t i = 0; i < world().objects.size(); ++i)
    if (sees(i, at_ns, fov, range, snapshot, placed)) seen.push_back(&world().objects[i]);
  return seen;
}

}  // namespace takt::sim
