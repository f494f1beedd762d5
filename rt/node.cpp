// SPDX-License-Identifier: Apache-2.0
#include "rt/node.hpp"

#include "rt/msg/requests.hpp"
#include "rt/trace/rings.hpp"

namespace takt {
namespace {

void note_answer(Question question, int64_t value, uint32_t job) {
  trace::record({0, value, static_cast<int64_t>(question), job, trace::kNoTask, trace::Kind::answer, 0});
}

}  // namespace

int64_t Job::answer(Question question, int64_t value) const {
  if (recorded_ != nullptr) return recorded_->next(question);
  note_answer(question, value, static_cast<uint32_t>(index_));
  return value;
}

InputPort::InputPort(Node* owner, std::string_view name, const MessageType& type, std::string_view doc, Need need)
    : name_(name), doc_(doc), type_(&type), need_(need) {
  owner->inputs_.push_back(this);
}

OutputPort::OutputPort(Node* owner, std::string_view name, const MessageType& type, std::string_view doc)
    : name_(name), doc_(doc), type_(&type) {
  owner->outputs_.push_back(this);
}

void* OutputPort::loan_message() {
  if (writer_ == nullptr) return nullptr;
  if (loaned_ != nullptr && !sent_) return loaned_ + 1;
  MessageHeader* chunk = writer_->loan();  // none where this job has sent its message already
  if (chunk == nullptr) return note_answer(Question::chunk, 0, 0), nullptr;
  loaned_ = chunk;
  return loaned_ + 1;
}

void OutputPort::send(int64_t stamp_ns) {
  stamp_ns_ = stamp_ns;
  sent_ = loaned_ != nullptr;
}

void Node::may(uint32_t calls, std::string_view reason) {
  allowed_calls_ |= calls;
  reason_of_calls_ = reason;
}

Levels::Levels(Node* owner, std::initializer_list<QualityLevel> levels) {
  if (levels.size() == 0 || levels.size() > kMaxLevels || levels.begin()->cost != 1.0)
    throw std::logic_error("a node has 1 to " + std::to_string(kMaxLevels) + " quality levels, the first of cost 1");
  for (const QualityLevel* level = levels.begin() + 1; level < levels.end(); ++level)
    if (!(level->cost > 0) || !(level->cost < (level - 1)->cost))
      throw std::logic_error("quality level " + std::string(level->name) + " must cost less than the one before it");
  owner->levels_ = levels;
}

void Node::accept_requests() {
  control_ =
      std::make_unique<Input<Requests>>(this, "control", "requests to stop, start or pace this node", Need::optional);
}

std::string_view to_string(Layer layer) {
  switch (layer) {
    case Layer::sensor: return "sensor";
    case Layer::perception: return "perception";
    case Layer::processing: return "processing";
    case Layer::storage: return "storage";
  }
  return "";
}

const NodeType* NodeTypes::find(std::string_view name) const {
  const auto it = types_.find(name);
  return it == types_.end() ? nullptr : &it->second;
}

void NodeTypes::insert(NodeType type) {
  const std::string name = type.name;
  if (!types_.emplace(name, std::move(type)).second) throw std::logic_error("node type " + name + " registered twice");
}

}  // namespace takt
