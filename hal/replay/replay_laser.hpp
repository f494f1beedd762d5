// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "hal/laser/laser_scanner.hpp"
#include "hal/reads_files.hpp"
#include "hal/replay/log_pace.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::replay {

struct ReplayLaserSettings {
  std::filesystem::path log;  ///< CARMEN log (carmen_log.hpp)
  LogPace pace;
  std::optional<Transform> sensor_in_robot;  ///< else what the log says of it, at height 0
  double max_range_m = 0;                    ///< larger ranges are no return; 0: what the log says
};

/// The front laser scanner of a recorded drive. A read delivers the newest scan at or before the wanted instant that
/// was not delivered yet; scan_number is its place in the log, so that a gap is a scan that nobody read in time. A log
/// stamps a scan as a whole: sweep_s is 0. After the last line of the log: end_of_data.
class ReplayLaser final : public LaserScanner, public ReadsFiles {
 public:
  ReplayLaser(std::string id, ReplayLaserSettings settings) : id_(std::move(id)), settings_(std::move(settings)) {}
  DeviceResult open() override;
  void close() override;
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override { started_ = false; }
  ScanFormat format() const override { return format_; }
  ScanReading read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) override;
  /// Scans from the start of the replay to the end of the log.
  size_t scans() const { return time_ns_.size(); }

  std::vector<std::string> left_out() const override { return left_out_; }

 private:
  std::vector<std::string> left_out_;
  std::string id_;
  ReplayLaserSettings settings_;
  ScanFormat format_;
  std::vector<int64_t> time_ns_;  ///< of each scan, in the log
  std::vector<float> range_m_;    ///< scans x beams
  int64_t end_ns_ = 0, epoch_ns_ = 0;
  size_t next_ = 0;  ///< first scan that is neither delivered nor overtaken
  bool open_ = false, started_ = false, ended_ = false;
};

}  // namespace takt::replay
