// SPDX-License-Identifier: Apache-2.0
#include "hal/base/base_node.hpp"

#include "hal/base/must_stand.hpp"

namespace takt {

void BaseNode::run(Job& job) {
  if (!running(job)) return job.no_result();
  // A stop is commanded, not left to the base's watchdog, which acts later. A stale velocity is not repeated: the
  // watchdog then stops the base.
  if (must_stand(stop_, job.mode())) {
    base_->command(0, 0, job.release_ns());
  } else if (const VelocityCommand* wanted = velocity_.newest(); wanted != nullptr && !velocity_.stale()) {
    base_->command(wanted->speed_m_s, wanted->turn_rad_s, job.release_ns());
  }
  const BaseReading reading = base_->read(job.release_ns(), job.deadline_ns());
  if (!accept(reading.status, job, false, reading.repeated)) return;
  Odometry* message = odometry_.loan();
  if (message == nullptr) return job.no_result();
  message->x_m = reading.x_m;
  message->y_m = reading.y_m;
  message->theta_rad = reading.theta_rad;
  message->speed_m_s = reading.speed_m_s;
  message->turn_rad_s = reading.turn_rad_s;
  odometry_.send(reading.stamp_ns);
}

}  // namespace takt
