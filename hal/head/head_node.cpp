// SPDX-License-Identifier: Apache-2.0
#include "hal/head/head_node.hpp"

namespace takt {

void HeadNode::run(Job& job) {
  if (!running(job)) return job.no_result();
  // Repeated each job, because a head stops when its commands cease; a stale command is one that nobody repeats.
  if (const HeadCommand* wanted = command_.newest(); wanted != nullptr && !command_.stale()) {
    head_->command(wanted->pan_rad, wanted->tilt_rad, job.release_ns());
  }
  if (const DigitalState* lids = lids_.newest(); lids != nullptr && !lids_.stale()) {
    head_->close_lids((lids->levels & 1) != 0, (lids->levels & 2) != 0, job.release_ns());
  }
  const HeadReading reading = head_->read(job.release_ns(), job.deadline_ns());
  if (!accept(reading.status, job, false, reading.repeated)) return;
  HeadState* message = state_.loan();
  if (message == nullptr) return job.no_result();
  message->pan_rad = reading.pan_rad;
  message->tilt_rad = reading.tilt_rad;
  message->roll_rad = reading.roll_rad;
  message->pan_rad_s = reading.pan_rad_s;
  message->tilt_rad_s = reading.tilt_rad_s;
  message->moving = reading.moving ? 1 : 0;
  state_.send(reading.stamp_ns);
}

}  // namespace takt
