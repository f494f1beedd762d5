// SPDX-License-Identifier: Apache-2.0
#include "rt/record/recorder.hpp"

#include <pthread.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include "rt/capability.hpp"
#include "rt/record/message_record.hpp"
#include "rt/sched/grant.hpp"

namespace takt::record {
namespace {

/// Far less than the time whose messages the ports keep for a recorder (250 ms in `takt run`).
constexpr timespec kPause{0, 5'000'000};
/// So much of a run is lost at most with a process that is killed; with the power less than a second, what is still on
/// its way to the disk included (bench/scenarios/ring_cut.py).
constexpr int64_t kChunkNs = 700'000'000;
/// A message older than this is not expected to be followed by the next one soon.
constexpr int64_t kStandsNs = 2'000'000'000;

}  // namespace

Recorder::Recorder(const Plan& plan, const RunBoard& board, Transport& transport, Splits& splits, Head head,
                   Options options)
    : Recorder(plan, board, transport, nullptr, &splits, std::move(head), std::move(options)) {}

Recorder::Recorder(const Plan& plan, const RunBoard& board, Transport& transport, mcap::Sink& sink, Head head,
                   Options options)
    : Recorder(plan, board, transport, std::make_unique<OneFile>(sink), nullptr, std::move(head), std::move(options)) {}

Recorder::Recorder(const Plan& plan, const RunBoard& board, Transport& transport, std::unique_ptr<Splits> own,
                   Splits* splits, Head head, Options options)
    : options_(std::move(options)),
      board_(board),
      own_splits_(std::move(own)),
      splits_(own_splits_ ? *own_splits_ : *splits),
      head_(std::move(head)),
      queue_(options_.queue_bytes),
      jobs_([this](const RecordedJob& job) { take_job(job); },
            [this](const RecordedEvent& event) { take_event(event); }),
      snapshots_(plan, options_.snapshot_every_ns) {
  define_channels(plan);
  head_.facts["format"] = std::to_string(coded_.empty() ? kFormatWithoutJpeg : kFormat);
  for (size_t p = 0; p < plan.ports.size(); ++p)
    if (ports_[p].rule.keep != PortRule::nothing) ports_[p].follower.emplace(transport.make_reader(p));
  logs_.resize(plan.tasks.size());
  for (const TaskPlan& task : plan.tasks) {
    ports_of_.push_back(task.ports);
    std::vector<size_t>& edges = edges_of_.emplace_back();
    for (const EdgePlan& edge : task.edges) edges.push_back(edge.port);
  }
  begin_file(0);
  writing_ = OwnThread([this] { write_on(); });
  if (options_.by_caller) return;
  try {
    capturing_ = OwnThread([this] { capture_on(); });
  } catch (...) {  // no more threads: the other one would wait for ever
    queue_.close();
    writing_.join();
    throw;
  }
}

Recorder::~Recorder() {
  if (writing_.joinable()) finish({});
}

uint16_t Recorder::define_schema(std::string name, std::string encoding, std::string data) {
  const auto id = static_cast<uint16_t>(schemas_.size() + 1);
  schemas_.push_back({id, std::move(name), std::move(encoding), std::move(data)});
  return id;
}

uint16_t Recorder::define(uint16_t schema, std::string topic, mcap::Metadata metadata) {
  const auto id = static_cast<uint16_t>(channels_.size() + 1);
  channels_.push_back({id, schema, std::move(topic), kEncoding, std::move(metadata)});
  return id;
}

/// The same in every file, whatever it holds, so that files can be joined.
void Recorder::define_channels(const Plan& plan) {
  jobs_channel_ = define(define_schema("takt.Job", "text", job_layout()), kJobs, {});
  events_channel_ = define(define_schema("takt.Event", "text", event_layout()), kEvents, {});
  std::map<std::pair<std::string_view, std::string>, uint16_t> schemas;  // two types may share a name
  for (size_t p = 0; p < plan.ports.size(); ++p) {
    const PortPlan& port = plan.ports[p];
    Port& mine = ports_.emplace_back();
    mine.type = port.type;
    if (!options_.ports.empty()) mine.rule = options_.ports[p];
    const auto [schema, added] = schemas.try_emplace({port.type->name, layout_of(*port.type)}, uint16_t{0});
    if (added) schema->second = define_schema("takt." + std::string(port.type->name), "json", schema->first.second);
    const std::string all = mine.rule.jpeg > 0 ? "jpeg " + std::to_string(mine.rule.jpeg) : "all";
    mine.channel = define(schema->second, port.node + "." + port.port,
                          {{"fields", mine.rule.keep == PortRule::all ? all : "hash"}});
    if (mine.rule.jpeg > 0) coded_.emplace(mine.channel, Coded{port.type, PictureCoder(mine.rule.jpeg)});
  }
}

void Recorder::begin_file(int64_t at_ns) {
  file_began_ns_ = at_ns;
  mcap::Sink* sink = splits_.next(at_ns);
  if (sink == nullptr) return;
  file_.emplace(*sink, options_.file);
  bool begun = note(file_->begin("", "takt")) && note(file_->metadata(kFacts, head_.facts));
  for (const mcap::Attachment& attached : head_.files) begun = note(file_->attach(attached)) && begun;
  for (const mcap::Schema& schema : schemas_) file_->add_schema(schema.name, schema.encoding, schema.data);
  for (const mcap::Channel& channel : channels_)
    file_->add_channel(channel.schema, channel.topic, channel.encoding, channel.metadata);
  if (!begun && !own_splits_) file_.reset();  // what follows could not be read; the next one is tried
}

void Recorder::end_file() {
  if (!file_) return;
  note(file_->flush());
  note(file_->metadata(kEnd, last_facts_));
  note(file_->finish());
  for (const auto& [channel, count] : file_->statistics().channel_messages) written_[channel] += count;
  result_.not_written += file_->lost();
  result_.bytes += file_->written_bytes();
  ++result_.files;
  file_.reset();
}

void Recorder::capture_on() {
  if (options_.priority > 0) lift_thread(0, options_.priority);
  pthread_setname_np(pthread_self(), "takt-record");
  keep_rights(Rights::none);
  const MonotonicClock clock;
  int64_t looked_ns = clock.now_ns();
  const auto look = [&] {
    const int64_t now_ns = clock.now_ns();
    result_.longest_pause_ns = std::max(result_.longest_pause_ns, now_ns - std::exchange(looked_ns, now_ns));
    take_ports();
  };
  while (!ending_.load()) {
    look();
    nanosleep(&kPause, nullptr);
  }
  look();
  result_.capture_cpu_ns = thread_cpu_ns();
}

void Recorder::take_ports() {
  repeat_old();
  for (Port& port : ports_) take_port(port);
  take_modes();
  take_marks();
  take_logs();
}

/// What stands for long is in each file, so that jobs that hold it can be run from that file alone.
void Recorder::repeat_old() {
  const int64_t begun_ns = file_begun_ns_.exchange(0);
  if (begun_ns == 0) return;
  for (Port& port : ports_)
    if (port.follower && port.rule.keep == PortRule::all && begun_ns - port.seen_ns > kStandsNs)
      port.follower->again([&](const Held& held) {
        std::vector<std::byte> data = queue_.buffer(port.bytes);
        pack(*port.type, held, true, data);
        push(port.channel, held.sequence, begun_ns, std::move(data));
      });
}

void Recorder::take_marks() {
  const MarkLog& marks = board_.marks();
  for (; marks_taken_ < marks.size(); ++marks_taken_) {
    const Mark* mark = marks.at(marks_taken_);
    if (mark == nullptr) return;  // it is being written
    take_event({static_cast<uint16_t>(EventKind::mark), RecordedEvent::kNoTask, 0, mark->at_ns,
                MarkSet{std::string(mark->words.text()), "uid " + std::to_string(mark->by_user)}});
  }
}

void Recorder::take_logs() {
  for (size_t t = 0; t < logs_.size(); ++t)
    logs_[t].take(board_.log(t), [&](const LogLine& line) {
      take_event({static_cast<uint16_t>(EventKind::log), static_cast<uint16_t>(t), static_cast<uint32_t>(line.job),
                  line.at_ns, LogSaid{static_cast<uint8_t>(line.level), line.dropped, std::string(line.text.text())}});
    });
}

void Recorder::take_modes() {
  const Modes& modes = board_.modes();
  for (; modes_taken_ < modes.size(); ++modes_taken_) {
    const ModeLog::Change* change = modes.change(modes_taken_);
    if (change == nullptr) return;  // it is being written
    if (modes.repeats(modes_taken_)) continue;
    take_event({static_cast<uint16_t>(EventKind::mode), RecordedEvent::kNoTask, 0, change->from_ns,
                ModeChange{change->mode, modes.reason(modes_taken_)}});
  }
}

void Recorder::take_port(Port& port) {
  if (!port.follower) return;
  result_.overwritten += port.follower->take([&](const Held& held) {
    if (options_.listener.message) options_.listener.message(static_cast<size_t>(&port - ports_.data()), held);
    const int64_t at_ns = port.seen_ns = held.header->published_ns;
    const bool whole =
        port.rule.keep == PortRule::all && held.sequence % port.rule.every == 0 &&
        (port.rule.pause_ns == 0 || port.whole_ns == INT64_MIN || at_ns - port.whole_ns >= port.rule.pause_ns);
    if (whole) port.whole_ns = at_ns;
    std::vector<std::byte> data = queue_.buffer(whole ? port.bytes : 0);
    pack(*port.type, held, whole, data);
    if (whole) port.bytes = data.size();
    push(port.channel, held.sequence, held.header->published_ns, std::move(data));
  });
}

void Recorder::take_job(const RecordedJob& job) {
  // What a job that was cut off offered need not have come out; whoever held it, tells.
  for (const RecordedJob::Output& output : job.outputs)
    if (!job.cut_off) tell(ports_of_[job.task][output.output], output.sequence);
  for (const RecordedJob::Input& input : job.inputs)
    if (!input.held.empty())
      tell(edges_of_[job.task][input.edge], input.held.back().first + input.held.back().count - 1);
  if (options_.listener.job) options_.listener.job(job);
  if (!options_.jobs) return;
  std::vector<std::byte> data = queue_.buffer(job_bytes_);
  pack(job, data);
  job_bytes_ = data.size();
  push(jobs_channel_, job.index, job.published_ns, std::move(data));
  if (const auto snapshot = snapshots_.after(job)) take_event(*snapshot);
}

void Recorder::tell(size_t port, uint64_t sequence) {
  uint64_t& newest = ports_[port].told;
  newest = std::max(newest, sequence);
}

void Recorder::take_event(const RecordedEvent& event) {
  if (options_.listener.event) options_.listener.event(event);
  if (!options_.jobs) return;
  snapshots_.note(event);
  std::vector<std::byte> data;
  pack(event, data);
  push(events_channel_, event.job, event.at_ns, std::move(data));
}

void Recorder::push(uint16_t channel, uint64_t sequence, int64_t at_ns, std::vector<std::byte> data) {
  if (!queue_.push({.channel = channel, .sequence = sequence, .at_ns = at_ns, .data = std::move(data)},
                   options_.by_caller))
    no_room_.fetch_add(1);
}

void Recorder::write_on() {
  pthread_setname_np(pthread_self(), "takt-write");
  keep_rights(Rights::none);
  int64_t chunk_began_ns = 0;
  while (auto entry = queue_.pop()) {
    write(*entry);
    // In the run's own time, so that a virtual run always gives the same chunks.
    if (entry->at_ns - chunk_began_ns >= kChunkNs) {
      if (file_) note(file_->flush());
      note(splits_.settle(entry->at_ns));
      chunk_began_ns = entry->at_ns;
      if (!file_ || splits_.ends(file_->written_bytes(), file_began_ns_, entry->at_ns)) {
        last_facts_ = {{"epoch_ns", std::to_string(board_.epoch_ns())}, {"goes_on", "in the next file"}};
        end_file();
        begin_file(entry->at_ns);
        file_begun_ns_.store(entry->at_ns);
      }
    }
    queue_.recycle(std::move(entry->data));
  }
  if (file_) note(file_->flush());
  result_.write_cpu_ns = thread_cpu_ns();
}

void Recorder::write(const WriteQueue::Entry& entry) {
  if (file_began_ns_ == 0) file_began_ns_ = entry.at_ns;
  if (options_.written_at != nullptr) options_.written_at->advance_to(entry.at_ns);
  const auto at_ns = static_cast<uint64_t>(entry.at_ns);
  if (file_) note(file_->write({entry.channel, static_cast<uint32_t>(entry.sequence), at_ns, at_ns, as_kept(entry)}));
  else ++result_.not_written;
}

std::span<const std::byte> Recorder::as_kept(const WriteQueue::Entry& entry) {
  const auto coded = coded_.find(entry.channel);
  if (coded == coded_.end()) return entry.bytes();
  kept_.clear();
  code(*coded->second.type, entry.bytes(), coded->second.coder, kept_);
  return kept_;
}

bool Recorder::note(const mcap::Writer::Done& done) {
  if (!done && result_.refused.empty()) result_.refused = done.error();
  return done.has_value();
}

void Recorder::take_rest() {
  ending_.store(true);
  if (capturing_.joinable()) capturing_.join();
  else take_ports();
}

RecordResult Recorder::finish(mcap::Metadata facts, uint64_t unheard_threads) {
  take_rest();
  jobs_.end();
  // What its writer took along, or never settled before it died.
  for (const Port& port : ports_) {
    if (!port.follower) continue;
    const uint64_t seen = port.follower->seen();
    result_.overwritten += std::max(port.told, seen) - seen;
  }
  queue_.close();
  writing_.join();
  result_.no_room = no_room_.load();
  result_.incomplete_jobs = jobs_.incomplete();
  result_.unheard_threads = unheard_threads;
  facts["lost_overwritten"] = std::to_string(result_.overwritten);
  facts["lost_no_room"] = std::to_string(result_.no_room);
  facts["lost_not_written"] = std::to_string(result_.not_written + (file_ ? file_->lost() : 0));
  facts["lost_jobs"] = std::to_string(result_.incomplete_jobs);
  facts["lost_threads"] = std::to_string(result_.unheard_threads);
  last_facts_ = std::move(facts);
  end_file();
  result_.jobs = written_[jobs_channel_];
  result_.events = written_[events_channel_];
  for (const auto& [channel, count] : written_) result_.messages += count;
  result_.messages -= result_.jobs + result_.events;
  return result_;
}

}  // namespace takt::record
