// SPDX-License-Identifier: Apache-2.0
#include "rt/record/log_file.hpp"

#include <algorithm>
#include <cstdlib>

#include "rt/abi.hpp"
#include "rt/record/recorder.hpp"

namespace takt::record {

tl::expected<LogFile, std::string> LogFile::open(const std::filesystem::path& file) {
  auto log = open(file, true);
  if (log) log->read(INT64_MIN, INT64_MAX);
  return log;
}

tl::expected<LogFile, std::string> LogFile::open_head(const std::filesystem::path& file) { return open(file, false); }

tl::expected<LogFile, std::string> LogFile::open(const std::filesystem::path& file, bool all) {
  auto container = mcap::Reader::open(file, all);
  if (!container) return tl::make_unexpected(container.error());
  LogFile log(std::move(*container));
  for (const auto& named : log.container_.metadata()) {
    if (named.name == Recorder::kFacts) log.facts_ = named.map;
    if (named.name == Recorder::kEnd) log.end_ = named.map;
  }
  if (log.facts_.empty()) return tl::make_unexpected(file.string() + " is no record of takt run --record");
  if (const auto format = log.facts_.find("format"); format != log.facts_.end())
    log.format_ = std::atoi(format->second.c_str());
  if (log.format_ < 1 || log.format_ > kFormat)
    return tl::make_unexpected(file.string() + " is a record of format " + log.facts_["format"] +
                               ", and this is Takt " + version().number + ", which reads formats 1 to " +
                               std::to_string(kFormat) + "; use a later Takt (commit " + log.facts_["commit"] +
                               " wrote the file)");
  log.jobs_channel_ = log.channel(Recorder::kJobs);
  log.events_channel_ = log.channel(Recorder::kEvents);
  if (!log.container_.missing().empty()) log.damages_.push_back(log.container_.missing());
  return log;
}

void LogFile::read(int64_t from_ns, int64_t to_ns) {
  const std::vector<mcap::Chunk>& chunks = container_.chunks();
  const auto within = [&](const mcap::Chunk& chunk) {
    return (from_ns <= 0 || chunk.last_ns >= static_cast<uint64_t>(from_ns)) &&
           (to_ns == INT64_MAX || (to_ns > 0 && chunk.first_ns < static_cast<uint64_t>(to_ns)));
  };
  first_read_ = static_cast<uint32_t>(std::find_if(chunks.begin(), chunks.end(), within) - chunks.begin());
  for (uint32_t number = first_read_; number < chunks.size(); ++number)
    if (within(chunks[number])) index(number, false);
  check_channels();
}

bool LogFile::look_back() {
  if (first_read_ == 0) return false;
  index(--first_read_, true);
  return true;
}

void LogFile::index(uint32_t number, bool only_ports) {
  const mcap::Chunk& chunk = container_.chunks()[number];
  const auto records = container_.unpack(chunk);
  if (!records) return damages_.push_back(records.error());
  const auto walked = container_.for_each_in(*records, [&](const mcap::Message& message) {
    const auto offset = static_cast<uint64_t>(message.data.data() - records->data());
    index(message, {0, 0, false, false, number, static_cast<uint32_t>(message.data.size()), offset}, only_ports);
    return true;
  });
  if (!walked) damages_.push_back("the chunk at byte " + std::to_string(chunk.at) + ": " + walked.error());
}

void LogFile::check_channels() {
  left_out_ = container_.left_out();
  for (const auto& [id, count] : foreign_) {
    const std::string messages = std::to_string(count) + " messages ";
    if (id == 0) damages_.push_back(messages + "of channels that no channel record describes");
    else
      left_out_.push_back(messages + "of " + container_.channels()[id - 1U].topic + ", whose encoding is `" +
                          container_.channels()[id - 1U].encoding + "`, not `" + Recorder::kEncoding + "`");
  }
  std::map<std::string_view, int> topics;
  for (const mcap::Channel& channel : container_.channels())
    if (channel.encoding == Recorder::kEncoding && ++topics[channel.topic] == 2)
      damages_.push_back("two channels have the topic " + channel.topic +
                         " and different descriptions; the first is read");
}

void LogFile::index(const mcap::Message& message, Known known, bool only_ports) {
  if (message.channel == 0 || container_.channels()[message.channel - 1U].encoding != Recorder::kEncoding) {
    ++foreign_[message.channel];
    return;
  }
  if (only_ports && (message.channel == jobs_channel_ || message.channel == events_channel_)) return;
  if (message.channel == jobs_channel_) {
    auto job = unpack_job(message.data, format_);
    if (job) jobs_.push_back(std::move(*job));
    else damages_.push_back("a job: " + job.error());
    return;
  }
  if (events_channel_ != 0 && message.channel == events_channel_) {
    auto event = unpack_event(message.data);
    if (event) events_.push_back(std::move(*event));
    else damages_.push_back("an event: " + event.error());
    return;
  }
  const auto record = unpack_message(message.data);
  if (!record) {
    damages_.push_back("a message: " + record.error());
    return;
  }
  known.stamp_ns = record->stamp_ns;
  known.hash = record->hash;
  known.whole = record->whole;
  known.coded = record->coded;
  messages_[message.channel][record->sequence] = known;
}

std::optional<std::string_view> LogFile::attached(std::string_view name) const {
  for (const mcap::Attachment& attachment : container_.attachments())
    if (attachment.name == name)
      return std::string_view(reinterpret_cast<const char*>(attachment.data.data()), attachment.data.size());
  return std::nullopt;
}

bool LogFile::of_a_port(const mcap::Channel& channel) {
  return channel.encoding == Recorder::kEncoding && channel.topic != Recorder::kJobs &&
         channel.topic != Recorder::kEvents;
}

uint16_t LogFile::channel(std::string_view port) const {
  for (const mcap::Channel& channel : container_.channels())
    if (channel.topic == port && channel.encoding == Recorder::kEncoding) return channel.id;
  return 0;
}

const std::map<uint64_t, LogFile::Known>& LogFile::messages(uint16_t channel) const {
  static const std::map<uint64_t, Known> none;
  const auto found = messages_.find(channel);
  return found == messages_.end() ? none : found->second;
}

const std::vector<std::byte>* LogFile::chunk(uint32_t number) {
  if (const auto there = unpacked_.find(number); there != unpacked_.end()) return &there->second;
  auto records = container_.unpack(container_.chunks()[number]);
  if (!records) return nullptr;
  if (order_.size() == kChunksKept) {
    unpacked_.erase(order_.front());
    order_.pop_front();
  }
  order_.push_back(number);
  return &(unpacked_[number] = std::move(*records));
}

std::optional<MessageRecord> LogFile::message(uint16_t channel, uint64_t sequence) {
  const std::map<uint64_t, Known>& all = messages_[channel];
  auto known = all.find(sequence);
  const auto earlier = [&] { return all.empty() || all.begin()->first > sequence; };
  while (known == all.end() && earlier() && look_back()) known = all.find(sequence);
  if (known == all.end()) return std::nullopt;
  const std::vector<std::byte>* records = chunk(known->second.chunk);
  if (records == nullptr) return std::nullopt;
  auto record =
      unpack_message(std::span(*records).subspan(static_cast<size_t>(known->second.offset), known->second.size));
  if (!record || !uncode(*record, plain_)) return std::nullopt;
  return *record;
}

}  // namespace takt::record
