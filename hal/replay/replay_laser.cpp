// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/replay_laser.hpp"

#include <algorithm>

#include "hal/replay/carmen_log.hpp"

namespace takt::replay {

DeviceResult ReplayLaser::open() {
  if (open_) return {};
  auto log = load_carmen_log(id_, settings_.log);
  if (!log) return tl::unexpected(log.error());
  if (log->scans.empty())
    return device_error(
        id_, settings_.log.string() + ": holds no scan" + (log->left_out.empty() ? "" : "\n  " + log->left_out.back()),
        "choose a log with FLASER, RAWLASER1 or ROBOTLASER1");
  left_out_ = log->left_out;
  const auto first = std::find_if(log->scans.begin(), log->scans.end(),
                                  [this](const CarmenScan& scan) { return scan.time_ns >= settings_.pace.start_ns; });
  const bool any = first != log->scans.end();
  const auto usable =
      check_pace(id_, settings_.log, settings_.pace, "scan", any ? std::optional(first->time_ns) : std::nullopt);
  if (!usable) return usable;

  format_ = {log->beams, log->first_angle_rad, log->step_rad, log->max_range_m, 0, 0, {}, {}};
  if (settings_.max_range_m > 0) format_.max_range_m = settings_.max_range_m;
  format_.sensor_in_robot.y = log->laser_ahead_m;
  if (settings_.sensor_in_robot) format_.sensor_in_robot = *settings_.sensor_in_robot;
  time_ns_.clear();
  for (auto scan = first; scan != log->scans.end(); ++scan) time_ns_.push_back(scan->time_ns);
  for (size_t i = 1; i < time_ns_.size(); ++i)
    format_.stamps.period_ns =
        std::max(format_.stamps.period_ns, settings_.pace.in_run_ns(time_ns_[i] - time_ns_[i - 1]));
  if (const int64_t lasts_ns = time_ns_.back() - time_ns_.front(); lasts_ns > 0)
    format_.rate_hz =
        settings_.pace.speed * static_cast<double>(time_ns_.size() - 1) * 1e9 / static_cast<double>(lasts_ns);
  range_m_.assign(log->range_m.end() - static_cast<ptrdiff_t>(time_ns_.size() * log->beams), log->range_m.end());
  for (float& range : range_m_) {
    if (range <= 0 || static_cast<double>(range) > format_.max_range_m) range = 0;
  }
  end_ns_ = log->end_ns;
  open_ = true;
  return {};
}

void ReplayLaser::close() {
  time_ns_ = {};
  range_m_ = {};
  open_ = started_ = false;
}

DeviceResult ReplayLaser::start(int64_t epoch_ns) {
  if (!open_) return device_error(id_, "start before open", "call open() first");
  epoch_ns_ = epoch_ns;
  next_ = 0;
  ended_ = false;
  started_ = true;
  return {};
}

ScanReading ReplayLaser::read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) {
  ScanReading reading;
  if (!started_ || wanted_ns > deadline_ns) return reading;
  const size_t before = next_;
  while (next_ < time_ns_.size() && settings_.pace.stamp_ns(epoch_ns_, time_ns_[next_]) <= wanted_ns) ++next_;
  if (next_ == before) {
    ended_ = ended_ || (next_ == time_ns_.size() && settings_.pace.stamp_ns(epoch_ns_, end_ns_) < wanted_ns);
    if (ended_) reading.status = ReadStatus::end_of_data;
    return reading;
  }
  const size_t scan = next_ - 1, beams = std::min<size_t>(format_.beams, range_m.size());
  std::copy_n(range_m_.begin() + static_cast<ptrdiff_t>(scan * format_.beams), beams, range_m.begin());
  reading.stamp_ns = settings_.pace.stamp_ns(epoch_ns_, time_ns_[scan]);
  reading.scan_number = static_cast<uint32_t>(scan);
  reading.status = beams < format_.beams ? ReadStatus::partial : ReadStatus::ok;
  return reading;
}

}  // namespace takt::replay
