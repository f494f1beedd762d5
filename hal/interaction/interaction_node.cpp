// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/interaction_node.hpp"

#include <algorithm>

namespace takt {

void InteractionNode::setup(Setup& setup) {
  open_in_setup(setup);
  task_.reserve({0, 0, 1, Interaction::kLongestTask});
}

void InteractionNode::start(int64_t epoch_ns) {
  if (const RobotTask* last = task_.handed_over()) person_->go_on_after(last->number);
  DeviceNode::start(epoch_ns);
}

void InteractionNode::run(Job& job) {
  if (!running(job)) return job.no_result();
  for (size_t i = 0; i < speech_.size(); ++i)
    if (speech_.is_new(i)) person_->say({speech_[i].text.data(), speech_[i].text.size});
  const InteractionReading reading = person_->read(job.release_ns());
  if (!accept(reading.status, job)) return;
  RobotTask* message = task_.loan();
  if (message == nullptr) return job.no_result();
  message->number = reading.number;
  message->text.resize(reading.task.size());
  std::copy_n(reading.task.begin(), message->text.size, message->text.data());
  task_.send(reading.stamp_ns);
}

}  // namespace takt
