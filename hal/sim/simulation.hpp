// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>

#include "hal/camera/rig.hpp"
#include "hal/head/camera_head.hpp"
#include "hal/sim/history.hpp"
#include "hal/sim/path.hpp"
#include "hal/sim/renderer.hpp"
#include "hal/sim/world.hpp"

namespace takt::sim {

enum class Drive : uint8_t { path, command };

/// One mechanism command, in force from `at_ns` on.
struct PendingCommand {
  int64_t at_ns = 0;
  double a = 0, b = 0;
};

/// The world in time: what all sim drivers of a process share. Constant parts (map, scene, path) are immutable; the
/// commanded parts (base in Drive::command, head, lines) have one writer each, the driver that owns them, and lock-free
/// readers.
///
/// A command acts kLatencyNs after it was given. Everything up to that horizon is therefore settled before it
/// happens, which lets a camera render its next exposure ahead of time and makes what is seen independent of how the
/// threads were scheduled.
class Simulation {
 public:
  static constexpr int64_t kLatencyNs = 100'000'000;
  static constexpr int64_t kWatchdogNs = 200'000'000;  ///< base stops without commands (devices.md 5)
  static constexpr double kFootprintRadius = 0.48;     ///< m (algorithms.md 13)

  /// `client`: which client of the world is the robot; the first if empty.
  static tl::expected<std::unique_ptr<Simulation>, DeviceError> load(const std::string& device_id,
                                                                     const std::filesystem::path& file,
                                                                     const std::string& client, uint64_t seed);
  Simulation(World world, size_t client, uint64_t seed);

  const World& world() const { return world_; }
  const Scene& scene() const { return scene_; }
  const Path& path() const { return path_; }
  uint64_t seed() const { return seed_; }

  /// The first caller fixes the start of the world's time; later calls change nothing. Returns what is in force.
  int64_t begin(int64_t epoch_ns);
  int64_t epoch_ns() const { return epoch_ns_.load(std::memory_order_acquire); }
  /// Forgets commands and epoch; only while no driver runs.
  void reset();

  void set_drive(Drive drive) { drive_.store(drive, std::memory_order_relaxed); }
  Drive drive() const { return drive_.load(std::memory_order_relaxed); }

  /// True state of the robot.
  RobotState robot(int64_t at_ns) const;
  /// Base driver only: the velocity wanted from at_ns on.
  void command_base(double speed_m_s, double turn_rad_s, int64_t at_ns);
  /// Base driver only: settles the motion up to now + latency.
  void advance_base(int64_t now_ns);
  bool blocked() const { return blocked_.load(std::memory_order_relaxed); }

  /// True state of the head (and of its motion).
  HeadReading head(int64_t at_ns) const;
  HeadLimits head_limits() const { return {2.094, 0.785, 3.49, 2.62, 8.0}; }
  void command_head(double pan_rad, double tilt_rad, int64_t at_ns);
  void advance_head(int64_t now_ns);

  /// True if no command can change any more where the base, and the head if `with_head`, are at that instant. A
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

  /// Objects within the client's field of view (66 degrees, 5 m) that no wall or object hides (algorithms.md 13).
  std::vector<const WorldObject*> visible_objects(int64_t at_ns, double fov_rad = 1.1519, double range_m = 5.0) const;

 private:
  void step_base(int64_t tick);
  void step_head(int64_t tick);

  World world_;
  Client client_;
  uint64_t seed_;
  Scene scene_;
  Path path_;
  std::atomic<int64_t> epoch_ns_;
  std::atomic<Drive> drive_{Drive::path};
  std::atomic<bool> blocked_{false};
  History<5> base_;  ///< x, y, theta, speed, turn
  History<4> head_;  ///< pan, tilt, and their speeds
  std::array<PendingCommand, 64> base_commands_{}, head_commands_{};
  uint32_t base_command_count_ = 0, head_command_count_ = 0;
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

/// x, y, theta moved along an exact arc (algorithms.md 13).
void integrate_arc(double speed_m_s, double turn_rad_s, double dt_s, double& x_m, double& y_m, double& theta_rad);

}  // namespace takt::sim
