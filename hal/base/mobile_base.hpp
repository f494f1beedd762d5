// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/device.hpp"

namespace takt {

struct BaseLimits {
  double speed_m_s = 0, acceleration_m_s2 = 0, turn_rad_s = 0;
};

struct BaseReading {
  ReadStatus status = ReadStatus::no_data;
  int64_t stamp_ns = 0;
  double x_m = 0, y_m = 0, theta_rad = 0;  ///< in the odometry frame, theta from its x axis; drifts
  double speed_m_s = 0, turn_rad_s = 0;
  uint32_t epoch = 0;     ///< rises when the base forgot its pose (restart, reconnect); never silently reset
  bool blocked = false;   ///< a motion was refused (collision, bumper, emergency stop)
  bool repeated = false;  ///< it has to move, or says that it does, and its wheels stand
};

/// The differential-drive platform. See Device for the life cycle and the thread rules.
class MobileBase : public Device {
 public:
  virtual BaseLimits limits() const = 0;  ///< valid after open()

  /// The newest odometry at or before `wanted_ns` (simulators: exactly then). Returns at the latest at `deadline_ns`.
  virtual BaseReading read(int64_t wanted_ns, int64_t deadline_ns) = 0;

  /// Sets the wanted speeds from `at_ns` on. Values beyond the limits are clamped, and false returned. The base stops
  /// by itself when no command comes for 200 ms (D-5): repeat it every job.
  virtual bool command(double speed_m_s, double turn_rad_s, int64_t at_ns) = 0;
};

}  // namespace takt
