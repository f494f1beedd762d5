// SPDX-License-Identifier: Apache-2.0
#include "graph/what_if/stand_in.hpp"

#include <algorithm>

#include "rt/msg/requests.hpp"
#include "rt/record/packed_message.hpp"
#include "rt/sched/port_access.hpp"

namespace takt::what_if {

const MessageType& stand_in_type(const MessageType& type) {
  return type.name == Requests::type_name ? type : MessageType::of<Blank>();
}

StandIn::StandIn(const TaskPlan& real, const RecordedTask& recorded) : real_(real), recorded_(recorded) {
  for (const InputPort* input : real.node->inputs())
    if (input != real.node->control())
      inputs_.emplace_back(this, input->name(), stand_in_type(input->type()), input->doc(), input->need());
  if (real.node->control() != nullptr) accept_requests();  // the last input, as of the real node
  for (const OutputPort* output : real.node->outputs())
    outputs_.emplace_back(this, output->name(), stand_in_type(output->type()), output->doc());
  const auto& levels = real.node->levels();
  if (levels.size() == 2) Levels(this, {levels[0], levels[1]});
  if (levels.size() == 3) Levels(this, {levels[0], levels[1], levels[2]});
  if (levels.size() == 4) Levels(this, {levels[0], levels[1], levels[2], levels[3]});
  static_assert(kMaxLevels == 4);
}

void StandIn::run(Job& job) {
  const uint32_t count = past_ == nullptr ? 0 : past_->count;
  bool sent = false;
  for (uint32_t i = 0; i < count; ++i) {
    const Publication& message = recorded_.published[past_->first + i];
    const auto stamp = stamp_ns(message, job);
    Port& output = outputs_[message.output];
    void* loaned = stamp ? output.loan() : nullptr;
    if (loaned == nullptr) continue;
    if (message.content && !record::unpack(output.type(), *message.content, loaned)) continue;
    output.send(*stamp);
    sent = true;
  }
  if (!sent && !outputs_.empty()) job.no_result();
}

/// Nothing: the message that it would be made of is not there.
std::optional<int64_t> StandIn::stamp_ns(const Publication& message, const Job& job) const {
  const StampOrigin& origin = message.stamp;
  if (origin.of == StampOrigin::release) return job.release_ns() + origin.offset_ns;
  if (origin.of == StampOrigin::start) return job.now_ns() + origin.offset_ns;
  const InputPort& input = *inputs()[real_.edges[origin.edge].input];
  if (input.empty()) return std::nullopt;
  const size_t from = input.size() - 1 - std::min<size_t>(origin.back, input.size() - 1);
  if (message.if_new && !input.is_new(from)) return std::nullopt;
  return input.stamp_ns(from) + origin.offset_ns;
}

}  // namespace takt::what_if
