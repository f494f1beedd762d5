// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include "nodes/obstacle_stop/protected_field.hpp"
#include "nodes/obstacle_stop/stop_state.hpp"
#include "nodes/obstacle_stop/sweep_memory.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace obstacle_stop;

class ObstacleStopNode final : public Node {
 public:
  /// What else it reads decides how far ahead it looks, not what it saw when.
  ObstacleStopNode() { stop_.stamped_by({&scan_}); }

  void setup(Setup&) override {
    memory_ = SweepMemory(scan_.capacity().count);
    changed();
  }

  void changed() override {
    footprint_ = footprint(width_, length_, margin_);
    wide_footprint_ = footprint(width_, length_, std::max<double>(margin_, moving_margin_));
    memory_.tune(nanoseconds(memory_span_));
    field_.tune(nanoseconds(release_after_));
    line_.tune(static_cast<uint32_t>(stop_line_()), nanoseconds(hold_));
  }

  void run(Job& job) override {
    const int64_t now_ns = job.release_ns();
    const LaserScan* scan = scan_.newest();
    const int64_t stamp_ns = scan ? scan_.stamp_ns() : now_ns;
    bool lost = !scan || scan_.stale() || now_ns - stamp_ns > nanoseconds(scan_age_max_);
    FieldReading seen;
    if (scan) {
      const Sweep sweep{scan->first_angle_rad, scan->step_rad, scan->sensor_in_robot, scan->range_m.items()};
      lost = lost || !has_geometry(sweep);
      seen = look(sweep, stamp_ns);
      if (!lost) keep(sweep, stamp_ns);
    }
    uint32_t reasons = lost || seen.blinded ? stop_reason::scan_lost : 0;
    if (seen.blocked) reasons |= stop_reason::obstacle;
    reasons = field_.update(reasons, stamp_ns) | line_reasons(now_ns);
    if (job.mode() == kSafeStopMode) reasons |= stop_reason::safe_stop;

    StopCommand* command = stop_.loan();
    if (!command) return job.no_result();
    command->reasons = reasons;
    command->nearest_m = seen.nearest_m;
    command->scan_age_s = static_cast<double>(now_ns - stamp_ns) * 1e-9;
    stop_.send(stamp_ns);
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, memory_, field_, line_); }

 private:
  static int64_t nanoseconds(double seconds) { return std::llround(seconds * 1e9); }

  /// Without it the beams lie nowhere, and an obstacle would be overlooked.
  static bool has_geometry(const Sweep& sweep) {
    const Transform& t = sweep.sensor_in_robot;
    return !sweep.range_m.empty() && sweep.step_rad > 0 && std::isfinite(sweep.first_angle_rad + sweep.step_rad) &&
           std::isfinite(t.x + t.y + t.qw + t.qx + t.qy + t.qz);
  }

  /// Of a robot that moves both what it does and what it is about to do: until it turns it goes on straight.
  FieldReading look(const Sweep& sweep, int64_t stamp_ns) {
    const Drive present = present_drive();
    const bool stands = std::abs(present.speed_m_s) < kStands_m_s && std::abs(present.turn_rad_s) < kStands_rad_s;
    const std::optional<Drive> wanted = wanted_drive();
    const Drive soon = wanted ? drive_before_stop(stands ? Drive{} : present, *wanted) : present;
    const Sweep moved_in = what_moved_in(
        sweep, stamp_ns,
        std::max(field_of(wide_footprint_, soon).reach_m(), field_of(wide_footprint_, present).reach_m()));
    const FieldReading first = look(sweep, moved_in, soon);
    if (!wanted || stands || first.blocked || first.blinded) return first;
    return look(sweep, moved_in, present);
  }

  FieldReading look(const Sweep& sweep, const Sweep& moved_in, const Drive& drive) const {
    const ProtectedField field = field_of(footprint_, drive);
    FieldReading reading = read_field(sweep, field, beams_min_);
    reading.blinded = has_geometry(sweep) && could_hide(sweep, field, hidden_width_);
    if (reading.blocked) return reading;
    const FieldReading moved = read_field(moved_in, field_of(wide_footprint_, drive), beams_min_);
    return {moved.blocked, moved.nearest_m, reading.blinded};
  }

  ProtectedField field_of(const Footprint& footprint, const Drive& drive) const {
    return {footprint, drive, stopping_time_s(drive, {deceleration_, turn_deceleration_, reaction_time_})};
  }

  /// Its returns alone that moved in, the others without range; no beam at all where nobody can tell.
  Sweep what_moved_in(Sweep sweep, int64_t stamp_ns, double reach_m) {
    const auto robot = robot_in_odometry(stamp_ns);
    sweep.range_m =
        robot && has_geometry(sweep) ? memory_.moved_in(sweep, *robot, stamp_ns, reach_m) : std::span<const float>();
    return sweep;
  }

  void keep(const Sweep& sweep, int64_t stamp_ns) {
    if (const auto robot = robot_in_odometry(stamp_ns)) memory_.add(sweep, *robot, stamp_ns);
  }

  /// What odometry says; straight ahead at the highest speed where it says nothing.
  Drive present_drive() const {
    const Odometry* odometry = present_odometry();
    return odometry ? Drive{odometry->speed_m_s, odometry->turn_rad_s} : Drive{speed_max_, 0};
  }

  const Odometry* present_odometry() const {
    const Odometry* odometry = odometry_.newest();
    const bool usable =
        odometry && !odometry_.stale() && std::isfinite(odometry->speed_m_s) && std::isfinite(odometry->turn_rad_s);
    return usable ? odometry : nullptr;
  }

  /// At that instant, by the speeds of the newest odometry. Nothing where there is none.
  std::optional<PlanarPose> robot_in_odometry(int64_t at_ns) const {
    const Odometry* odometry = present_odometry();
    if (!odometry || !std::isfinite(odometry->x_m + odometry->y_m + odometry->theta_rad)) return std::nullopt;
    const double since_s = static_cast<double>(at_ns - odometry_.stamp_ns()) * 1e-9;
    // The robot drives along its y axis, whose direction an odometry gives (C-9).
    return compose({odometry->x_m, odometry->y_m, odometry->theta_rad - std::numbers::pi / 2},
                   {0, odometry->speed_m_s * since_s, odometry->turn_rad_s * since_s});
  }

  std::optional<Drive> wanted_drive() const {
    const VelocityCommand* wanted = velocity_.newest();
    if (!wanted || velocity_.stale() || !std::isfinite(wanted->speed_m_s) || !std::isfinite(wanted->turn_rad_s))
      return std::nullopt;
    return Drive{wanted->speed_m_s, wanted->turn_rad_s};
  }

  uint32_t line_reasons(int64_t now_ns) {
    if (!lines_.connected()) return 0;
    for (size_t i = 0; i < lines_.size(); ++i)
      if (lines_.is_new(i)) line_.see(lines_[i].levels, lines_[i].changed, now_ns);
    const bool lost = lines_.empty() || lines_.stale() || now_ns - lines_.stamp_ns() > nanoseconds(line_age_max_);
    return (line_.stops(now_ns) ? stop_reason::line : 0) | (lost ? stop_reason::line_lost : 0);
  }

  static constexpr double kStands_m_s = 0.02, kStands_rad_s = 0.02;  ///< slower is no motion

  Input<LaserScan> scan_{this, "scan", "newest sweep of a level scanner that looks ahead"};
  Input<DigitalState> lines_{this, "lines", "emergency-stop line; depth as many as come in a period", Need::optional};
  Input<Odometry> odometry_{this, "odometry", "present speeds", Need::optional};
  Input<VelocityCommand> velocity_{this, "velocity", "what is wanted of the base: what it may soon do", Need::optional};
  Output<StopCommand> stop_{this, "stop", "stop or drive on, each job, with the scan's stamp"};
  Param<double> width_{this, "robot_width", kRobotWidth_m, {0.1, 5.0}, "m", "across the driving direction"};
  Param<double> length_{this,
                        "robot_length",
                        kRobotLength_m,
                        {0.1, 5.0},
                        "m",
                        "along the driving direction, the robot's centre in its middle"};
  Param<double> margin_{this, "margin", kMargin_m, {0.0, 1.0}, "m", "nearer to the robot nothing may come"};
  Param<double> moving_margin_{this, "moving_margin", 0.7, {0.0, 3.0}, "m", "nor what has moved in nearer than this"};
  Param<double> memory_span_{this,        "memory", 1.5,
                             {0.0, 10.0}, "s",      "where sweeps of the last so many passed through it has moved in"};
  Param<double> speed_max_{this, "speed_max", 1.4, {0.0, 10.0}, "m/s", "assumed where odometry says nothing"};
  Param<double> deceleration_{this, "deceleration", 1.0, {0.05, 20.0}, "m/s2", "that the robot surely brakes with"};
  Param<double> turn_deceleration_{
      this, "turn_deceleration", 1.5, {0.05, 50.0}, "rad/s2", "that the robot surely ends a turn with"};
  Param<double> reaction_time_{
      this, "reaction_time", 0.35, {0.0, 3.0}, "s", "from the first beam of a scan until the robot brakes"};
  Param<int> beams_min_{this, "beams_min", 2, {1, 64}, "", "neighbouring beams that an obstacle returns at least"};
  Param<double> hidden_width_{
      this, "hidden_width", 0.08, {0.01, 1.0}, "m", "what blinded beams may hide in the field must be narrower"};
  Param<double> release_after_{
      this, "release_after", 0.5, {0.0, 60.0}, "s", "the field must have been free before a stop ends"};
  Param<double> scan_age_max_{this, "scan_age_max", 0.2, {0.01, 5.0}, "s", "a scan older than this counts as none"};
  Param<int> stop_line_{this, "stop_line", 0, {0, 31}, "", "number of the emergency-stop line; level 0 stops"};
  Param<double> hold_{this, "hold", 1.0, {0.0, 60.0}, "s", "a pulse on the line stops for this long"};
  Param<double> line_age_max_{this, "line_age_max", 0.2, {0.01, 5.0}, "s", "an older line state counts as none"};

  Footprint footprint_, wide_footprint_;
  SweepMemory memory_;
  FieldState field_{stop_reason::scan_lost, 0};
  LineState line_{0, 0};
};

}  // namespace

void register_obstacle_stop(NodeTypes& types) {
  types.add<ObstacleStopNode>("obstacle_stop", Layer::perception,
                              "Stops the robot before what a laser scanner sees in its way");
}

}  // namespace takt
