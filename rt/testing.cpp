// SPDX-License-Identifier: Apache-2.0
#include "rt/testing.hpp"

#include <algorithm>

#include "rt/memory/memory_use.hpp"
#include "rt/memory/sanitized.hpp"
#include "rt/sched/node_log.hpp"
#include "rt/sched/port_access.hpp"

namespace takt::test {
namespace {

template <class List>
auto& named(const List& list, std::string_view kind, std::string_view name) {
  std::string choices;
  for (auto* one : list) {
    if (one->name() == name) return *one;
    choices += (choices.empty() ? "" : ", ") + std::string(one->name());
  }
  throw std::logic_error("the node has no " + std::string(kind) + " " + std::string(name) + "; it has " +
                         (choices.empty() ? "none" : choices));
}

template <class List>
size_t place_of(const List& list, const void* one) {
  return static_cast<size_t>(std::find(list.begin(), list.end(), one) - list.begin());
}

/// By name: two libraries may each have a description of the type.
template <class Port>
void require_type(const Port& port, const MessageType& type) {
  if (port.type().name != type.name)
    throw std::logic_error(std::string(port.name()) + " carries " + std::string(port.type().name) + ", not " +
                           std::string(type.name));
}

void require_counter(bool counts) {
#if !defined(TAKT_SANITIZED)
  if (!counts) throw std::logic_error("this program counts no allocations; link takt_allocation_counter into it");
#endif
  static_cast<void>(counts);
}

}  // namespace

Chunk::Chunk(const MessageType& type, const Capacity& capacity) : type_(&type), capacity_(capacity) {
  const size_t bytes = (sizeof(MessageHeader) + type.bytes(capacity) + 63) / 64 * 64;
  memory_.reset(std::aligned_alloc(64, bytes));
  if (!memory_) throw std::bad_alloc();
  header_ = ::new (memory_.get()) MessageHeader;
  clear();
}

ChunkWriter::ChunkWriter(OutputPort& port, bool read) : chunk_(port.type(), port.capacity()), port_(&port) {
  PortAccess::attach(port, this);
  if (read) PortAccess::mark_read(port);
}

MessageHeader* ChunkWriter::loan() {
  if (refuses && sent()) return ++refused, nullptr;
  chunk_.clear();
  return &chunk_.header();
}

bool ChunkWriter::sent() const { return PortAccess::sent(*port_); }
int64_t ChunkWriter::stamp_ns() const { return PortAccess::stamp_ns(*port_); }
void ChunkWriter::clear() { PortAccess::reset(*port_); }

InputPort& input(Node& node, std::string_view name) { return named(node.inputs(), "input", name); }
OutputPort& output(Node& node, std::string_view name) { return named(node.outputs(), "output", name); }

void set(Node& node, std::string_view name, const ParamValue& value) {
  if (const auto done = named(node.params(), "parameter", name).set(value); !done)
    throw std::logic_error(std::string(name) + " " + done.error());
}

void latch(InputPort& port, Chunk& chunk, int64_t stamp_ns, uint64_t sequence, size_t slot) {
  PortAccess::held(port)[slot] = {&chunk.header(), sequence, stamp_ns, 0, 0};
  PortAccess::set_held(port, slot + 1, false, sequence - 1 - slot);
}

bool run(Node& node, uint64_t index) {
  Job job(standing_clock, index, 0, 100'000'000, 0, "full");
  node.run(job);
  return !job.without_result();
}

void set_up(Node& node, const std::filesystem::path& output) {
  Setup setup{standing_clock, ".", output, 0, std::nullopt, 0};
  node.setup(setup);
  node.end_setup();
}

struct NodeRun::Log {
  NodeLog log;
  LogWriter writer{log};
  LogReader reader;
  std::vector<LogLine> lines;
};

NodeRun::NodeRun(std::unique_ptr<Node> node) : node_(std::move(node)), log_(std::make_unique<Log>()) {}
NodeRun::~NodeRun() = default;

void NodeRun::before_start(std::string_view what) const {
  if (started_) throw std::logic_error(std::string(what) + ": only before the node is set up");
}

void NodeRun::set(std::string_view name, const ParamValue& value) {
  if (!started_) return test::set(*node_, name, value);
  const ParamBase& param = named(node_->params(), "parameter", name);
  if (!param.live())
    throw std::logic_error(std::string(name) +
                           " is fixed, or setup() reads it and changed() does not: set it before the first job");
  if (const auto done = node_->change(place_of(node_->params(), &param), value); !done)
    throw std::logic_error(std::string(name) + " " + done.error());
}

void NodeRun::connect(std::string_view name, const Capacity& capacity) {
  InputPort& port = input(*node_, name);
  before_start(name);
  PortAccess::connect(port, capacity);
}

void NodeRun::depth(std::string_view name, size_t messages) {
  if (messages < 1 || messages > InputPort::kMaxDepth)
    throw std::logic_error("depth of " + std::string(name) + " is " + std::to_string(messages) + ", must lie in 1.." +
                           std::to_string(InputPort::kMaxDepth));
  latched(name).depth = messages;
}

void NodeRun::leave_unread(std::string_view name) {
  before_start(name);
  unread_.push_back(&output(*node_, name));
}

void* NodeRun::hand_over(std::string_view name, const MessageType& type, const Capacity& capacity) {
  OutputPort& port = output(*node_, name);
  before_start(name);
  require_type(port, type);
  void* message = handed_over_.emplace_back(type, capacity).message();  // a chunk moves, its memory stays
  PortAccess::hand_over(port, message);
  return message;
}

void NodeRun::start() {
  if (started_) return;
  started_ = true;
  for (InputPort* port : node_->inputs())
    if (port->need() == Need::required && !port->connected()) PortAccess::connect(*port, {});
  const auto read = [&](const OutputPort* port) {
    return std::find(unread_.begin(), unread_.end(), port) == unread_.end();
  };
  for (OutputPort* port : node_->outputs())
    if (read(port)) PortAccess::mark_read(*port);
  Setup setup{clock_, read_, write_, seed_, rate_, 0};
  node_->setup(setup);
  node_->end_setup();
  for (OutputPort* port : node_->outputs()) {
    outputs_.push_back(std::make_unique<ChunkWriter>(*port, read(port)));
    outputs_.back()->refuses = true;
  }
  node_->start(kEpochNs);
}

void* NodeRun::put(std::string_view name, int64_t stamp_ns, const MessageType& type) {
  InputPort& port = input(*node_, name);
  require_type(port, type);
  if (!port.connected()) connect(name);
  const Capacity& most = port.capacity();
  const bool arrays =
      std::any_of(type.fields.begin(), type.fields.end(), [](const Field& field) { return field.is_array(); });
  if (arrays && most.width == 0 && most.height == 0 && most.count == 0)
    throw std::logic_error(std::string(name) + " carries " + std::string(type.name) +
                           ", which has arrays: say how large they become, for instance connect(\"" +
                           std::string(name) + "\", {.count = 64})");
  Latched& in = latched(name);
  if (in.messages.size() == in.depth) in.messages.pop_front();
  in.messages.push_back({Chunk(type, most), stamp_ns, ++in.sequence});
  in.stale = false;
  return in.messages.back().chunk.message();
}

void NodeRun::make_stale(std::string_view name) { latched(name).stale = true; }

void NodeRun::empty(std::string_view name) {
  latched(name).messages.clear();
  latched(name).stale = true;
}

void NodeRun::level(int index) {
  if (index < 0 || static_cast<size_t>(index) >= node_->levels().size())
    throw std::logic_error("level is " + std::to_string(index) + ", must lie in 0.." +
                           std::to_string(node_->levels().size() - 1));
  level_ = index;
}

bool NodeRun::run() { return run_at(rate_.release_ns(kEpochNs, static_cast<int64_t>(index_))); }

bool NodeRun::run_at(int64_t release_ns) {
  start();
  clock_.advance_to(release_ns);
  for (size_t i = 0; i < inputs_.size(); ++i) {
    InputPort& port = *node_->inputs()[i];
    Latched& in = inputs_[i];
    size_t slot = 0;
    for (Message& message : in.messages)
      PortAccess::held(port)[slot++] = {&message.chunk.header(), message.sequence, message.stamp_ns, 0, 0};
    PortAccess::set_held(port, slot, in.stale, in.seen);
    in.seen = in.sequence;
  }
  for (const auto& output : outputs_) output->clear();
  const int64_t to_deadline = deadline_ns_ > 0 ? deadline_ns_ : rate_.period_ns();
  job_.emplace(clock_, index_++, release_ns, release_ns + to_deadline, level_, mode_);
  job_->log_to(log_->writer);
  calls_.fill(0);
  JobCalls calls;
  calls.job = job_->index();
  calls.counts = calls_.data();
  calls.allowed = node_->allowed_calls();
  calls.warm = false;
  const MemoryUse before = thread_memory_use();
  {
    const JobScope scope(calls);
    node_->run(*job_);
  }
  allocations_ = (thread_memory_use() - before).allocations;
  log_->lines.clear();
  log_->reader.take(log_->log, [&](const LogLine& line) { log_->lines.push_back(line); });
  return !job_->without_result();
}

const void* NodeRun::sent(std::string_view name, const MessageType& type) {
  ChunkWriter& from = writer(name);
  require_type(from.port(), type);
  return from.sent() ? from.chunk_.message() : nullptr;
}

int64_t NodeRun::stamp_ns(std::string_view name) {
  if (!writer(name).sent()) throw std::logic_error("the last job sent nothing on " + std::string(name));
  return writer(name).stamp_ns();
}

const Job& NodeRun::job() const {
  if (!job_) throw std::logic_error("no job has run yet");
  return *job_;
}

std::vector<LogLine> NodeRun::log() const { return log_->lines; }

uint64_t NodeRun::allocations() const {
  require_counter(counting_allocations());
  return allocations_;
}

std::string NodeRun::forbidden_calls() const {
  require_counter(watching_job_calls());
  std::string text;
  for (size_t call = 0; call < kJobCalls; ++call)
    if (calls_[call] > 0)
      text += (text.empty() ? "" : ", ") + std::string(to_string(static_cast<JobCall>(call))) + " " +
              std::to_string(calls_[call]);
  return text;
}

NodeRun::Latched& NodeRun::latched(std::string_view name) {
  return inputs_[place_of(node_->inputs(), &input(*node_, name))];
}

ChunkWriter& NodeRun::writer(std::string_view name) {
  const OutputPort& port = output(*node_, name);
  start();
  return *outputs_[place_of(node_->outputs(), &port)];
}

}  // namespace takt::test
