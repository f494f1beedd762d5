// SPDX-License-Identifier: Apache-2.0
#include "rt/record/replayer.hpp"

#include <algorithm>
#include <utility>

#include "rt/record/replayer_parts.hpp"
#include "rt/sched/port_access.hpp"

namespace takt::record {
namespace {

template <class Each>
void for_each_held(const RecordedJob& record, const Each& each) {
  for (const RecordedJob::Input& input : record.inputs)
    for (const RecordedJob::Run& run : input.held)
      for (uint64_t sequence = run.first; sequence < run.first + run.count; ++sequence) each(input.edge, sequence);
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

bool Replayer::is_state(size_t task, size_t output) const {
  return plan_.tasks[task].node->outputs()[output] == plan_.tasks[task].node->state();
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
    if (!run_job(*record)) break;
  }
  if (last > first) result_.recorded_ns = last - first;
  count_unmade();
  return result_;
}

/// Of the nodes that run: what a job lost in the record made, and cannot be made again. States are never compared.
void Replayer::count_unmade() {
  for (size_t t = 0; t < plan_.tasks.size(); ++t) {
    if (!runs(t) || !counts(t) || options_.end_ns != INT64_MAX) continue;
    for (size_t i = 0; i < plan_.tasks[t].ports.size(); ++i) {
      const Port& port = ports_[plan_.tasks[t].ports[i]];
      if (is_state(t, i)) continue;
      for (const auto& [sequence, known] : log_.messages(port.channel))
        result_.unmade += !known.whole && sequence > port.before && !port.remade.contains(sequence);
    }
  }
}

const MessageHeader* Replayer::newest(size_t port) const {
  return ports_[port].newest != nullptr ? ports_[port].newest->header : nullptr;
}

bool Replayer::run_job(const RecordedJob& record) {
  const TaskPlan& task = plan_.tasks[record.task];
  bool go_on = true;
  clock_.advance_to(record.start_ns);
  for (const RecordedJob::Param& changed : record.params)
    if (auto done = task.node->change(changed.param, changed.value); !done)
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
    go_on = !options_.visit || options_.visit(*this, record);
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
  return go_on;
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
          if (result_.first_lacking.empty() && counts(record.task))
            result_.first_lacking = task.name + " job " + std::to_string(record.index) + ": " +
                                    plan_.ports[edge.port].node + "." + plan_.ports[edge.port].port + " " +
                                    std::to_string(sequence);
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
  if (!told->whole || told->coded) {
    if (hash_of(packed) != told->hash)
      tell(record, p,
           "differs (the record has only its hash" + std::string(told->coded ? " and pictures as JPEG)" : ")"));
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
