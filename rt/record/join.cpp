// SPDX-License-Identifier: Apache-2.0
#include "rt/record/join.hpp"

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <map>
#include <set>
#include <utility>

#include "rt/record/log_file.hpp"
#include "rt/record/message_record.hpp"
#include "rt/record/recorder.hpp"

namespace takt::record {
namespace {

namespace fs = std::filesystem;
using Place = std::pair<uint16_t, uint64_t>;  ///< channel of the joined record, and sequence
constexpr uint64_t kMostHeld = 64;            ///< by an edge

class Join {
  struct Part {
    fs::path file;
    mcap::Reader reader;
    std::map<uint16_t, uint16_t> channel;  ///< of the joined record, by that of the file
  };

 public:
  Join(mcap::Sink& sink, const JoinOptions& options) : options_(options), writer_(sink, {}) {}

  void open(const std::vector<fs::path>& files) {
    open(options_.older, parts_);
    older_ = parts_.size();
    open(files, parts_);
    if (older_ == parts_.size()) parts_.clear();
  }

  void open(const std::vector<fs::path>& files, std::deque<Part>& parts) {
    for (const fs::path& file : files) {
      auto reader = mcap::Reader::open(file);
      if (!reader) {
        damages_.insert(reader.error());
        continue;
      }
      if (!reader->missing().empty()) damages_.insert(file.string() + ": " + reader->missing());
      if (reader->channels().empty()) continue;  // it ended before its first message
      parts.push_back({file, std::move(*reader), {}});
    }
  }

  tl::expected<Joined, std::string> run() {
    if (parts_.empty()) return tl::unexpected("none of the files holds a message" + first_damage());
    if (const std::string why = define(); !why.empty()) return tl::unexpected(why);
    begin();
    if (!options_.edges.empty())
      for (size_t i = older_; i < parts_.size(); ++i) find_held(parts_[i]);
    for (size_t i = older_; i < parts_.size(); ++i) find_whole_messages(parts_[i]);
    const bool all_there =
        std::all_of(held_.begin(), held_.end(), [this](const Place& place) { return whole_.contains(place); });
    for (; all_there && older_ > 0; --older_) parts_.pop_front();
    for (size_t i = 0; i < older_; ++i) find_whole_messages(parts_[i]);
    for (const Part& part : parts_) copy(part);
    note(writer_.flush());
    end();
    if (!refused_.empty()) return tl::unexpected(refused_);
    joined_.bytes = writer_.written_bytes();
    joined_.damages.assign(damages_.begin(), damages_.end());
    return std::move(joined_);
  }

 private:
  std::string first_damage() const { return damages_.empty() ? "" : ": " + *damages_.begin(); }
  void note(const mcap::Writer::Done& done) {
    if (!done && refused_.empty()) refused_ = done.error();
  }
  static std::string text(const mcap::Metadata& of, const char* key) {
    const auto found = of.find(key);
    return found == of.end() ? "" : found->second;
  }
  static const mcap::Metadata& named(const mcap::Reader& reader, std::string_view name) {
    static const mcap::Metadata none;
    for (const auto& one : reader.metadata())
      if (one.name == name) return one.map;
    return none;
  }

  /// Channels by their topics; a port "has all fields" if one of the files has them. Empty, or what does not fit.
  std::string define() {
    const mcap::Metadata& facts = named(parts_.back().reader, Recorder::kFacts);
    for (Part& part : parts_) {
      const mcap::Metadata& other = named(part.reader, Recorder::kFacts);
      if (!other.empty() && !facts.empty() && other != facts)
        return part.file.string() + " is of another run than " + parts_.back().file.string();
      for (const mcap::Channel& channel : part.reader.channels()) {
        const auto [place, added] = ids_.try_emplace(channel.topic, static_cast<uint16_t>(channels_.size() + 1));
        part.channel[channel.id] = place->second;
        if (added)
          channels_.push_back({channel, channel.schema > 0 ? &part.reader.schemas()[channel.schema - 1U] : nullptr});
        else if (const auto fields = channel.metadata.find("fields");
                 fields != channel.metadata.end() && fields->second != "hash")
          channels_[place->second - 1U].first.metadata["fields"] = fields->second;
      }
    }
    return "";
  }

