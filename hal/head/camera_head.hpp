// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/device.hpp"

namespace takt {

struct HeadLimits {
  double pan_rad = 0, tilt_rad = 0;  ///< largest deflection either way
  double pan_rad_s = 0, tilt_rad_s = 0;
  double acceleration_rad_s2 = 0;
};

struct HeadReading {
  ReadStatus status = ReadStatus::no_data;
  int64_t stamp_ns = 0;                            ///< when the angles were measured
  double pan_rad = 0, tilt_rad = 0, roll_rad = 0;  ///< pan: left positive; tilt: up positive
  double pan_rad_s = 0, tilt_rad_s = 0;
  bool moving = false;
  bool repeated = false;  ///< it has to move, and says the same again and again
};

/// The pan-tilt head under the camera (CAN). See Device for the life cycle and the thread rules.
class CameraHead : public Device {
 public:
  virtual HeadLimits limits() const = 0;  ///< valid after open()

  /// The newest state measured at or before `wanted_ns` (simulators: exactly then). Returns at the latest at
  /// `deadline_ns`.
  virtual HeadReading read(int64_t wanted_ns, int64_t deadline_ns) = 0;

  /// Sets the target. Angles beyond the limits are clamped, and false returned, so that the caller can report it.
  /// Heads stop by themselves when commands cease for 100 ms (D-4.3): repeat the target every job.
  virtual bool command(double pan_rad, double tilt_rad, int64_t at_ns) = 0;

  /// Closes the lids before the cameras, or opens them; in force until the next read, so repeat it every job. A head
  /// without lids does nothing.
  virtual void close_lids([[maybe_unused]] bool left, [[maybe_unused]] bool right, [[maybe_unused]] int64_t at_ns) {}
};

}  // namespace takt
