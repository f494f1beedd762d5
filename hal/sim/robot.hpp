// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/head/camera_head.hpp"
#include "hal/sim/history.hpp"
#include "hal/sim/path.hpp"

namespace takt::sim {

class Stage;

enum class Drive : uint8_t { path, command };

/// One mechanism command, in force from `at_ns` on.
struct PendingCommand {
  int64_t at_ns = 0;
  double a = 0, b = 0;
};

/// A command acts so long after it was given. Everything up to that horizon is therefore settled before it happens.
constexpr int64_t kLatencyNs = 100'000'000;
/// m, m/s, m/s^2.
constexpr double kFootprintRadius = 0.48, kMaxSpeed = 1.4, kMaxAcceleration = 1.35;

/// One robot of a world: base and head over time. Either has one writer, the driver that owns it, and lock-free
/// readers.
class Robot {
 public:
  static constexpr int64_t kWatchdogNs = 200'000'000;  ///< base stops without commands (D-5)

  /// `index`: which client of the stage's world it is. The stage must outlive it.
  Robot(const Stage& stage, size_t index);

  const Client& client() const { return client_; }
  const Path& path() const { return path_; }
  void set_drive(Drive drive) { drive_.store(drive, std::memory_order_relaxed); }
  Drive drive() const { return drive_.load(std::memory_order_relaxed); }

  RobotState state(int64_t at_ns) const;
  void command_base(double speed_m_s, double turn_rad_s, int64_t at_ns);
  void advance_base(int64_t now_ns);
  bool blocked() const { return blocked_.load(std::memory_order_relaxed); }

  HeadReading head(int64_t at_ns) const;
  HeadLimits head_limits() const { return {2.094, 0.785, 3.49, 2.62, 8.0}; }
  void command_head(double pan_rad, double tilt_rad, int64_t at_ns);
  void advance_head(int64_t now_ns);

  /// True if no command can change any more where the base, or the head, is at that instant. A mechanism that nobody
  /// has advanced yet stands still.
  bool base_settled(int64_t at_ns) const;
  bool head_settled(int64_t at_ns) const;

 private:
  void step_base(int64_t tick);
  void step_head(int64_t tick);

  const Stage& stage_;
  size_t index_;
  Client client_;
  Path path_;
  std::atomic<Drive> drive_{Drive::path};
  std::atomic<bool> blocked_{false};
  History<5> base_;  ///< x, y, theta, speed, turn
  History<4> head_;  ///< pan, tilt, and their speeds
  std::array<PendingCommand, 64> base_commands_{}, head_commands_{};
  uint32_t base_command_count_ = 0, head_command_count_ = 0;
};

/// x, y, theta moved along an exact arc.
void integrate_arc(double speed_m_s, double turn_rad_s, double dt_s, double& x_m, double& y_m, double& theta_rad);

}  // namespace takt::sim
