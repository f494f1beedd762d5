// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/device.hpp"

namespace takt {

struct LinesReading {
  ReadStatus status = ReadStatus::no_data;
  int64_t stamp_ns = 0;
  uint32_t levels = 0;   ///< bit i: level of line i
  uint32_t changed = 0;  ///< bit i: at least one edge since the previous read, even if the level is back
  int64_t edge_ns = 0;   ///< when the newest of these edges was; 0: none, or not known
};

/// Digital inputs and outputs (emergency stop, camera trigger). Inputs that stop the robot are active-low, so that a
/// broken wire stops it (D-9). See Device for the life cycle and the thread rules.
class DigitalLines : public Device {
 public:
  virtual uint32_t count() const = 0;  ///< lines in use, 1..32; valid after open()
  /// Levels at or just before `wanted_ns` and every edge since the previous read. Never waits.
  virtual LinesReading read(int64_t wanted_ns) = 0;
  /// Drives an output line; false if the line is an input or does not exist.
  virtual bool write(uint32_t line, bool level, int64_t at_ns) = 0;
};

}  // namespace takt
