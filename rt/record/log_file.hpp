// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/record/log_file.hpp>: record, experimental.
#pragma once
#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <unordered_map>
#include <vector>

#include "rt/record/mcap/reader.hpp"
#include "rt/record/message_record.hpp"
#include "rt/record/recorded_event.hpp"
#include "rt/record/recorded_job.hpp"

namespace takt::record {

/// A record that was opened: what the Recorder wrote, found by port and sequence. One thread at a time.
class LogFile {
 public:
  /// Error: not a record of Takt, of a later format, or not readable. One that lacks its end is opened as far as it
  /// goes.
  static tl::expected<LogFile, std::string> open(const std::filesystem::path& file);
  /// Without jobs, events and messages: those of a part of the run come with read().
  static tl::expected<LogFile, std::string> open_head(const std::filesystem::path& file);
  /// After open_head(), once: what was published from `from_ns` until `to_ns`, and some of what lies beside it. Of
  /// earlier messages, message() finds those with all fields.
  void read(int64_t from_ns, int64_t to_ns);

  const mcap::Reader& container() const { return container_; }
  /// What the head and the end of the record state; empty without an end.
  const mcap::Metadata& facts() const { return facts_; }
  const mcap::Metadata& end() const { return end_; }
  /// 1 to kFormat. Format 1 has no events, format 2 no JPEG.
  int format() const { return format_; }
  /// An attachment as text; nothing if there is none of that name.
  std::optional<std::string_view> attached(std::string_view name) const;

  /// In the order of the file.
  const std::vector<RecordedJob>& jobs() const { return jobs_; }
  /// In the order of the file: those of a task are in the order of their instants.
  const std::vector<RecordedEvent>& events() const { return events_; }
  /// Whether a channel of the file has messages of a port, as the Recorder writes them.
  static bool of_a_port(const mcap::Channel& channel);
  /// Channel of "NODE.PORT"; 0 if the record has none.
  uint16_t channel(std::string_view port) const;
  /// A message that is there, without its fields.
  struct Known {
    int64_t stamp_ns = 0;
    uint64_t hash = 0;
    bool whole = false, coded = false;
    uint32_t chunk = 0, size = 0;  ///< where it lies: bytes at `offset` among the records of the chunk
    uint64_t offset = 0;
  };
  /// Of a channel by sequence; empty if there is none.
  const std::map<uint64_t, Known>& messages(uint16_t channel) const;
  /// Nothing if it is not there. Its data is valid until the next call; never coded.
  std::optional<MessageRecord> message(uint16_t channel, uint64_t sequence);
  /// What is damaged or missing in the file; empty if it is whole.
  const std::vector<std::string>& damages() const { return damages_; }
  /// What is in the file, undamaged, and is not read: records of unknown kinds, messages of other encodings.
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  explicit LogFile(mcap::Reader container) : container_(std::move(container)) {}
  static tl::expected<LogFile, std::string> open(const std::filesystem::path& file, bool all);
  void index(uint32_t chunk, bool only_ports);
  /// Takes in the chunk before those that were read; false: there is none.
  bool look_back();
  void index(const mcap::Message& message, Known known, bool only_ports);
  void check_channels();
  const std::vector<std::byte>* chunk(uint32_t number);

  mcap::Reader container_;
  mcap::Metadata facts_, end_;
  int format_ = 1;
  uint32_t first_read_ = 0;  ///< chunks before it were not read
  uint16_t jobs_channel_ = 0, events_channel_ = 0;
  std::vector<RecordedJob> jobs_;
  std::vector<RecordedEvent> events_;
  std::map<uint16_t, std::map<uint64_t, Known>> messages_;  ///< by channel and sequence
  std::vector<std::string> damages_, left_out_;
  std::map<uint16_t, uint64_t> foreign_;  ///< messages by channel (0: one that nothing describes)
  static constexpr size_t kChunksKept = 48;
  std::unordered_map<uint32_t, std::vector<std::byte>> unpacked_;
  std::vector<std::byte> plain_;  ///< of the last message that was coded
  std::deque<uint32_t> order_;    ///< of the chunks in hand, oldest first
};

}  // namespace takt::record
