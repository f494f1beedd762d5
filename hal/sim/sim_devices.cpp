// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/sim_devices.hpp"

#include <algorithm>
#include <cmath>

namespace takt::sim {

DeviceResult SimLaser::open() {
  if (model_.beams < 2 || model_.beams > 4096) {
    return device_error(id_, "`beams` is " + std::to_string(model_.beams), "use 2..4096 beams");
  }
  met_ = simulation_.make_snapshot();
  return {};
}
DeviceResult SimLaser::start(int64_t epoch_ns) {
  simulation_.begin(epoch_ns);
  scans_ = 0;
  started_ = true;
  return {};
}
ScanFormat SimLaser::format() const {
  return {model_.beams,
          -model_.fov_rad / 2,
          model_.fov_rad / (model_.beams - 1),
          model_.max_range_m,
          model_.sweep_s,
          0,
          model_.sensor_in_robot,
          {static_cast<int64_t>(model_.sweep_s * 1e9), 0, {}}};
}
ScanReading SimLaser::read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) {
  ScanReading reading;
  if (!started_ || wanted_ns > deadline_ns) return reading;
  reading.stamp_ns = wanted_ns - static_cast<int64_t>(model_.sweep_s * 1e9);
  scan(simulation_, model_, reading.stamp_ns, range_m, met_);
  reading.scan_number = scans_++;
  reading.status = range_m.size() < model_.beams ? ReadStatus::partial : ReadStatus::ok;
  return reading;
}

DeviceResult SimHead::start(int64_t epoch_ns) {
  simulation_.begin(epoch_ns);
  started_ = true;
  return {};
}
HeadReading SimHead::read(int64_t wanted_ns, int64_t deadline_ns) {
  if (!started_ || wanted_ns > deadline_ns) return {};
  simulation_.advance_head(wanted_ns);
  return simulation_.head(wanted_ns);
}
bool SimHead::command(double pan, double tilt, int64_t at_ns) {
  if (!std::isfinite(pan) || !std::isfinite(tilt)) return false;
  const HeadLimits limit = limits();
  const double p = std::clamp(pan, -limit.pan_rad, limit.pan_rad),
               t = std::clamp(tilt, -limit.tilt_rad, limit.tilt_rad);
  simulation_.command_head(p, t, at_ns);
  return p == pan && t == tilt;
}

SimBase::SimBase(std::string id, OdometryModel model, Simulation& simulation, const Clock* clock)
    : id_(std::move(id)), simulation_(simulation), clock_(clock), odometry_(simulation, model, simulation.seed()) {}
DeviceResult SimBase::start(int64_t epoch_ns) {
  simulation_.begin(epoch_ns);
  odometry_.restart();
  if (clock_ != nullptr) static_cast<void>(odometry_.at(clock_->now_ns()));
  started_ = true;
  return {};
}
BaseReading SimBase::read(int64_t wanted_ns, int64_t deadline_ns) {
  if (!started_ || wanted_ns > deadline_ns) return {};
  simulation_.advance_base(wanted_ns);
  return odometry_.at(wanted_ns);
}
bool SimBase::command(double speed, double turn, int64_t at_ns) {
  if (simulation_.drive() == Drive::path || !std::isfinite(speed) || !std::isfinite(turn)) return false;
  const BaseLimits limit = limits();
  const double v = std::clamp(speed, -limit.speed_m_s, limit.speed_m_s),
               w = std::clamp(turn, -limit.turn_rad_s, limit.turn_rad_s);
  simulation_.command_base(v, w, at_ns);
  return v == speed && w == turn;
}

DeviceResult SimLines::start(int64_t epoch_ns) {
  simulation_.begin(epoch_ns);
  started_ = first_ = true;
  return {};
}
LinesReading SimLines::read(int64_t wanted_ns) {
  if (!started_) return {};
  LinesReading reading{ReadStatus::ok, wanted_ns, simulation_.lines(wanted_ns), 0};
  if (!first_) {
    reading.changed = reading.levels ^ previous_;
    // Edges between the two reads whose level is back: looked for each millisecond, as the poll of a real line would.
    for (int64_t t = previous_ns_ + 1'000'000; t < wanted_ns && wanted_ns - previous_ns_ < 2'000'000'000;
         t += 1'000'000) {
      reading.changed |= simulation_.lines(t) ^ previous_;
    }
  }
  first_ = false;
  previous_ = reading.levels;
  previous_ns_ = wanted_ns;
  return reading;
}

}  // namespace takt::sim
