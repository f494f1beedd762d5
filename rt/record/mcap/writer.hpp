// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/record/mcap/writer.hpp>: record, experimental.
#pragma once
#include <cstdint>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "rt/record/mcap/file_sink.hpp"
#include "rt/record/mcap/format.hpp"

namespace takt::mcap {

/// Writes an MCAP file: messages in chunks, with CRCs, message and chunk indexes, and a summary at the end. What was
/// handed to the sink can be read without the rest, to the last complete chunk.
///
/// Every call answers whether the sink took it. After a refusal nothing is lost but the chunk or record in hand: `lost`
/// counts its messages, and the next call tries again. One thread at a time.
class Writer {
 public:
  struct Options {
    size_t chunk_bytes = 1 << 20;  ///< a chunk ends with the message that makes it as large, before compression
    Compression compression = Compression::zstd;  ///< of chunks that it makes a fifth smaller, by samples
    int level = 1;                                ///< of zstd
    /// Of chunks in the summary, which is in memory until the end. With more there is none, and readers read on.
    size_t most_index_bytes = SIZE_MAX;
  };
  using Done = tl::expected<void, std::string>;

  Writer(Sink& sink, const Options& options);

  Done begin(std::string_view profile, std::string_view library);
  /// Ids count from 1. A schema or channel that the sink refused is written before the next chunk.
  uint16_t add_schema(std::string name, std::string encoding, std::string data);
  uint16_t add_channel(uint16_t schema, std::string topic, std::string encoding, Metadata metadata);
  Done write(const Message& message);
  Done attach(const Attachment& attachment);
  Done metadata(std::string_view name, const Metadata& map);
  /// Ends the chunk in hand, however small.
  Done flush();
  /// Ends the file with summary and footer. Nothing may be written afterwards.
  Done finish();

  uint64_t written_bytes() const { return size_; }
  const Statistics& statistics() const { return statistics_; }
  uint64_t lost() const { return lost_; }  ///< messages in chunks that the sink refused

 private:
  Done append(std::initializer_list<Bytes> parts);
  Done write_definitions();
  std::vector<std::byte> indexes(ChunkIndex& index, uint64_t at) const;
  void count_chunk(const ChunkIndex& index);
  void drop_chunk();
  std::vector<std::byte> summary();

  Sink& sink_;
  Options options_;
  uint64_t size_ = 0;
  uint32_t crc_ = 0;  ///< of all bytes so far
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  size_t schemas_written_ = 0, channels_written_ = 0;
  struct Indexed {
    uint64_t log_ns, offset;
  };
  std::vector<std::byte> chunk_;                      ///< records of the chunk in hand
  std::map<uint16_t, std::vector<Indexed>> indexed_;  ///< its messages
  uint64_t chunk_start_ns_ = 0, chunk_end_ns_ = 0, chunk_messages_ = 0, lost_ = 0;
  /// Records for the summary, as they lie in it: of chunks there are tens of thousands.
  std::vector<std::byte> chunk_indexes_, attachment_indexes_, metadata_indexes_;
  bool chunks_indexed_ = true;
  Statistics statistics_;
};

}  // namespace takt::mcap
