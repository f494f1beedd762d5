// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/laser_node.hpp"

namespace takt {

void LaserNode::setup(Setup& setup) {
  open_in_setup(setup);
  format_ = scanner_->format();
  Capacity capacity;
  capacity.count = format_.beams;
  scan_.reserve(capacity);
}

void LaserNode::run(Job& job) {
  LaserScan* message = running(job) ? scan_.loan() : nullptr;
  // Of a damaged scan nothing is sent: beams that are missing would look like a free way.
  if (message == nullptr) return job.no_result();
  message->range_m.resize(format_.beams);
  const ScanReading reading = scanner_->read(message->range_m.items(), job.release_ns(), job.deadline_ns());
  if (!accept(reading.status, job, false, reading.repeated)) return;
  message->first_angle_rad = format_.first_angle_rad;
  message->step_rad = format_.step_rad;
  message->max_range_m = format_.max_range_m;
  message->sweep_s = format_.sweep_s;
  message->scan_number = reading.scan_number;
  message->sensor_in_robot = format_.sensor_in_robot;
  scan_.send(reading.stamp_ns);
}

}  // namespace takt
