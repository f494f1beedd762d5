// SPDX-License-Identifier: Apache-2.0
#include "graph/log/cut_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>
#include <vector>

#include "graph/log/log_content.hpp"
#include "graph/log/recorded_plan.hpp"
#include "rt/record/mcap/writer.hpp"
#include "rt/record/recorder.hpp"

namespace takt::log {
namespace {

using record::ModeChange;
using record::RecordedEvent;
using record::RecordedJob;
using record::Recorder;
using record::Restart;

/// Which jobs and messages stay.
class Selection {
 public:
  /// Throws nlohmann's exception if the record does not hold its plan.
  Selection(const record::LogFile& log, int64_t from_ns, int64_t to_ns) : log_(log) {
    const Json plan = Json::parse(log.attached("plan.json").value_or(""));
    for (const Json& task : plan.at("tasks")) {
      Channels& channels = channels_.emplace_back();
      for (const Json& edge : task.at("edges"))
        channels.edges.push_back(log.channel(edge.at("from").get<std::string>()));
      for (const Json& output : task.at("outputs"))
        channels.outputs.push_back(log.channel(task.at("name").get<std::string>() + "." + output.get<std::string>()));
    }
    for (const RecordedJob& job : log.jobs())
      for_each_published(job, [&](const Place& message) { makers_[message] = &job; });
    for (const RecordedEvent& event : log.events()) {
      if (std::holds_alternative<Restart>(event.what)) restarts_[event.task].push_back(&event);
      if (event.at_ns >= from_ns && event.at_ns < to_ns && !std::holds_alternative<Restart>(event.what))
        events_.insert(&event);
    }
    keep_mode_before(from_ns);
    std::vector<const RecordedJob*> open;
    for (const RecordedJob& job : log.jobs())
      if (job.release_ns >= from_ns && job.release_ns < to_ns) open.push_back(&job);
    while (!open.empty()) {
      const RecordedJob& job = *open.back();
      open.pop_back();
      if (!jobs_.insert({job.task, job.index}).second) continue;
      keep(job, open);
      if (const RecordedEvent* restart = last_restart(job)) keep(*restart, open);
      if (const RecordedEvent* restart = job.cut_off ? restart_after(job) : nullptr) keep(*restart, open);
    }
  }

  bool keeps(const RecordedEvent& event) const {
    return std::any_of(events_.begin(), events_.end(), [&](const RecordedEvent* kept) { return *kept == event; });
  }
  /// What its node went on from.
  const RecordedEvent* last_restart(const RecordedJob& job) const {
    const RecordedEvent* last = nullptr;
    if (const auto mine = restarts_.find(job.task); mine != restarts_.end())
      for (const RecordedEvent* event : mine->second)
        if (event->at_ns <= job.start_ns && (last == nullptr || event->at_ns > last->at_ns)) last = event;
    return last;
  }

  bool keeps(const RecordedJob& job) const { return jobs_.contains({job.task, job.index}); }
  bool keeps(uint16_t channel, uint64_t sequence) const { return messages_.contains({channel, sequence}); }

 private:
  using Place = std::pair<uint16_t, uint64_t>;  ///< channel and sequence
  /// Which says what came out of it.
  const RecordedEvent* restart_after(const RecordedJob& job) const {
    const RecordedEvent* next = nullptr;
    if (const auto mine = restarts_.find(job.task); mine != restarts_.end())
      for (const RecordedEvent* event : mine->second)
        if (event->at_ns > job.start_ns && (next == nullptr || event->at_ns < next->at_ns)) next = event;
    return next;
  }
  /// The state at the begin of the cut.
  void keep_mode_before(int64_t from_ns) {
    const RecordedEvent* last = nullptr;
    for (const RecordedEvent& event : log_.events())
      if (std::holds_alternative<ModeChange>(event.what) && event.at_ns < from_ns &&
          (last == nullptr || event.at_ns >= last->at_ns))
        last = &event;
    if (last != nullptr) events_.insert(last);
  }
  struct Channels {
    std::vector<uint16_t> edges, outputs;
  };

  template <class Each>
  void for_each_published(const RecordedJob& job, const Each& each) const {
    for (const RecordedJob::Output& output : job.outputs)
      if (job.task < channels_.size() && output.output < channels_[job.task].outputs.size())
        each(Place{channels_[job.task].outputs[output.output], output.sequence});
  }
  template <class Each>
  void for_each_held(const RecordedJob& job, const Each& each) const {
    for (const RecordedJob::Input& input : job.inputs)
      for (const RecordedJob::Run& run : input.held)
        for (uint64_t i = 0; i < std::min<uint64_t>(run.count, InputPort::kMaxDepth); ++i)
          if (job.task < channels_.size() && input.edge < channels_[job.task].edges.size())
            each(Place{channels_[job.task].edges[input.edge], run.first + i});
  }

  /// What the job held and published stays; `open` gets the jobs that must make what is there by hash only.
  void keep(const RecordedJob& job, std::vector<const RecordedJob*>& open) {
    for_each_published(job, [&](const Place& message) { messages_.insert(message); });
    for_each_held(job, [&](const Place& message) { need(message, open); });
  }

  /// What the restarted node was handed over stays.
  void keep(const RecordedEvent& restart, std::vector<const RecordedJob*>& open) {
    if (!events_.insert(&restart).second || restart.task >= channels_.size()) return;
    const std::vector<uint16_t>& outputs = channels_[restart.task].outputs;
    for (const Restart::Output& output : std::get<Restart>(restart.what).outputs)
      if (output.output < outputs.size() && output.handed_over > 0)
        need(Place{outputs[output.output], output.handed_over}, open);
  }

