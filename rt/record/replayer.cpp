// SPDX-License-Identifier: Apache-2.0
#include "rt/record/replayer.hpp"

#include <algorithm>
#include <cstring>
#include <new>
#include <set>
#include <utility>

#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/node_state.hpp"
#include "rt/sched/port_access.hpp"

namespace takt::record {
namespace {

template <class Each>
void for_each_held(const RecordedJob& record, const Each& each) {
  for (const RecordedJob::Input& input : record.inputs)
    for (const RecordedJob::Run& run : input.held)
      for (uint64_t sequence = run.first; sequence < run.first + run.count; ++sequence) each(input.edge, sequence);
}

const Restart& restart_of(const RecordedEvent& event) {
  const auto* const snapshot = std::get_if<Snapshot>(&event.what);
  return snapshot != nullptr ? snapshot->from : std::get<Restart>(event.what);
}

const char* to_string(Question question) {
  switch (question) {
    case Question::now: return "now";
    case Question::time_left: return "time_left";
    case Question::done: return "done";
    case Question::chunk: break;
  }
  return "chunk";
}

}  // namespace

/// A message in memory of its own.
struct Replayer::Stored {
  explicit Stored(const PortPlan& port) : bytes(port.chunk_bytes()), memory(aligned_bytes(bytes)) { place(port); }
  /// Empty again. What a node does not write itself is no zero by chance.
  void place(const PortPlan& port) {
    std::memset(memory.get(), 0xA5, bytes);
    header = ::new (memory.get()) MessageHeader{};
    port.type->place(memory.get() + sizeof(MessageHeader), port.capacity);
  }
  void* message() { return header + 1; }
  const void* message() const { return header + 1; }

  size_t bytes;
  AlignedBytes memory;
  MessageHeader* header = nullptr;
};

struct Replayer::Port {
  uint16_t channel = 0;
  std::set<uint64_t> remade;          ///< sequences that the jobs to be run published in the record
  std::map<uint64_t, uint64_t> uses;  ///< jobs that are still to hold it, by sequence
  std::map<uint64_t, std::shared_ptr<Stored>> messages;
  std::shared_ptr<Stored> newest;
  std::vector<std::shared_ptr<Stored>> spare;
  uint64_t before = 0;  ///< the newest one that is not made again
  std::unique_ptr<PortWriter> writer;
  std::vector<std::byte> packed;
};

class Replayer::Answers final : public RecordedAnswers {
 public:
  void begin(const RecordedJob& job) {
    job_ = &job;
    answers_ = &job.answers;
    next_ = 0;
    strange_.clear();
  }
  int64_t next(Question question) override {
    const bool there = next_ < answers_->size();
    if (there && (*answers_)[next_].question == question) return (*answers_)[next_++].value;
    if (strange_.empty())
      strange_ = std::string("asked for ") + to_string(question) + " where the record has " +
                 (there ? to_string((*answers_)[next_].question) : "nothing more asked");
    return question == Question::now ? job_->start_ns : job_->deadline_ns - job_->start_ns;
  }
  /// A loan that found no chunk.
  bool refused_loan() {
    if (next_ == answers_->size() || (*answers_)[next_].question != Question::chunk) return false;
    ++next_;
    return true;
  }
  /// Empty if the job asked what it had asked before.
  std::string strange() const {
    if (!strange_.empty() || next_ == answers_->size()) return strange_;
    return std::string("did not ask for ") + to_string((*answers_)[next_].question) + " as in the record";
  }

 private:
  const RecordedJob* job_ = nullptr;
  const std::vector<RecordedJob::Answer>* answers_ = nullptr;
  size_t next_ = 0;
  std::string strange_;
};

class Replayer::PortWriter final : public Writer {
 public:
  PortWriter(Replayer& replayer, size_t port) : replayer_(replayer), port_(port) {}
  MessageHeader* loan() override {
    if (replayer_.answers_->refused_loan()) return nullptr;
    loaned_ = replayer_.buffer(port_);
    return loaned_->header;
  }
  std::shared_ptr<Stored> take() { return std::exchange(loaned_, nullptr); }
  void publish(int64_t, int64_t, int64_t) override {}
  void discard() override {}
  bool repeat(int64_t, int64_t) override { return false; }
  WriterStatistics statistics() const override { return {}; }

