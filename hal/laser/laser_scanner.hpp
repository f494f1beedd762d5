// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

#include "hal/device.hpp"
#include "rt/msg/geometry.hpp"

namespace takt {

/// Geometry of one sweep; fixed by open(). Beam 0 points to first_angle_rad (the right), counter-clockwise from above.
struct ScanFormat {
  uint32_t beams = 0;
  double first_angle_rad = 0, step_rad = 0;
  double max_range_m = 0;
  double sweep_s = 0;  ///< from the first to the last beam
  double rate_hz = 0;  ///< as it comes, on average
  Transform sensor_in_robot;
  StampLaw stamps;  ///< stamps are those of the first beam: sweep and sending are in it
};

struct ScanReading {
  ReadStatus status = ReadStatus::no_data;
  int64_t stamp_ns = 0;      ///< of the first beam
  uint32_t scan_number = 0;  ///< counted by the device where it can; a gap is a lost scan
  bool repeated = false;     ///< the measurement of the scan before, once more
};

/// A planar laser scanner (SICK LMS200, LMS400). See Device for the life cycle and the thread rules.
class LaserScanner : public Device {
 public:
  virtual ScanFormat format() const = 0;  ///< valid after open(); of hardware without it, but for what it tells itself
  StampLaw stamp_law(const JobTimes&) const override { return format().stamps; }

  /// Writes the newest complete sweep that was not delivered yet: format().beams ranges in metres, 0 for no return and
  /// for flagged values (dazzled, beyond range; D-1.7). Scanners are free-running: a simulated one has
  /// always just ended a sweep at `wanted_ns`. Returns at the latest at `deadline_ns`.
  virtual ScanReading read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) = 0;
};

}  // namespace takt
