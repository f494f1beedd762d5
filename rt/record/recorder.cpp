// SPDX-License-Identifier: Apache-2.0
#include "rt/record/recorder.hpp"

#include <pthread.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include "rt/capability.hpp"
#include "rt/record/message_record.hpp"
#include "rt/sched/grant.hpp"
#include "rt/time/clock.hpp"

namespace takt::record {
namespace {

/// Far less than the time whose messages the ports keep for a recorder (250 ms in `takt run`).
constexpr timespec kPause{0, 5'000'000};
/// So much of a run is lost at most with a process that is killed.
constexpr int64_t kChunkNs = 1'000'000'000;

}  // namespace

Recorder::Recorder(const Plan& plan, const RunBoard& board, Transport& transport, mcap::Sink& sink, const Head& head,
                   Options options)
    : options_(std::move(options)),
      board_(board),
      file_(sink, options_.file),
      queue_(options_.queue_bytes),
      jobs_([this](const RecordedJob& job) { take_job(job); },
            [this](const RecordedEvent& event) { take_event(event); }) {
  note(file_.begin("", "takt"));
  mcap::Metadata facts = head.facts;
  facts["format"] = std::to_string(kFormat);
  note(file_.metadata(kFacts, facts));
  for (const mcap::Attachment& attached : head.files) note(file_.attach(attached));
  add_channels(plan);
  for (size_t p = 0; p < plan.ports.size(); ++p) ports_[p].follower.emplace(transport.make_reader(p));
  for (const TaskPlan& task : plan.tasks) {
    ports_of_.push_back(task.ports);
    std::vector<size_t>& edges = edges_of_.emplace_back();
    for (const EdgePlan& edge : task.edges) edges.push_back(edge.port);
  }
  writing_ = OwnThread([this] { write_on(); });
  if (!options_.by_caller) capturing_ = OwnThread([this] { capture_on(); });
}

Recorder::~Recorder() {
  if (writing_.joinable()) finish({});
}

void Recorder::add_channels(const Plan& plan) {
  jobs_channel_ = file_.add_channel(file_.add_schema("takt.Job", "text", job_layout()), kJobs, kEncoding, {});
  events_channel_ = file_.add_channel(file_.add_schema("takt.Event", "text", event_layout()), kEvents, kEncoding, {});
  std::map<std::pair<std::string_view, std::string>, uint16_t> schemas;  // two types may share a name
  for (size_t p = 0; p < plan.ports.size(); ++p) {
    const PortPlan& port = plan.ports[p];
    Port& mine = ports_.emplace_back();
    mine.type = port.type;
    mine.whole = options_.whole.empty() || options_.whole[p] != 0;
    const auto [schema, added] = schemas.try_emplace({port.type->name, layout_of(*port.type)}, uint16_t{0});
    if (added) schema->second = file_.add_schema("takt." + std::string(port.type->name), "json", schema->first.second);
    mine.channel = file_.add_channel(schema->second, port.node + "." + port.port, kEncoding,
                                     {{"fields", mine.whole ? "all" : "hash"}});
  }
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
  for (Port& port : ports_) take_port(port);
  take_modes();
}

void Recorder::take_modes() {
  const Modes& modes = board_.modes();
  for (; modes_taken_ < modes.size(); ++modes_taken_) {
    const ModeLog::Change* change = modes.change(modes_taken_);
    if (change == nullptr) return;  // it is being written
    if (modes.repeats(modes_taken_)) continue;
    take_event({static_cast<uint16_t>(EventKind::mode), RecordedEvent::kNoTask, 0, change->from_ns,
                ModeChange{change->mode, std::string(change->reason.text())}});
  }
}

void Recorder::take_port(Port& port) {
  result_.overwritten += port.follower->take([&](const Held& held) {
    std::vector<std::byte> data = queue_.buffer(port.bytes);
    pack(*port.type, held, port.whole, data);
    port.bytes = data.size();
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
  std::vector<std::byte> data = queue_.buffer(job_bytes_);
  pack(job, data);
  job_bytes_ = data.size();
  push(jobs_channel_, job.index, job.published_ns, std::move(data));
}

void Recorder::tell(size_t port, uint64_t sequence) {
  uint64_t& newest = ports_[port].told;
  newest = std::max(newest, sequence);
}

void Recorder::take_event(const RecordedEvent& event) {
  std::vector<std::byte> data;
  pack(event, data);
  push(events_channel_, event.job, event.at_ns, std::move(data));
}

void Recorder::push(uint16_t channel, uint64_t sequence, int64_t at_ns, std::vector<std::byte> data) {
  if (!queue_.push({channel, sequence, at_ns, std::move(data)}, options_.by_caller)) no_room_.fetch_add(1);
}

void Recorder::write_on() {
  pthread_setname_np(pthread_self(), "takt-write");
  keep_rights(Rights::none);
  int64_t chunk_began_ns = 0;
  while (auto entry = queue_.pop()) {
    const auto at_ns = static_cast<uint64_t>(entry->at_ns);
    note(file_.write({entry->channel, static_cast<uint32_t>(entry->sequence), at_ns, at_ns, entry->data}));
    // In the run's own time, so that a virtual run always gives the same chunks.
    if (entry->at_ns - chunk_began_ns >= kChunkNs) {
      note(file_.flush());
      chunk_began_ns = entry->at_ns;
    }
    queue_.recycle(std::move(entry->data));
  }
  note(file_.flush());
  result_.write_cpu_ns = thread_cpu_ns();
}

void Recorder::note(const mcap::Writer::Done& done) {
  if (!done && result_.refused.empty()) result_.refused = done.error();
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
    const uint64_t seen = port.follower->seen();
    result_.overwritten += std::max(port.told, seen) - seen;
  }
  queue_.close();
  writing_.join();
  result_.no_room = no_room_.load();
  result_.incomplete_jobs = jobs_.incomplete();
  result_.unheard_threads = unheard_threads;
  result_.not_written = file_.lost();
  const auto& written = file_.statistics();
  const auto count = [&](uint16_t channel) {
    const auto found = written.channel_messages.find(channel);
    return found == written.channel_messages.end() ? 0 : found->second;
  };
  result_.jobs = count(jobs_channel_);
  result_.events = count(events_channel_);
  result_.messages = written.messages - result_.jobs - result_.events;
  facts["lost_overwritten"] = std::to_string(result_.overwritten);
  facts["lost_no_room"] = std::to_string(result_.no_room);
  facts["lost_not_written"] = std::to_string(result_.not_written);
  facts["lost_jobs"] = std::to_string(result_.incomplete_jobs);
  facts["lost_threads"] = std::to_string(result_.unheard_threads);
  note(file_.metadata(kEnd, facts));
  note(file_.finish());
  result_.bytes = file_.written_bytes();
  return result_;
}

}  // namespace takt::record