  void begin() {
    note(writer_.begin("", "takt"));
    const mcap::Reader& last = parts_.back().reader;
    note(writer_.metadata(Recorder::kFacts, named(last, Recorder::kFacts)));
    for (const mcap::Attachment& attachment : last.attachments()) note(writer_.attach(attachment));
    for (const mcap::Attachment& attachment : options_.attachments) note(writer_.attach(attachment));
    std::map<std::pair<std::string, std::string>, uint16_t> schemas;
    for (const auto& [channel, schema] : channels_) {
      uint16_t id = 0;
      if (schema != nullptr) {
        const auto [known, added] = schemas.try_emplace({schema->name, schema->data}, uint16_t{0});
        if (added) known->second = writer_.add_schema(schema->name, schema->encoding, schema->data);
        id = known->second;
      }
      writer_.add_channel(id, channel.topic, channel.encoding, channel.metadata);
    }
  }

  void end() {
    note(writer_.metadata(Recorder::kEnd, named(parts_.back().reader, Recorder::kEnd)));
    for (const auto& one : options_.metadata) note(writer_.metadata(one.name, one.map));
    note(writer_.finish());
  }

  bool within(const mcap::Message& message) const {
    const auto at_ns = static_cast<int64_t>(message.log_ns);
    return at_ns >= options_.from_ns && at_ns < options_.to_ns;
  }
  bool of_a_port(uint16_t channel) const { return LogFile::of_a_port(channels_[channel - 1U].first); }

  template <class Each>
  void for_each(const Part& part, const Each& each) {
    for (const mcap::Chunk& chunk : part.reader.chunks())
      if (const auto records = part.reader.unpack(chunk))
        static_cast<void>(part.reader.for_each_in(*records, [&](const mcap::Message& message) {
          if (message.channel == 0) return true;
          const uint16_t channel = part.channel.at(message.channel);
          if (within(message) || held_.contains({channel, message.sequence})) each(channel, message);
          return refused_.empty();
        }));
      else damages_.insert(part.file.string() + ": " + records.error());
  }

  /// By jobs of that time.
  void find_held(const Part& part) {
    const int format = std::max(1, std::atoi(text(named(part.reader, Recorder::kFacts), "format").c_str()));
    for_each(part, [&](uint16_t channel, const mcap::Message& message) {
      if (channels_[channel - 1U].first.topic != Recorder::kJobs || !within(message)) return;
      const auto job = unpack_job(message.data, format);
      if (!job || job->task >= options_.edges.size()) return;
      for (const RecordedJob::Input& input : job->inputs) {
        if (input.edge >= options_.edges[job->task].size()) continue;
        const auto port = ids_.find(options_.edges[job->task][input.edge]);
        if (port == ids_.end()) continue;
        for (const RecordedJob::Run& run : input.held)
          for (uint64_t i = 0; i < std::min(run.count, kMostHeld); ++i)
            held_.insert({port->second, static_cast<uint32_t>(run.first + i)});
      }
    });
  }

  void find_whole_messages(const Part& part) {
    for_each(part, [&](uint16_t channel, const mcap::Message& message) {
      if (!of_a_port(channel)) return;
      const auto record = unpack_message(message.data);
      if (!record) damages_.insert(part.file.string() + ": a message: " + record.error());
      else if (record->whole) whole_.insert({channel, record->sequence});
    });
  }

  void copy(const Part& part) {
    for_each(part, [&](uint16_t channel, const mcap::Message& message) {
      if (of_a_port(channel)) {
        const auto record = unpack_message(message.data);
        if (!record) return;
        const Place place{channel, record->sequence};
        if ((!record->whole && whole_.contains(place)) || !written_.insert(place).second) return;
      }
      mcap::Message copied = message;
      copied.channel = channel;
      note(writer_.write(copied));
      const auto at_ns = static_cast<int64_t>(message.log_ns);
      joined_.first_ns = joined_.messages == 0 ? at_ns : std::min(joined_.first_ns, at_ns);
      joined_.last_ns = std::max(joined_.last_ns, at_ns);
      ++joined_.messages;
    });
  }

  const JoinOptions& options_;
  mcap::Writer writer_;
  std::string refused_;
  std::deque<Part> parts_;
  std::map<std::string, uint16_t> ids_;
  std::vector<std::pair<mcap::Channel, const mcap::Schema*>> channels_;
  std::set<Place> held_;  ///< as the file numbers it
  std::set<Place> whole_, written_;
  size_t older_ = 0;  ///< of the parts: they have only what is held
  std::set<std::string> damages_;
  Joined joined_;
};

}  // namespace

tl::expected<Joined, std::string> join(const std::vector<fs::path>& files, mcap::Sink& sink,
                                       const JoinOptions& options) {
  Join join(sink, options);
  join.open(files);
  return join.run();
}

}  // namespace takt::record
