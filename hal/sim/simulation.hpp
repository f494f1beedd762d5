// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/camera/rig.hpp"
#include "hal/sim/renderer.hpp"
#include "hal/sim/stage.hpp"

namespace takt::sim {

/// One robot of a world in time: what its sim drivers share. The other robots of the world and the state of its objects
/// are on the stage, which they all share.
///
/// A command acts kLatencyNs after it was given. Everything up to that horizon is therefore settled before it
/// happens, which lets a camera render its next exposure ahead of time and makes what is seen independent of how the
/// threads were scheduled.
class Simulation {
 public:
  static constexpr double kFootprintRadius = sim::kFootprintRadius;

  /// `client`: which client of the world is the robot; the first if empty.
  static tl::expected<std::unique_ptr<Simulation>, DeviceError> load(const std::string& device_id,
                                                                     const std::filesystem::path& file,
                                                                     const std::string& client, uint64_t seed);
  Simulation(std::shared_ptr<Stage> stage, size_t client) : stage_(std::move(stage)), client_(client) {}
  Simulation(World world, size_t client, uint64_t seed)
      : Simulation(std::make_shared<Stage>(std::move(world), seed), client) {}
  /// Which client has that name; the first if it is empty. The error names those that there are.
  static tl::expected<size_t, DeviceError> find_client(const Stage& stage, const std::string& device_id,
                                                       const std::filesystem::path& file, const std::string& client);

  Stage& stage() { return *stage_; }
  const Stage& stage() const { return *stage_; }
  const World& world() const { return stage_->world(); }
  const Scene& scene() const { return stage_->scene(); }  ///< what never changes
  const Path& path() const { return body().path(); }
  uint64_t seed() const;  ///< of this robot's sensors

  /// The first caller fixes the start of the world's time; later calls change nothing. Returns what is in force.
  int64_t begin(int64_t epoch_ns) { return stage_->begin(epoch_ns); }
  int64_t epoch_ns() const { return stage_->epoch_ns(); }

  void set_drive(Drive drive) { body().set_drive(drive); }
  Drive drive() const { return body().drive(); }

  /// True state of the robot.
  RobotState robot(int64_t at_ns) const { return body().state(at_ns); }
  /// Base driver only: the velocity wanted from at_ns on.
  void command_base(double speed_m_s, double turn_rad_s, int64_t at_ns) {
    body().command_base(speed_m_s, turn_rad_s, at_ns);
  }
  /// Base driver only: settles the motion up to now + latency.
  void advance_base(int64_t now_ns) { body().advance_base(now_ns); }
  bool blocked() const { return body().blocked(); }

  /// True state of the head (and of its motion).
  HeadReading head(int64_t at_ns) const { return body().head(at_ns); }
  HeadLimits head_limits() const { return body().head_limits(); }
  void command_head(double pan_rad, double tilt_rad, int64_t at_ns) { body().command_head(pan_rad, tilt_rad, at_ns); }
  void advance_head(int64_t now_ns) { body().advance_head(now_ns); }

  /// What this robot does with the objects: actor driver only.
  ActionRun& actions() { return stage_->actions(client_); }

  /// True if no command can change any more how the world, and this robot's head if `with_head`, is at that instant. A
  /// mechanism that nobody has advanced yet stands still.
  bool settled(bool with_head, int64_t at_ns) const;

  /// Levels of the digital lines; without <line> elements line 0, the emergency stop, rests at 1 (free).
  uint32_t lines(int64_t at_ns) const;
  uint32_t line_count() const;
  /// Overrides a line from now on (fault injection, tests); -1 gives it back to the world.
  void force_line(uint32_t index, int level);

  /// Pose of the left (0) or right (1) camera of a rig at an instant, in the map.
  CameraPose camera_pose(const StereoRig& rig, int which, int64_t at_ns) const;
  static CameraPose camera_pose(const StereoRig& rig, int which, const RobotState& robot, double head_pan,
                                double head_tilt);
  /// Ground truth for a rig: depth along the optical axis of the left camera, width x height, 0 where there is nothing.
  void true_depth(const StereoRig& rig, int64_t at_ns, float* depth_m) const;
  /// f B / depth, rectified left view.
  void true_disparity(const StereoRig& rig, int64_t at_ns, float* disparity_px) const;

  /// What this robot's sensors meet beside scene().
  void look(int64_t at_ns, Snapshot& into) const { stage_->look(client_, at_ns, into); }
  Snapshot make_snapshot() const { return stage_->make_snapshot(); }

  /// Ground truth, once the world has begun: what an attribute of an object is. Nothing: there is no such object or
  /// attribute, or nobody has said what it is.
  std::optional<std::string> attribute(std::string_view object, std::string_view attribute, int64_t at_ns) const;
  /// Where the object is, in the map; a carried one is where its robot is. Nothing: there is none, or it is away.
  std::optional<Vec2> position(std::string_view object, int64_t at_ns) const;

  /// Whether an object is within the robot's field of view, and nothing hides it. `snapshot` is
  /// that of the instant; `placed` is where the object then stands, if it is seen.
  bool sees(size_t object, int64_t at_ns, double fov_rad, double range_m, const Snapshot& snapshot,
            Placed& placed) const;
  /// All such objects.
  std::vector<const WorldObject*> visible_objects(int64_t at_ns, double fov_rad = 1.1519, double range_m = 5.0) const;

 private:
  Robot& body() { return stage_->robot(client_); }
  const Robot& body() const { return stage_->robot(client_); }

  std::shared_ptr<Stage> stage_;
  size_t client_;
  std::atomic<uint64_t> forced_mask_{0}, forced_level_{0};
};

/// CPU time that rendering has used, ns: the cost of the simulator, which no real device has.
struct SimulatorCost {
  int64_t ahead_ns = 0;    ///< in threads of the simulator
  int64_t in_read_ns = 0;  ///< within reads, hence in the jobs of the device nodes: part of their CPU time too
  int64_t total_ns() const { return ahead_ns + in_read_ns; }
};
/// Of all cameras of this process.
SimulatorCost simulator_cost();

/// One camera's cost; what is added counts for simulator_cost() as well. Any thread.
class CostCounter {
 public:
  void add(const SimulatorCost& cost);
  SimulatorCost read() const {
    return {ahead_ns_.load(std::memory_order_relaxed), in_read_ns_.load(std::memory_order_relaxed)};
  }

 private:
  std::atomic<int64_t> ahead_ns_{0}, in_read_ns_{0};
};

}  // namespace takt::sim
