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

using record::RecordedJob;
using record::Recorder;

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
    std::vector<const RecordedJob*> open;
    for (const RecordedJob& job : log.jobs())
      if (job.release_ns >= from_ns && job.release_ns < to_ns) open.push_back(&job);
    while (!open.empty()) {
      const RecordedJob& job = *open.back();
      open.pop_back();
      if (jobs_.insert({job.task, job.index}).second) keep(job, open);
    }
  }

  bool keeps(const RecordedJob& job) const { return jobs_.contains({job.task, job.index}); }
  bool keeps(uint16_t channel, uint64_t sequence) const { return messages_.contains({channel, sequence}); }

 private:
  using Place = std::pair<uint16_t, uint64_t>;  ///< channel and sequence
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
    for_each_held(job, [&](const Place& message) {
      messages_.insert(message);
      const auto known = log_.messages(message.first).find(message.second);
      const bool whole = known != log_.messages(message.first).end() && known->second.whole;
      const auto maker = makers_.find(message);
      if (!whole && maker != makers_.end()) open.push_back(maker->second);
    });
  }

  const record::LogFile& log_;
  std::vector<Channels> channels_;  ///< by task
  std::map<Place, const RecordedJob*> makers_;
  std::set<Place> messages_;
  std::set<std::pair<uint16_t, uint32_t>> jobs_;  ///< task and index
};

/// Parameters that jobs left out had set, for the next job of the node that stays.
class Carried {
 public:
  void add(const RecordedJob& left_out) {
    for (const RecordedJob::Param& param : left_out.params) set_[left_out.task][param.param] = param.value;
  }
  void give(RecordedJob& next) {
    std::vector<RecordedJob::Param> params;
    for (const auto& [param, value] : set_[next.task]) params.push_back({param, value});
    next.params.insert(next.params.begin(), params.begin(), params.end());
    set_[next.task].clear();
  }

 private:
  std::map<uint16_t, std::map<uint16_t, ParamValue>> set_;  ///< by task and parameter
};

/// Schemas and channels under the ids that they have: the Recorder counts them from 1, as the Writer does.
bool copy_definitions(const mcap::Reader& from, mcap::Writer& to) {
  bool same = true;
  for (const mcap::Schema& schema : from.schemas())
    same &= to.add_schema(schema.name, schema.encoding, schema.data) == schema.id;
  for (const mcap::Channel& channel : from.channels())
    same &= to.add_channel(channel.schema, channel.topic, channel.encoding, channel.metadata) == channel.id;
  return same;
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
  if (!copy_definitions(log.container(), file))
    return tl::make_unexpected(std::string("its channels are not numbered as takt does"));

  Cut cut;
  Carried carried;
  const uint16_t jobs_channel = log.channel(Recorder::kJobs);
  std::vector<std::byte> packed;
  const auto walked = log.container().for_each([&](const mcap::Message& message) {
    if (message.channel == jobs_channel) {
      auto job = record::unpack_job(message.data);
      if (!job) return true;
      if (!selection.keeps(*job)) return carried.add(*job), true;
      carried.give(*job);
      packed.clear();
      record::pack(*job, packed);
      mcap::Message kept = message;
      kept.data = packed;
      note(file.write(kept));
      ++cut.jobs;
    } else if (const auto held = record::unpack_message(message.data);
               held && selection.keeps(message.channel, held->sequence)) {
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
