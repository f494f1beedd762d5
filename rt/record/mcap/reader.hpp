// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/record/mcap/reader.hpp>: record, experimental.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/record/mcap/format.hpp"

namespace takt::mcap {

/// Messages that lie together in a file: a chunk, or a run of messages that no chunk holds.
struct Chunk {
  uint64_t at = 0;  ///< of its (first) record in the file
  uint64_t uncompressed_size = 0;
  uint32_t crc = 0;
  uint64_t first_ns = 0, last_ns = UINT64_MAX;  ///< instants of its messages, as its writer says
  std::string compression;
  bool loose = false;  ///< messages outside chunks
  Bytes stored;
};

/// An MCAP file of any writer, whole or cut off anywhere: what is there is read record by record, so nothing depends on
/// its summary or indexes.
///
///     const auto reader = mcap::Reader::open("run.mcap");
///     if (reader) reader->for_each([](const mcap::Message& message) { return true; });
///
/// Schemas and channels are taken from wherever they stand: the data section, chunks, the summary. Their ids here count
/// from 1 in the order in which they are met, whatever they are in the file; equal channels are one. Chunks and
/// attachments are checked against their CRCs, where the file has some. Const members from any thread. The file stays
/// mapped; it must not be made shorter meanwhile.
class Reader {
 public:
  /// Error: the file cannot be opened, or is none of this format. A file that lacks its end is no error.
  /// `all`: also whether the CRC of the whole file fits, which takes as long as reading it; chunks have their own.
  static tl::expected<Reader, std::string> open(const std::filesystem::path& file, bool all = true);
  Reader(Reader&& other) noexcept;
  Reader& operator=(Reader&&) = delete;
  ~Reader();

  const std::string& profile() const { return profile_; }
  const std::string& written_by() const { return written_by_; }
  const std::vector<Schema>& schemas() const { return schemas_; }
  const std::vector<Channel>& channels() const { return channels_; }
  const std::vector<Chunk>& chunks() const { return chunks_; }
  const std::vector<Attachment>& attachments() const { return attachments_; }
  struct Named {
    std::string name;
    Metadata map;
  };
  const std::vector<Named>& metadata() const { return metadata_; }

  /// Empty if the file is whole: footer, summary and CRCs of both sections fit. Else what is wrong, in a sentence.
  const std::string& missing() const { return missing_; }

  /// The records of a chunk. Error: damaged, or compressed in a way this build does not know.
  tl::expected<std::vector<std::byte>, std::string> unpack(const Chunk& chunk) const;

  /// What is in the file and is not read, one sentence each: records of kinds that the format (version 0) does not
  /// have.
  const std::vector<std::string>& left_out() const { return left_out_; }

  /// Every message among the records of a chunk; stops if `each` answers false, and then answers so. The data lies in
  /// `records`. A message whose channel no record describes has channel 0. Error: they end too early.
  tl::expected<bool, std::string> for_each_in(Bytes records, const std::function<bool(const Message&)>& each) const;

  /// Every message, in the order of the file; stops if `each` answers false. The data is valid during the call. Error:
  /// a chunk that is damaged; the messages before it were given.
  tl::expected<void, std::string> for_each(const std::function<bool(const Message&)>& each) const;

 private:
  Reader(Bytes file, bool all) : file_(file), all_(all) {}
  void scan();
  void take(Op op, Bytes fields, uint64_t at);
  void take_definition(Op op, Bytes fields);
  void take_message(Bytes fields, uint64_t at);
  void take_definitions_in_chunks();
  void take_unknown(Op op);
  void name_unknown();
  /// `summary_at`: behind the record that ends the data section.
  std::string check_end(uint64_t data_end_at, uint64_t summary_at);

  Bytes file_;
  const bool all_;
  std::string profile_, written_by_, missing_;
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::map<uint16_t, uint16_t> schema_ids_, channel_ids_;  ///< here, by those of the file
  std::set<uint16_t> indexed_;                             ///< channels of the file that indexes name
  size_t chunks_with_index_ = 0;
  bool chunk_has_index_ = true;           ///< the last one
  std::map<unsigned, uint64_t> unknown_;  ///< records by opcode
  std::vector<std::string> left_out_;
  std::vector<Chunk> chunks_;
  std::vector<Attachment> attachments_;
  std::vector<Named> metadata_;
};

}  // namespace takt::mcap
