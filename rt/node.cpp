// SPDX-License-Identifier: Apache-2.0
#include "rt/node.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <exception>
#include <utility>

#include "rt/msg/node_state.hpp"
#include "rt/msg/requests.hpp"
#include "rt/sched/node_log.hpp"
#include "rt/trace/rings.hpp"

namespace takt {
namespace {

constexpr size_t kMostState = 256 << 20;  ///< bytes

void note_answer(Question question, int64_t value, uint32_t job) {
  trace::record({0, value, static_cast<int64_t>(question), job, trace::kNoTask, trace::Kind::answer, 0});
}

}  // namespace

int64_t Job::answer(Question question, int64_t value) const {
  if (recorded_ != nullptr) return recorded_->next(question);
  note_answer(question, value, static_cast<uint32_t>(index_));
  return value;
}

void Job::log(LogLevel level, const char* format, ...) {
  if (log_ == nullptr) return;
  LogLine line;
  line.at_ns = clock_->now_ns();
  if (!log_->admits(level, line.at_ns)) return;
  line.job = index_;
  line.level = level;
  va_list values;
  va_start(values, format);
  std::vsnprintf(line.text.characters.data(), line.text.characters.size(), format, values);
  va_end(values);
  log_->append(line);
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
  void* const message = loan_chunk();  // none where this job has sent its message already
  if (message == nullptr) note_answer(Question::chunk, 0, 0);
  return message;
}

void* OutputPort::loan_chunk() {
  if (loaned_ != nullptr && !sent_) return loaned_ + 1;
  MessageHeader* chunk = writer_ != nullptr ? writer_->loan() : nullptr;
  if (chunk == nullptr) return nullptr;
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

void Node::end_setup() {
  std::vector<ParamBase*> read;
  for (ParamBase* param : params_)
    if (std::exchange(param->used_, false)) read.push_back(param);
  changed();
  for (ParamBase* param : params_) param->live_ = param->fixed().empty();
  for (ParamBase* param : read) param->live_ = param->live_ && param->used_;
}

tl::expected<void, std::string> Node::change(size_t index, const ParamValue& value) {
  ParamBase& param = *params_[index];
  const ParamValue before = param.value();
  if (auto done = param.set(value); !done) return done;
  try {
    changed();
  } catch (const std::exception& problem) {
    static_cast<void>(param.set(before));  // it had that value
    changed();
    return tl::unexpected(std::string(problem.what()));
  }
  return {};
}

void Node::accept_requests() {
  control_ =
      std::make_unique<Input<Requests>>(this, "control", "requests to stop, start or pace this node", Need::optional);
}

void Node::publish_state() {
  const bool taken =  // by an output of its own
      std::any_of(outputs_.begin(), outputs_.end(), [](const OutputPort* port) { return port->name() == "state"; });
  state_ = std::make_unique<Output<NodeState>>(this, taken ? "remembered" : "state",
                                               "what this node remembers, for a replay");
}

void Node::size_state() {
  StateArchive measured = StateArchive::measuring();
  remember(measured);
  state_layout_ = measured.layout();
  state_->reserve({.count = static_cast<uint32_t>(std::min<size_t>(measured.bytes(), kMostState))});
}

bool Node::save_state(int64_t stamp_ns) {
  auto* const out = static_cast<NodeState*>(state_->loan_chunk());
  if (out == nullptr) return false;
  StateArchive saved = StateArchive::saving(std::as_writable_bytes(std::span(out->bytes.data(), out->bytes.capacity)));
  remember(saved);
  out->layout = saved.failed() ? 0 : state_layout_;
  out->bytes.resize(saved.failed() ? 0 : saved.bytes());
  state_->send(stamp_ns);
  return true;
}

tl::expected<void, std::string> Node::load_state(const NodeState& state) {
  if (state.layout == 0) return tl::unexpected(std::string("it did not fit into its message"));
  if (state.layout != state_layout_) return tl::unexpected(std::string("it is that of another version of the node"));
  StateArchive loaded = StateArchive::loading(std::as_bytes(state.bytes.items()));
  remember(loaded);
  if (loaded.failed() || !loaded.at_end()) return tl::unexpected(std::string("its bytes do not fit the node"));
  return {};
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
