// SPDX-License-Identifier: Apache-2.0
#include "hal/gpio/lines_node.hpp"

namespace takt {

void LinesNode::run(Job& job) {
  if (!running(job)) return job.no_result();
  const LinesReading reading = lines_->read(job.release_ns());
  if (!accept(reading.status, job)) return;
  DigitalState* message = state_.loan();
  if (message == nullptr) return job.no_result();
  message->levels = reading.levels;
  message->changed = reading.changed;
  state_.send(reading.stamp_ns);
}

}  // namespace takt
