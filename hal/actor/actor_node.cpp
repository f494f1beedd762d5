// SPDX-License-Identifier: Apache-2.0
#include "hal/actor/actor_node.hpp"

namespace takt {

void ActorNode::run(Job& job) {
  if (!running(job)) return job.no_result();
  // What is under way goes on in safe_stop, as a cup half full is no safer; nothing new begins.
  if (const ActionCommand* wanted = command_.newest(); wanted != nullptr && !command_.stale() && !stands(job.mode()))
    actor_->command(*wanted, job.release_ns());
  const ActorReading reading = actor_->read(job.release_ns(), job.deadline_ns());
  if (!accept(reading.status, job)) return;
  ActionOutcome* message = outcome_.loan();
  if (message == nullptr) return job.no_result();
  *message = reading.outcome;
  outcome_.send(reading.stamp_ns);
}

}  // namespace takt
