// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/replay_base.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/replay/carmen_log.hpp"

namespace takt::replay {
namespace {

/// What a base would have reported at each line of odometry. Speeds are in seconds of the log divided by `speed`.
std::vector<BaseReading> readings_of(const std::vector<TimedPose>& odometry, double speed) {
  const auto window_ns = static_cast<int64_t>(ReplayBase::kDifference_s * 1e9);
  std::vector<BaseReading> readings;
  size_t old = 0;
  for (const TimedPose& line : odometry) {
    while (old + 1 < odometry.size() && line.time_ns - odometry[old + 1].time_ns >= window_ns) ++old;
    BaseReading reading;
    reading.status = ReadStatus::ok;
    reading.stamp_ns = line.time_ns;
    reading.x_m = line.pose.x_m;
    reading.y_m = line.pose.y_m;
    reading.theta_rad = line.pose.theta_rad;
    const double dt_s = static_cast<double>(line.time_ns - odometry[old].time_ns) * 1e-9 / speed;
    if (dt_s > 0) {
      // The base cannot slide sideways and drove an arc: its chord lies along the mean heading.
      const PlanarPose moved = between(odometry[old].pose, line.pose);
      const double half = moved.theta_rad / 2, chord_m = moved.x_m * std::cos(half) + moved.y_m * std::sin(half);
      reading.speed_m_s = chord_m * (std::abs(half) > 1e-6 ? half / std::sin(half) : 1.0) / dt_s;
      reading.turn_rad_s = moved.theta_rad / dt_s;
    }
    readings.push_back(reading);
  }
  return readings;
}

}  // namespace

DeviceResult ReplayBase::open() {
  if (open_) return {};
  const auto log = load_carmen_log(id_, settings_.log);
  if (!log) return tl::unexpected(log.error());
  if (log->odometry.empty())
    return device_error(
        id_,
        settings_.log.string() + ": holds no ODOM line" + (log->left_out.empty() ? "" : "\n  " + log->left_out.back()),
        "choose a log with ODOM or ROBOTLASER1");
  left_out_ = log->left_out;
  readings_ = readings_of(log->odometry, settings_.pace.speed);
  std::erase_if(readings_, [this](const BaseReading& r) { return r.stamp_ns < settings_.pace.start_ns; });
  const auto usable = check_pace(id_, settings_.log, settings_.pace, "ODOM line",
                                 readings_.empty() ? std::nullopt : std::optional(readings_.front().stamp_ns));
  if (!usable) return usable;
  find_limits();
  end_ns_ = log->end_ns;
  open_ = true;
  return {};
}

void ReplayBase::find_limits() {
  limits_ = {};
  longest_gap_ns_ = 0;
  for (size_t i = 0; i < readings_.size(); ++i) {
    if (i > 0) longest_gap_ns_ = std::max(longest_gap_ns_, readings_[i].stamp_ns - readings_[i - 1].stamp_ns);
    limits_.speed_m_s = std::max(limits_.speed_m_s, std::abs(readings_[i].speed_m_s));
    limits_.turn_rad_s = std::max(limits_.turn_rad_s, std::abs(readings_[i].turn_rad_s));
    if (i == 0 || readings_[i].stamp_ns == readings_[i - 1].stamp_ns) continue;
    const double dt_s =
        static_cast<double>(readings_[i].stamp_ns - readings_[i - 1].stamp_ns) * 1e-9 / settings_.pace.speed;
    limits_.acceleration_m_s2 =
        std::max(limits_.acceleration_m_s2, std::abs(readings_[i].speed_m_s - readings_[i - 1].speed_m_s) / dt_s);
  }
}

void ReplayBase::close() {
  readings_ = {};
  open_ = started_ = false;
}

DeviceResult ReplayBase::start(int64_t epoch_ns) {
  if (!open_) return device_error(id_, "start before open", "call open() first");
  epoch_ns_ = epoch_ns;
  next_ = 0;
  delivered_ = ended_ = false;
  started_ = true;
  return {};
}

BaseReading ReplayBase::read(int64_t wanted_ns, int64_t deadline_ns) {
  BaseReading reading;
  if (!started_ || wanted_ns > deadline_ns) return reading;
  const LogPace& pace = settings_.pace;
  const size_t before = next_;
  while (next_ < readings_.size() && pace.stamp_ns(epoch_ns_, readings_[next_].stamp_ns) <= wanted_ns) ++next_;
  if (next_ > before) delivered_ = false;
  ended_ = ended_ || (delivered_ && next_ == readings_.size() && pace.stamp_ns(epoch_ns_, end_ns_) < wanted_ns);
  if (ended_) reading.status = ReadStatus::end_of_data;
  if (ended_ || next_ == 0) return reading;
  delivered_ = true;
  reading = readings_[next_ - 1];
  reading.stamp_ns = pace.stamp_ns(epoch_ns_, reading.stamp_ns);
  return reading;
}

}  // namespace takt::replay