  void need(const Place& message, std::vector<const RecordedJob*>& open) {
    messages_.insert(message);
    const auto known = log_.messages(message.first).find(message.second);
    const bool whole = known != log_.messages(message.first).end() && known->second.whole;
    const auto maker = makers_.find(message);
    if (!whole && maker != makers_.end()) open.push_back(maker->second);
  }

  const record::LogFile& log_;
  std::vector<Channels> channels_;  ///< by task
  std::map<Place, const RecordedJob*> makers_;
  std::map<uint16_t, std::vector<const RecordedEvent*>> restarts_;  ///< by task
  std::set<const RecordedEvent*> events_;
  std::set<Place> messages_;
  std::set<std::pair<uint16_t, uint32_t>> jobs_;  ///< task and index
};

/// Parameters that jobs left out had set, for the next job of the node that stays. What a node took up at a restart
/// stands there, not here.
class Carried {
 public:
  Carried(const record::LogFile& log, const Selection& selection) {
    std::vector<const RecordedJob*> jobs;
    for (const RecordedJob& job : log.jobs()) jobs.push_back(&job);
    // In the file, one that was cut off may stand behind later ones.
    std::stable_sort(jobs.begin(), jobs.end(),
                     [](const RecordedJob* a, const RecordedJob* b) { return a->start_ns < b->start_ns; });
    std::map<uint16_t, std::map<uint16_t, std::pair<int64_t, ParamValue>>> set;  // by task and parameter, when
    for (const RecordedJob* job : jobs) {
      auto& mine = set[job->task];
      if (!selection.keeps(*job)) {
        for (const RecordedJob::Param& param : job->params) mine[param.param] = {job->start_ns, param.value};
        continue;
      }
      const RecordedEvent* restart = selection.last_restart(*job);
      for (const auto& [param, given] : mine)
        if (restart == nullptr || given.first >= restart->at_ns)
          given_[{job->task, job->index}].push_back({param, given.second});
      mine.clear();
    }
  }
  void give(RecordedJob& job) const {
    if (const auto found = given_.find({job.task, job.index}); found != given_.end())
      job.params.insert(job.params.begin(), found->second.begin(), found->second.end());
  }

 private:
  std::map<std::pair<uint16_t, uint32_t>, std::vector<RecordedJob::Param>> given_;  ///< by task and index
};

/// Schemas and channels under the ids that they have: the Reader counts them from 1, as the Writer does.
void copy_definitions(const mcap::Reader& from, mcap::Writer& to) {
  for (const mcap::Schema& schema : from.schemas()) to.add_schema(schema.name, schema.encoding, schema.data);
  for (const mcap::Channel& channel : from.channels())
    to.add_channel(channel.schema, channel.topic, channel.encoding, channel.metadata);
}

}  // namespace

int64_t epoch_ns(const record::LogFile& log) {
  if (const std::string told = fact(log.end(), "epoch_ns"); !told.empty())
    return std::strtoll(told.c_str(), nullptr, 10);
  int64_t first = INT64_MAX;
  for (const RecordedJob& job : log.jobs()) first = std::min(first, job.release_ns);
  return first == INT64_MAX ? 0 : first;
}

tl::expected<Cut, std::string> cut_log(const record::LogFile& log, int64_t from_ns, int64_t to_ns, mcap::Sink& sink) {
  const Selection selection(log, from_ns, to_ns);
  mcap::Writer file(sink, {});
  std::string refused;
  const auto note = [&](const mcap::Writer::Done& done) {
    if (!done && refused.empty()) refused = done.error();
  };
  note(file.begin("", "takt"));
  mcap::Metadata facts = log.facts();
  const auto seconds = [&](int64_t ns) { return static_cast<double>(ns - epoch_ns(log)) / 1e9; };
  facts["cut"] = fmt::format("{:.3f} s to {:.3f} s of the record with content {}", seconds(from_ns), seconds(to_ns),
                             content_hash(log));
  note(file.metadata(Recorder::kFacts, facts));
  for (const mcap::Attachment& attachment : log.container().attachments()) note(file.attach(attachment));
  for (const mcap::Reader::Named& other : log.container().metadata())
    if (other.name != Recorder::kFacts && other.name != Recorder::kEnd) note(file.metadata(other.name, other.map));
  copy_definitions(log.container(), file);

  Cut cut;
  const Carried carried(log, selection);
  const uint16_t jobs_channel = log.channel(Recorder::kJobs), events_channel = log.channel(Recorder::kEvents);
  std::vector<std::byte> packed;
  const auto walked = log.container().for_each([&](const mcap::Message& message) {
    if (message.channel == jobs_channel) {
      auto job = record::unpack_job(message.data, log.format());
      if (!job || !selection.keeps(*job)) return true;
      carried.give(*job);
      packed.clear();
      record::pack(*job, packed, log.format());
      mcap::Message kept = message;
      kept.data = packed;
      note(file.write(kept));
      ++cut.jobs;
    } else if (events_channel != 0 && message.channel == events_channel) {
      const auto event = record::unpack_event(message.data);
      if (event && selection.keeps(*event)) note(file.write(message)), ++cut.events;
    } else if (const auto held = record::unpack_message(message.data);
               message.channel != 0 && held && selection.keeps(message.channel, held->sequence)) {
      note(file.write(message));
      ++cut.messages;
    }
    return refused.empty();
  });
  if (!walked) return tl::make_unexpected(walked.error());
  note(file.flush());
  if (!log.end().empty()) note(file.metadata(Recorder::kEnd, log.end()));
  note(file.finish());
  if (!refused.empty()) return tl::make_unexpected(refused);
  cut.bytes = file.written_bytes();
  return cut;
}

}  // namespace takt::log
