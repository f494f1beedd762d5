// SPDX-License-Identifier: Apache-2.0
#include "graph/rewind/shown_replay.hpp"

#include <algorithm>
#include <utility>

#include "rt/record/packed_message.hpp"
#include "rt/shm/local_transport.hpp"

namespace takt::rewind {

using record::RecordedEvent;
using record::RecordedJob;

ShownReplay::ShownReplay(RecordedRun& run, const Registry& registry, record::Replayer::Options how)
    : run_(run),
      how_(std::move(how)),
      board_(run.plan()),
      transport_(make_local_transport(run.plan().ports)),
      ports_(run.plan().ports.size()),
      server_(subject(registry)) {
  const std::vector<TaskPlan>& tasks = run_.plan().tasks;
  const auto runs = [&](size_t t) { return !tasks[t].device && (how_.run.empty() || how_.run[t] != 0); };
  for (size_t t = 0; t < tasks.size(); ++t) {
    logs_.emplace_back(board_.log(t));
    for (const size_t p : tasks[t].ports) {
      const PortPlan& plan = run_.plan().ports[p];
      ports_[p].writer = transport_->make_writer(p);
      ports_[p].recorded = !runs(t);
      ports_[p].channel = run_.log().channel(plan.node + "." + plan.port);
    }
  }
  for (const RecordedJob& job : run_.log().jobs())
    if (job.task < tasks.size() && !runs(job.task) && !job.cut_off) others_.push_back(&job);
  std::stable_sort(others_.begin(), others_.end(),
                   [](const RecordedJob* a, const RecordedJob* b) { return a->published_ns < b->published_ns; });
  how_.pace = [this, wait = std::move(how_.pace)](int64_t release_ns) {
    wait(release_ns);
    if (release_ns < how_.from_ns) return;  // only for what it leaves behind
    if (!moved_ns_) begin(release_ns);
    come_to(release_ns);
  };
  how_.visit = [this](const record::Replayer& replayer, const RecordedJob& job) { return show(replayer, job); };
}

attach::Subject ShownReplay::subject(const Registry& registry) {
  attach::Subject subject{registry, run_.graph(), run_.plan(), board_, *transport_};
  subject.replay_of = run_.name();
  return subject;
}

/// Of what lies before it, the newest message of each port is there.
void ShownReplay::begin(int64_t release_ns) {
  moved_ns_ = MonotonicClock().now_ns() - release_ns;
  board_.epoch_ns().store(now_of(run_.epoch_ns()));
  for (Port& port : ports_) {
    uint64_t before = 0;
    for (const auto& [sequence, known] : run_.log().messages(port.channel))
      if (known.stamp_ns < release_ns) before = std::exchange(port.told, sequence);
    port.told = before;
  }
  const auto later = [&](const RecordedJob* job) { return job->published_ns >= release_ns; };
  next_other_ = static_cast<size_t>(std::find_if(others_.begin(), others_.end(), later) - others_.begin());
}

/// What was there by then that no job of the replay makes.
void ShownReplay::come_to(int64_t recorded_ns) {
  for (size_t p = 0; p < ports_.size(); ++p)
    if (ports_[p].recorded) take_messages(p, recorded_ns);
  for (; next_other_ < others_.size() && others_[next_other_]->published_ns <= recorded_ns; ++next_other_)
    note(*others_[next_other_]);
  const std::vector<RecordedEvent>& events = run_.log().events();
  for (; next_event_ < events.size() && events[next_event_].at_ns <= recorded_ns; ++next_event_)
    take_event(events[next_event_]);
}

void ShownReplay::take_messages(size_t p, int64_t until_ns) {
  Port& port = ports_[p];
  const auto& messages = run_.log().messages(port.channel);
  for (auto next = messages.upper_bound(port.told);
       next != messages.end() && std::max(port.due_ns, next->second.stamp_ns) <= until_ns;
       next = messages.upper_bound(port.told)) {
    const auto message = next->second.whole ? run_.log().message(port.channel, next->first) : std::nullopt;
    if (message && message->visible_at_ns > until_ns) {
      port.due_ns = message->visible_at_ns;
      return;
    }
    port.told = next->first;
    port.due_ns = INT64_MIN;
    if (!message) continue;  // by hash only
    MessageHeader header;
    header.stamp_ns = message->stamp_ns;
    header.published_ns = message->published_ns;
    header.visible_at_ns = message->visible_at_ns;
    header.level = message->level;
    publish(p, header, message->data);
  }
}

void ShownReplay::take_event(const RecordedEvent& event) {
  if (const auto* mark = std::get_if<record::MarkSet>(&event.what))
    board_.marks().append({now_of(event.at_ns), 0, BoundedText<200>(mark->words)});
  const auto* said = std::get_if<record::LogSaid>(&event.what);
  if (said == nullptr || event.task >= logs_.size()) return;
  LogLine line{now_of(event.at_ns), event.job, said->dropped, static_cast<LogLevel>(said->level % kLogLevels),
               BoundedText<200>(said->text)};
  logs_[event.task].append(line);
}

bool ShownReplay::show(const record::Replayer& replayer, const RecordedJob& job) {
  if (!moved_ns_) return true;
  note(job);
  const std::vector<size_t>& ports = run_.plan().tasks[job.task].ports;
  for (const RecordedJob::Output& output : job.outputs) {
    const MessageHeader* made = output.output < ports.size() ? replayer.newest(ports[output.output]) : nullptr;
    if (made == nullptr || made->sequence != output.sequence) continue;  // it made another one, or none
    Port& port = ports_[ports[output.output]];
    port.bytes.clear();
    record::pack(*run_.plan().ports[ports[output.output]].type, made + 1, port.bytes);
    publish(ports[output.output], *made, port.bytes);
  }
  return board_.stop().end_ns() > MonotonicClock().now_ns();
}

void ShownReplay::note(const RecordedJob& job) {
  TaskStatistics& s = board_.task(job.task);
  add(s.completed);
  add(s.deadline_misses, job.late ? 1 : 0);
  s.last_level.store(job.level);
  s.last_exec_ns.store(job.cpu_ns);
  const int64_t response_ns = std::max(job.published_ns, job.finish_ns) - job.release_ns;
  s.last_response_ns.store(response_ns);
  keep_largest(s.largest_response_ns, response_ns);
  const uint64_t count = s.job_count.load();
  s.jobs[count % s.jobs.size()] = {now_of(job.release_ns), now_of(job.start_ns), now_of(job.finish_ns), -1};
  s.job_count.store(count + 1, std::memory_order_release);
  if (std::exchange(mode_, job.mode) != job.mode && job.mode < run_.plan().modes.size())
    board_.modes().request(job.mode, now_of(job.release_ns), "as in the record", true);
}

void ShownReplay::publish(size_t p, const MessageHeader& header, std::span<const std::byte> packed) {
  MessageHeader* chunk = ports_[p].writer->loan();
  if (chunk == nullptr) return;  // all are looked at: the next one will be seen
  if (!record::unpack(*run_.plan().ports[p].type, packed, chunk + 1)) return ports_[p].writer->discard();
  chunk->level = header.level;
  ports_[p].writer->publish(now_of(header.stamp_ns), now_of(header.published_ns), now_of(header.visible_at_ns));
  PortStatistics& s = board_.port(p);
  const int64_t age_ns = header.visible_at_ns - header.stamp_ns;
  s.last_age_ns.store(age_ns);
  keep_largest(s.largest_age_ns, age_ns);
}

}  // namespace takt::rewind
