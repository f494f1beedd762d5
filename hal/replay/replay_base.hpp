// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "hal/base/mobile_base.hpp"
#include "hal/reads_files.hpp"
#include "hal/replay/log_pace.hpp"

namespace takt::replay {

struct ReplayBaseSettings {
  std::filesystem::path log;  ///< CARMEN log (carmen_log.hpp)
  LogPace pace;
};

/// The base of a recorded drive: a read gives the newest line of odometry at or before the wanted instant, again if
/// there is no newer one. Speeds are the movement since the newest line that is at least kDifference_s of the log
/// older, over the time of the run that lies between; limits() are the largest that occur. Commands are refused. After
/// the last line of the log: end_of_data.
class ReplayBase final : public MobileBase, public ReadsFiles {
 public:
  /// Long enough for stamps that jitter by tens of milliseconds, short against what a base takes to change its speed.
  static constexpr double kDifference_s = 0.25;

  ReplayBase(std::string id, ReplayBaseSettings settings) : id_(std::move(id)), settings_(std::move(settings)) {}
  DeviceResult open() override;
  void close() override;
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override { started_ = false; }
  /// The longest distance of two lines.
  StampLaw stamp_law(const JobTimes&) const override { return {0, settings_.pace.in_run_ns(longest_gap_ns_), 0, {}}; }
  BaseLimits limits() const override { return limits_; }
  BaseReading read(int64_t wanted_ns, int64_t deadline_ns) override;
  bool command(double, double, int64_t) override { return false; }

  std::vector<std::string> left_out() const override { return left_out_; }

 private:
  std::vector<std::string> left_out_;
  void find_limits();

  std::string id_;
  ReplayBaseSettings settings_;
  std::vector<BaseReading> readings_;  ///< stamps in the time of the log
  BaseLimits limits_;
  int64_t longest_gap_ns_ = 0;  ///< of the log
  int64_t end_ns_ = 0, epoch_ns_ = 0;
  size_t next_ = 0;         ///< first reading that is not due yet
  bool delivered_ = false;  ///< the reading before next_
  bool open_ = false, started_ = false, ended_ = false;
};

}  // namespace takt::replay