 private:
  Replayer& replayer_;
  const size_t port_;
  std::shared_ptr<Stored> loaned_;
};

Replayer::Replayer(const Plan& plan, LogFile& log, const Options& options)
    : plan_(plan), log_(log), options_(options), answers_(std::make_unique<Answers>()), ports_(plan.ports.size()) {
  for (size_t p = 0; p < ports_.size(); ++p)
    ports_[p].channel = log_.channel(plan_.ports[p].node + "." + plan_.ports[p].port);
  for (size_t t = 0; t < plan_.tasks.size(); ++t) {
    const TaskPlan& task = plan_.tasks[t];
    last_seen_.emplace_back(task.edges.size(), uint64_t{0});
    if (!runs(t)) continue;
    for (const size_t port : task.ports) ports_[port].writer = std::make_unique<PortWriter>(*this, port);
    attach_writers(t);
  }
  begin_tasks();
  note_restarts();
  select_jobs();
  count_uses();
}

void Replayer::attach_writers(size_t t) {
  const TaskPlan& task = plan_.tasks[t];
  for (size_t i = 0; i < task.ports.size(); ++i)
    PortAccess::attach(*task.node->outputs()[i], ports_[task.ports[i]].writer.get());
}

Replayer::~Replayer() {
  for (const TaskPlan& task : plan_.tasks)
    for (OutputPort* output : task.node->outputs()) PortAccess::attach(*output, nullptr);
}

bool Replayer::runs(size_t task) const {
  return !plan_.tasks[task].device && (options_.run.empty() || options_.run[task] != 0);
}

bool Replayer::fits(const RecordedJob& job) const {
  if (job.task >= plan_.tasks.size()) return false;
  const TaskPlan& task = plan_.tasks[job.task];
  const auto& inputs = job.inputs;
  return std::all_of(inputs.begin(), inputs.end(),
                     [&](const RecordedJob::Input& input) {
                       return input.edge < task.edges.size() &&
                              std::all_of(input.held.begin(), input.held.end(), [](const RecordedJob::Run& run) {
                                return run.count <= InputPort::kMaxDepth;
                              });
                     }) &&
         std::all_of(job.params.begin(), job.params.end(),
                     [&](const RecordedJob::Param& param) { return param.param < task.node->params().size(); }) &&
         job.level >= 0 && static_cast<size_t>(job.level) < task.node->levels().size();
}

void Replayer::begin_tasks() {
  std::vector<char> runs;
  for (size_t t = 0; t < plan_.tasks.size(); ++t) runs.push_back(this->runs(t) ? 1 : 0);
  beginnings_ = beginnings(plan_, log_, runs, options_.begin_ns);
  for (size_t t = 0; t < runs.size(); ++t) {
    if (runs[t] == 0) continue;
    const Beginning& mine = beginnings_[t];
    const bool afresh = mine.in_the_middle || (mine.snapshot != nullptr && std::get<Snapshot>(mine.snapshot->what).state == 0);
    if (afresh && counts(t) && result_.begun_afresh++ == 0)
      result_.stateless = plan_.tasks[t].name + (mine.in_the_middle ? ": the record has no snapshot of it"
                                                                   : ": its type does not say what it remembers");
    if (mine.snapshot == nullptr) continue;
    result_.begun += counts(t);
    for (const Restart::Output& output : std::get<Snapshot>(mine.snapshot->what).from.outputs)
      if (output.output < plan_.tasks[t].ports.size()) ports_[plan_.tasks[t].ports[output.output]].before = output.newest;
  }
}

bool Replayer::is_state(size_t task, size_t output) const {
  return plan_.tasks[task].node->outputs()[output] == plan_.tasks[task].node->state();
}

/// What a task goes through before a job. Snapshots: that where it begins, and those with which it could go on after
/// jobs that could not be run.
bool Replayer::applies(const RecordedEvent& event) const {
  if (event.task >= plan_.tasks.size() || !runs(event.task) || event.at_ns < beginnings_[event.task].at_ns())
    return false;
  const auto* const snapshot = std::get_if<Snapshot>(&event.what);
  return snapshot != nullptr ? &event == beginnings_[event.task].snapshot || snapshot->state > 0
                             : std::holds_alternative<Restart>(event.what);
}

void Replayer::note_restarts() {
  restarts_.resize(plan_.tasks.size());
  for (const RecordedEvent& event : log_.events())
    if (applies(event)) restarts_[event.task].events.push_back(&event);
  for (Restarts& of_task : restarts_)
    std::stable_sort(of_task.events.begin(), of_task.events.end(),
                     [](const RecordedEvent* a, const RecordedEvent* b) { return a->at_ns < b->at_ns; });
}

/// The first one after the job began.
const Restart* Replayer::next_restart(const RecordedJob& job) const {
  for (const RecordedEvent* event : restarts_[job.task].events)
    if (event->at_ns > job.start_ns && std::holds_alternative<Restart>(event->what))
      return &std::get<Restart>(event->what);
  return nullptr;
}

void Replayer::keep_committed(const RecordedJob& job) {
  RecordedJob committed = job;
  // Without a restart after it nobody says so: then what came out is what others held.
  if (const Restart* after = next_restart(job))
    std::erase_if(committed.outputs, [&](const RecordedJob::Output& offered) {
      return std::none_of(after->outputs.begin(), after->outputs.end(), [&](const Restart::Output& output) {
        return output.output == offered.output && offered.sequence <= output.newest;
      });
    });
  if (committed.outputs.empty()) result_.uncommitted += counts(job.task);
  else order_.push_back(&committed_.emplace_back(std::move(committed)));
}

/// By start; a job that starts when another publishes may hold what that one made.
void Replayer::select_jobs() {
  for (const RecordedJob& job : log_.jobs()) {
    if (!fits(job)) result_.lacking += job.task >= plan_.tasks.size() || counts(job.task);
    else if (!runs(job.task) || job.index < beginnings_[job.task].job() || job.release_ns >= options_.end_ns) continue;
    else if (job.cut_off) keep_committed(job);
    else order_.push_back(&job);
  }
  std::stable_sort(order_.begin(), order_.end(), [](const RecordedJob* a, const RecordedJob* b) {
    return std::pair(a->start_ns, a->published_ns) < std::pair(b->start_ns, b->published_ns);
  });
}

/// A node that is told what it remembered needs no more.
template <class Each>
void Replayer::for_each_handed_over(const RecordedEvent& event, const Each& each) const {
  const auto* const snapshot = std::get_if<Snapshot>(&event.what);
  if (snapshot != nullptr && (snapshot->state > 0 || &event != beginnings_[event.task].snapshot)) return;
  const std::vector<size_t>& ports = plan_.tasks[event.task].ports;
  for (const Restart::Output& output : restart_of(event).outputs)
    if (output.output < ports.size() && output.handed_over > 0) each(output.output, output.handed_over);
}

void Replayer::count_uses() {
  for (const Restarts& of_task : restarts_)
    for (const RecordedEvent* restart : of_task.events)
      for_each_handed_over(*restart, [&](uint16_t output, uint64_t sequence) {
        ++ports_[plan_.tasks[restart->task].ports[output]].uses[sequence];
      });
  for (const RecordedJob* selected : order_) {
    const RecordedJob& job = *selected;
    for_each_held(job, [&](uint16_t edge, uint64_t sequence) {
      ++ports_[plan_.tasks[job.task].edges[edge].port].uses[sequence];
    });
    const std::vector<size_t>& ports = plan_.tasks[job.task].ports;
    for (const RecordedJob::Output& output : job.outputs)
      if (output.output < ports.size() && !is_state(job.task, output.output))
        ports_[ports[output.output]].remade.insert(output.sequence);
  }
}

ReplayResult Replayer::run(const std::function<bool()>& stop) {
  int64_t first = INT64_MAX, last = INT64_MIN;
  for (const RecordedJob* record : order_) {
    if (stop && stop()) break;
    if (options_.pace) options_.pace(record->release_ns);
    first = std::min(first, record->release_ns);
    last = std::max(last, record->published_ns);
    restart_before(*record);
    run_job(*record);
  }
  if (last > first) result_.recorded_ns = last - first;
  count_unmade();
  return result_;
}

/// What the task went through between its last job and this one.
void Replayer::restart_before(const RecordedJob& job) {
  Restarts& mine = restarts_[job.task];
  for (; mine.done < mine.events.size() && mine.events[mine.done]->at_ns <= job.start_ns; ++mine.done) {
    const RecordedEvent& event = *mine.events[mine.done];
    if (std::holds_alternative<Restart>(event.what)) mine.failed = !restart(event);
    else if (mine.failed || &event == beginnings_[job.task].snapshot) mine.failed = !begin_at(event);
  }
}

/// Of a node that runs for the first time, or has gone astray.
bool Replayer::begin_at(const RecordedEvent& event) {
  const auto& [from, state] = std::get<Snapshot>(event.what);
  if (!restart(event)) return false;
  if (state == 0) return true;
  Node& node = *plan_.tasks[event.task].node;
  Port& port = ports_[plan_.tasks[event.task].ports.back()];
  const Stored* const message = node.state() != nullptr ? stored(plan_.tasks[event.task].ports.back(), state) : nullptr;
  const auto loaded = message == nullptr ? tl::unexpected(std::string("the record lacks it"))
                                         : node.load_state(*static_cast<const NodeState*>(message->message()));
  port.messages.erase(state);
  if (loaded || &event != beginnings_[event.task].snapshot) return loaded.has_value();
  if (counts(event.task) && result_.begun_afresh++ == 0)
    result_.stateless = plan_.tasks[event.task].name + ": what it remembered cannot be loaded: " + loaded.error();
  return restart(event);  // half loaded is worse
}

bool Replayer::restart(const RecordedEvent& event) {
  const TaskPlan& task = plan_.tasks[event.task];
  const Restart& restart = restart_of(event);
  bool whole = options_.renew != nullptr;
  if (whole) {
    options_.renew(event.task);
    attach_writers(event.task);
  }
  whole = whole && std::all_of(restart.params.begin(), restart.params.end(), [&](const RecordedJob::Param& kept) {
            const auto& params = task.node->params();
            return kept.param < params.size() && params[kept.param]->set(kept.value);
          });
  for_each_handed_over(event, [&](uint16_t output, uint64_t sequence) {
    const Stored* message = stored(task.ports[output], sequence);
    whole = whole && message != nullptr;
    if (whole) PortAccess::hand_over(*task.node->outputs()[output], message->message());
  });
  if (whole) {
    clock_.advance_to(event.at_ns);
    task.node->start(options_.epoch_ns);
    result_.restarts += counts(event.task) && std::holds_alternative<Restart>(event.what);
  }
  for (OutputPort* output : task.node->outputs()) PortAccess::hand_over(*output, nullptr);
  for_each_handed_over(event, [&](uint16_t output, uint64_t sequence) { use(task.ports[output], sequence); });
  for (const Restart::Seen& seen : restart.seen)
    if (seen.edge < task.edges.size()) last_seen_[event.task][seen.edge] = seen.sequence;
  return whole;
}

/// Of the nodes that run: what a job lost in the record made, and cannot be made again.
void Replayer::count_unmade() {
  for (size_t t = 0; t < plan_.tasks.size(); ++t) {
    if (!runs(t) || !counts(t) || options_.end_ns != INT64_MAX) continue;
    for (const size_t port : plan_.tasks[t].ports)
      for (const auto& [sequence, known] : log_.messages(ports_[port].channel))
        result_.unmade += !known.whole && sequence > ports_[port].before && !ports_[port].remade.contains(sequence);
  }
}

void Replayer::run_job(const RecordedJob& record) {
  const TaskPlan& task = plan_.tasks[record.task];
  clock_.advance_to(record.start_ns);
  for (const RecordedJob::Param& changed : record.params)
    if (auto done = task.node->params()[changed.param]->set(changed.value); !done)
      tell(record, kNone, "a parameter of the record is refused: " + done.error());
  if (!restarts_[record.task].failed && fill_inputs(record)) {
    const std::string& mode = record.mode < plan_.modes.size() ? plan_.modes[record.mode].name : plan_.mode;
    Job job(clock_, record.index, record.release_ns, record.deadline_ns, record.level, mode);
    answers_->begin(record);
    job.answer_from(*answers_);
    try {
      task.node->run(job);
    } catch (...) {  // as in the run, which has told of it
    }
    result_.jobs += counts(record.task);
    settle(record);
  } else {
    result_.lacking += counts(record.task);
    const Restarts& mine = restarts_[record.task];
    const bool goes_on = std::any_of(mine.events.begin() + static_cast<ptrdiff_t>(mine.done), mine.events.end(),
                                     [](const RecordedEvent* e) { return std::holds_alternative<Snapshot>(e->what); });
    if (goes_on) restarts_[record.task].failed = true;  // what it would make now is nobody's
    // It makes nothing; the record may have it.
    for (const RecordedJob::Output& output : record.outputs)
      if (output.output < task.ports.size()) ports_[task.ports[output.output]].remade.erase(output.sequence);
  }
  let_go(record);
}

bool Replayer::fill_inputs(const RecordedJob& record) {
  const TaskPlan& task = plan_.tasks[record.task];
  std::vector<uint64_t>& seen = last_seen_[record.task];
  for (const EdgePlan& edge : task.edges) PortAccess::set_held(*task.node->inputs()[edge.input], 0, false, 0);
  bool whole = true;
  for (const RecordedJob::Input& told : record.inputs) {
    const EdgePlan& edge = task.edges[told.edge];
    InputPort& input = *task.node->inputs()[edge.input];
    auto& held = PortAccess::held(input);
    size_t count = 0;
    for (const RecordedJob::Run& run : told.held) {
      for (uint64_t sequence = run.first; sequence < run.first + run.count && count < held.size(); ++sequence) {
        const Stored* message = stored(edge.port, sequence);
        if (message == nullptr) {
          whole = false;
          continue;
        }
        const MessageHeader& header = *message->header;
        held[count++] = {&header, sequence, header.stamp_ns, header.visible_at_ns, 0};
      }
    }
    PortAccess::set_held(input, count, told.stale, seen[told.edge]);
    if (count > 0) seen[told.edge] = std::max(seen[told.edge], held[count - 1].sequence);
  }
  return whole;
}

Replayer::Stored* Replayer::stored(size_t p, uint64_t sequence) {
  const auto there = ports_[p].messages.find(sequence);
  if (there != ports_[p].messages.end()) return there->second.get();
  return ports_[p].remade.contains(sequence) ? nullptr : load(p, sequence);
}

Replayer::Stored* Replayer::load(size_t p, uint64_t sequence) {
  const auto record = log_.message(ports_[p].channel, sequence);
  if (!record || !record->whole) return nullptr;
  auto message = buffer(p);
  if (!unpack(*plan_.ports[p].type, record->data, message->message())) return nullptr;
  *message->header = {};
  message->header->stamp_ns = record->stamp_ns;
  message->header->published_ns = record->published_ns;
  message->header->visible_at_ns = record->visible_at_ns;
  message->header->sequence = sequence;
  message->header->level = record->level;
  return (ports_[p].messages[sequence] = std::move(message)).get();
}

std::shared_ptr<Replayer::Stored> Replayer::buffer(size_t p) {
  Port& port = ports_[p];
  if (port.spare.empty()) return std::make_shared<Stored>(plan_.ports[p]);
  auto buffer = std::move(port.spare.back());
  port.spare.pop_back();
  buffer->place(plan_.ports[p]);
  return buffer;
}

void Replayer::let_go(const RecordedJob& record) {
  const TaskPlan& task = plan_.tasks[record.task];
  for (const EdgePlan& edge : task.edges) PortAccess::set_held(*task.node->inputs()[edge.input], 0, true, 0);
  for_each_held(record, [&](uint16_t edge, uint64_t sequence) { use(task.edges[edge].port, sequence); });
}

/// One who was still to need the message has had it.
void Replayer::use(size_t p, uint64_t sequence) {
  Port& port = ports_[p];
  if (--port.uses[sequence] > 0) return;
  port.uses.erase(sequence);
  const auto message = port.messages.find(sequence);
  if (message == port.messages.end()) return;
  if (message->second.use_count() == 1) port.spare.push_back(std::move(message->second));
  port.messages.erase(message);
}

void Replayer::settle(const RecordedJob& record) {
  if (const std::string strange = answers_->strange(); !strange.empty()) tell(record, kNone, strange);
  const TaskPlan& task = plan_.tasks[record.task];
  for (size_t i = 0; i < task.ports.size(); ++i) {
    if (is_state(record.task, i)) continue;  // its padding may hold anything
    const auto told = std::find_if(record.outputs.begin(), record.outputs.end(),
                                   [&](const RecordedJob::Output& output) { return output.output == i; });
    settle_output(record, told == record.outputs.end() ? nullptr : &*told, i);
  }
}

void Replayer::settle_output(const RecordedJob& record, const RecordedJob::Output* told, size_t i) {
  const TaskPlan& task = plan_.tasks[record.task];
  const size_t p = task.ports[i];
  Port& port = ports_[p];
  OutputPort& output = *task.node->outputs()[i];
  const bool sent = PortAccess::sent(output);
  const int64_t stamp_ns = PortAccess::stamp_ns(output);
  std::shared_ptr<Stored> made = port.writer->take();
  PortAccess::reset(output);
  const bool withheld =
      record.cut_off || (record.late && (task.on_miss == OnMiss::skip || task.on_miss == OnMiss::reuse_last));
  if (told != nullptr && told->repeated) {
    made = port.newest;
    if (made == nullptr) return static_cast<void>(ports_[p].remade.erase(told->sequence));  // the record has it
  } else if (told == nullptr) {
    if (sent && !withheld) tell(record, p, "was sent; in the record nothing is");
    return;
  } else if (!sent) {
    return tell(record, p, "was not sent; in the record it is");
  } else {
    MessageHeader& header = *made->header;
    header.stamp_ns = stamp_ns;
    header.published_ns = record.published_ns;
    header.visible_at_ns = record.visible_at_ns;
    if (record.visible_at_ns == 0)  // format 1
      header.visible_at_ns =
          task.publish == PublishAt::let ? std::max(record.published_ns, record.deadline_ns) : record.published_ns;
    header.sequence = told->sequence;
    header.level = record.level;
    result_.messages += counts(record.task);
    if (counts(record.task)) compare(record, p, *made, told->sequence);
    if (port.newest != nullptr && port.newest.use_count() == 1) port.spare.push_back(std::move(port.newest));
    port.newest = made;
  }
  if (port.uses.contains(told->sequence)) port.messages[told->sequence] = made;
}

void Replayer::compare(const RecordedJob& record, size_t p, const Stored& made, uint64_t sequence) {
  const auto told = log_.message(ports_[p].channel, sequence);
  if (!told) return;
  ++result_.compared;
  std::vector<std::byte>& packed = ports_[p].packed;
  packed.clear();
  pack(*plan_.ports[p].type, made.message(), packed);
  if (told->stamp_ns != made.header->stamp_ns)
    return tell(record, p,
                "stamp is " + std::to_string(made.header->stamp_ns) + " instead of " + std::to_string(told->stamp_ns));
  if (!told->whole) {
    if (hash_of(packed) != told->hash) tell(record, p, "differs (the record has only its hash)");
    return;
  }
  ++result_.whole;
  if (const auto difference = first_difference(plan_.ports[p].type->fields, told->data, packed))
    tell(record, p, difference->field + " (byte " + std::to_string(difference->byte) + ") is " + difference->values);
}

void Replayer::tell(const RecordedJob& record, size_t port, std::string what) {
  if (record.release_ns < options_.from_ns || !counts(record.task)) return;
  ++result_.different;
  const std::string& node = plan_.tasks[record.task].name;
  ++result_.different_of[node];
  if (result_.first) return;
  result_.first =
      Divergence{node, port == kNone ? "" : plan_.ports[port].port, record.index, record.release_ns, std::move(what)};
}

}  // namespace takt::record
