// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/device.hpp"
#include "rt/msg/ace/object_reports.hpp"

namespace takt {

struct ObjectReading {
  ReadStatus status = ReadStatus::no_data;
  int64_t stamp_ns = 0;  ///< when the objects stood where they are said to stand
};

/// What sees objects and tells their types, places and attributes. See Device for the life cycle and the thread rules.
class ObjectSensor : public Device {
 public:
  virtual uint32_t most_objects() const = 0;  ///< that one reading can hold; valid after open()

  /// Fills `reports` with the objects in view, places in the robot frame; its arrays have room for most_objects(). The
  /// newest view at or before `wanted_ns` (simulators: exactly then). Returns at the latest at `deadline_ns`.
  virtual ObjectReading read(ObjectReports& reports, int64_t wanted_ns, int64_t deadline_ns) = 0;
};

}  // namespace takt
