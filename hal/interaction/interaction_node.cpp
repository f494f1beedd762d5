// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/interaction_node.hpp"

#include <algorithm>

namespace takt {

AnswerParam::AnswerParam(InteractionNode* owner)
    : ParamBase(owner, DeviceNode::kAnswer, "", "what somebody answered on the robot's screen"), owner_(*owner) {}

tl::expected<void, std::string> AnswerParam::set(const ParamValue& value) {
  const auto* const words = std::get_if<std::string>(&value);
  if (!owner_.takes_answers()) return tl::make_unexpected("cannot be set: the device has no screen");
  if (words == nullptr || words->empty()) return tl::make_unexpected("needs words");
  if (!owner_.answer(*words)) return tl::make_unexpected("waits: the answer before it has not been read yet");
  text_ = *words;
  return {};
}

void InteractionNode::setup(Setup& setup) {
  open_in_setup(setup);
  task_.reserve({0, 0, 1, Interaction::kLongestTask});
}

void InteractionNode::start(int64_t epoch_ns) {
  const RobotTask* const last = task_.handed_over();
  const std::string_view given = last != nullptr ? std::string_view(last->text.data(), last->text.size) : "";
  if (last != nullptr) person_->go_on_after(last->number, given);
  DeviceNode::start(epoch_ns);
  started_ = true;
  // Where nobody knows any more what was given, an old answer is not given a second time.
  if (last != nullptr && !from_before_.empty() && from_before_ != given) person_->answer(from_before_);
}

bool InteractionNode::answer(const std::string& words) {
  if (started_) return person_->answer(words);
  from_before_ = words;
  return true;
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
