// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/motion.hpp"
#include "hal/sim/random.hpp"

namespace takt::sim {
namespace {

constexpr int64_t kNoEpoch = std::numeric_limits<int64_t>::min();
constexpr double kTickS = 0.01;
constexpr double kMaxSpeed = 1.4, kMaxAcceleration = 1.35;    // algorithms.md 13
constexpr double kMaxTurn = 1.2, kMaxTurnAcceleration = 2.5;  // our choice: not documented for the platform
std::atomic<int64_t> g_ahead_ns{0}, g_in_read_ns{0};

/// The command in force at an instant: the newest whose time has come. `count` commands were ever given.
const PendingCommand* in_force(const std::array<PendingCommand, 64>& ring, uint32_t count, int64_t at_ns) {
  const uint32_t kept = std::min<uint32_t>(count, static_cast<uint32_t>(ring.size()));
  for (uint32_t back = 1; back <= kept; ++back) {
    const PendingCommand& command = ring[(count - back) % ring.size()];
    if (command.at_ns <= at_ns) return &command;
  }
  return nullptr;
}

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

void integrate_arc(double v, double w, double dt, double& x, double& y, double& theta) {
  if (std::abs(w) > 1e-6) {
    const double next = theta + w * dt;
    x += v / w * (std::sin(next) - std::sin(theta));
    y -= v / w * (std::cos(next) - std::cos(theta));
    theta = next;
  } else {
    x += v * std::cos(theta) * dt;
    y += v * std::sin(theta) * dt;
    theta += w * dt;
  }
}

tl::expected<std::unique_ptr<Simulation>, DeviceError> Simulation::load(const std::string& device_id,
                                                                        const std::filesystem::path& file,
                                                                        const std::string& client, uint64_t seed) {
  auto world = load_world(device_id, file);
  if (!world) return tl::unexpected(world.error());
  size_t index = 0;
  if (!client.empty()) {
    const auto found =
        std::find_if(world->clients.begin(), world->clients.end(), [&](const Client& c) { return c.name == client; });
    if (found == world->clients.end()) {
      return device_error(device_id, file.string() + ": no client `" + client + "`",
                          "name one of the <client> elements, e.g. `" + world->clients[0].name + "`");
    }
    index = static_cast<size_t>(found - world->clients.begin());
  }
  auto simulation = std::make_unique<Simulation>(std::move(*world), index, seed);
  const Path& path = simulation->path_;
  for (double t = 0; !path.empty() && t < path.lap_s() + 60; t += 0.1) {
    const RobotState s = path.at(t);
    if (collides(simulation->world_, Vec2(s.x_m, s.y_m), 0.3)) {
      return device_error(device_id,
                          file.string() + ": the path of `" + simulation->client_.name +
                              "` hits an obstacle near x = " + std::to_string(s.x_m) +
                              " m, y = " + std::to_string(s.y_m) + " m",
                          "move the waypoints (the curve between them is a cubic spline) or the obstacle");
    }
  }
  return simulation;
}

Simulation::Simulation(World world, size_t client, uint64_t seed)
    : world_(std::move(world)),
      client_(world_.clients.at(client)),
      seed_(seed),
      scene_(build_scene(world_, make_textures(seed))),
      path_(client_.path),
      epoch_ns_(kNoEpoch),
      base_({client_.x_m, client_.y_m, client_.theta_rad, 0, 0}),
      head_({0, 0, 0, 0}) {
  if (path_.empty()) set_drive(Drive::command);
}

int64_t Simulation::begin(int64_t epoch_ns) {
  int64_t expected = kNoEpoch;
  epoch_ns_.compare_exchange_strong(expected, epoch_ns, std::memory_order_acq_rel);
  return epoch_ns_.load(std::memory_order_acquire);
}

void Simulation::reset() {
  epoch_ns_.store(kNoEpoch, std::memory_order_release);
  base_.restart({client_.x_m, client_.y_m, client_.theta_rad, 0, 0});
  head_.restart({0, 0, 0, 0});
  base_command_count_ = head_command_count_ = 0;
  blocked_.store(false);
  forced_mask_.store(0);
}

RobotState Simulation::robot(int64_t at_ns) const {
  const int64_t since = at_ns - epoch_ns();
  if (drive() == Drive::path) return path_.at(static_cast<double>(since) * 1e-9);
  const int64_t tick = std::clamp<int64_t>(since / History<5>::kTickNs, 0, base_.last_tick());
  const auto s = base_.at_tick(tick);
  RobotState robot{s[0], s[1], s[2], s[3], s[4]};
  // Within a tick, and beyond the settled horizon, the robot goes on along its arc.
  const double dt = std::max<double>(0, static_cast<double>(since - tick * History<5>::kTickNs)) * 1e-9;
  integrate_arc(robot.speed_m_s, robot.turn_rad_s, dt, robot.x_m, robot.y_m, robot.theta_rad);
  return robot;
}

void Simulation::command_base(double speed, double turn, int64_t at_ns) {
  base_commands_[base_command_count_++ % base_commands_.size()] = {at_ns + kLatencyNs, speed, turn};
}

void Simulation::advance_base(int64_t now_ns) {
  if (drive() == Drive::path) return;
  const int64_t last = (now_ns + kLatencyNs - epoch_ns()) / History<5>::kTickNs;
  // Nobody has moved it yet: a driver that was started again in a long run need not live through all of it.
  if (base_command_count_ == 0) return base_.stay_until(last);
  for (int64_t tick = base_.last_tick() + 1; tick <= last; ++tick) step_base(tick);
}

void Simulation::step_base(int64_t tick) {
  auto s = base_.at_tick(tick - 1);
  double speed = 0, turn = 0;
  const int64_t from_ns = epoch_ns() + (tick - 1) * History<5>::kTickNs;
  if (const auto* command = in_force(base_commands_, base_command_count_, from_ns)) {
    if (from_ns - command->at_ns <= kWatchdogNs) {
      speed = std::clamp(command->a, -kMaxSpeed, kMaxSpeed);
      turn = std::clamp(command->b, -kMaxTurn, kMaxTurn);
    }
  }
  double x = s[0], y = s[1], theta = s[2];
  integrate_arc(s[3], s[4], kTickS, x, y, theta);
  const bool refuse =
      collides(world_, Vec2(x, y), kFootprintRadius) && !collides(world_, Vec2(s[0], s[1]), kFootprintRadius);
  blocked_.store(refuse || (blocked_.load() && s[3] == 0 && speed > 0), std::memory_order_relaxed);
  if (refuse) {
    // The step is refused; turning on the spot stays possible (round footprint).
    s[2] = theta;
    s[3] = 0;
  } else {
    s[0] = x;
    s[1] = y;
    s[2] = theta;
    s[3] = towards(s[3], speed, kMaxAcceleration * kTickS);
  }
  s[4] = towards(s[4], turn, kMaxTurnAcceleration * kTickS);
  base_.append(s);
}

HeadReading Simulation::head(int64_t at_ns) const {
  const int64_t since = at_ns - epoch_ns();
  const int64_t tick = std::clamp<int64_t>(since / History<4>::kTickNs, 0, head_.last_tick());
  const auto s = head_.at_tick(tick);
  const double dt = std::clamp<double>(static_cast<double>(since - tick * History<4>::kTickNs) * 1e-9, 0.0, kTickS);
  HeadReading r;
  r.status = ReadStatus::ok;
  r.stamp_ns = at_ns;
  const HeadLimits limits = head_limits();
  r.pan_rad = std::clamp(s[0] + dt * s[2], -limits.pan_rad, limits.pan_rad);
  r.tilt_rad = std::clamp(s[1] + dt * s[3], -limits.tilt_rad, limits.tilt_rad);
  r.pan_rad_s = s[2];
  r.tilt_rad_s = s[3];
  r.moving = std::abs(s[2]) > 1e-3 || std::abs(s[3]) > 1e-3;
  return r;
}

void Simulation::command_head(double pan, double tilt, int64_t at_ns) {
  head_commands_[head_command_count_++ % head_commands_.size()] = {at_ns + kLatencyNs, pan, tilt};
}

void Simulation::advance_head(int64_t now_ns) {
  const int64_t last = (now_ns + kLatencyNs - epoch_ns()) / History<4>::kTickNs;
  if (head_command_count_ == 0) return head_.stay_until(last);
  for (int64_t tick = head_.last_tick() + 1; tick <= last; ++tick) step_head(tick);
}

void Simulation::step_head(int64_t tick) {
  auto s = head_.at_tick(tick - 1);
  const HeadLimits limits = head_limits();
  const auto* command = in_force(head_commands_, head_command_count_, epoch_ns() + (tick - 1) * History<4>::kTickNs);
  const double target[2] = {command ? command->a : 0, command ? command->b : 0};
  const Axis axes[2] = {{limits.pan_rad, limits.pan_rad_s, limits.acceleration_rad_s2},
                        {limits.tilt_rad, limits.tilt_rad_s, limits.acceleration_rad_s2}};
  for (size_t axis = 0; axis < 2; ++axis) step_axis(axes[axis], target[axis], kTickS, s[axis], s[axis + 2]);
  head_.append(s);
}

bool Simulation::settled(bool with_head, int64_t at_ns) const {
  const auto reaches = [&](int64_t last_tick, int64_t tick_ns) {
    return last_tick == 0 || epoch_ns() + last_tick * tick_ns >= at_ns;
  };
  return (drive() == Drive::path || reaches(base_.last_tick(), History<5>::kTickNs)) &&
         (!with_head || reaches(head_.last_tick(), History<4>::kTickNs));
}

uint32_t Simulation::line_count() const {
  uint32_t count = 1;
  for (const WorldLine& line : world_.lines) count = std::max(count, line.index + 1);
  return count;
}

uint32_t Simulation::lines(int64_t at_ns) const {
  uint32_t levels = world_.lines.empty() ? 1u : 0u;
  const double t = static_cast<double>(at_ns - epoch_ns()) * 1e-9;
  for (const WorldLine& line : world_.lines) {
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
  renderer.render(scene_, camera_pose(rig, 0, at_ns), {}, 0, {image.data(), rig.width, rig.height, 1}, depth);
}

void Simulation::true_disparity(const StereoRig& rig, int64_t at_ns, float* disparity) const {
  true_depth(rig, at_ns, disparity);
  const auto fb = static_cast<float>(rig.focal_px * rig.baseline_m);
  const int pixels = rig.width * rig.height;
  for (int i = 0; i < pixels; ++i) disparity[i] = disparity[i] > 0 ? fb / disparity[i] : 0.0f;
}

std::vector<const WorldObject*> Simulation::visible_objects(int64_t at_ns, double fov, double range) const {
  const RobotState s = robot(at_ns);
  const Vec2 origin(s.x_m, s.y_m);
  std::vector<const WorldObject*> seen;
  for (const WorldObject& object : world_.objects) {
    const Vec2 offset = object.position - origin;
    const double distance = offset.norm();
    if (distance < 1e-6 || distance > range) continue;
    const double bearing = std::remainder(std::atan2(offset.y(), offset.x()) - s.theta_rad, 2 * 3.14159265358979323846);
    if (std::abs(bearing) > fov / 2) continue;
    // The nearest thing on the way may be the object itself: allow for its own extent.
    const double extent = object.box ? std::hypot(object.box->width_m, object.box->depth_m) / 2 : 0.4;
    const double z = object.box ? object.box->z_m + object.box->height_m / 2 : 1.0;
    const Vec3 eye(origin.x(), origin.y(), z), ahead(offset.x() / distance, offset.y() / distance, 0);
    if (cast_ray(world_, scene_, eye, ahead, distance) >= distance - extent - 1e-3) seen.push_back(&object);
  }
  return seen;
}

}  // namespace takt::sim
