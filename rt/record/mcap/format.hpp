// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/record/mcap/format.hpp>: record, experimental.
// The MCAP container as its public format specification (version 0) has it: what is in a file, apart from the bytes.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "rt/record/mcap/bytes.hpp"

namespace takt::mcap {

inline constexpr std::array<unsigned char, 8> kMagic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

enum class Op : uint8_t {
  header = 1,
  footer,
  schema,
  channel,
  message,
  chunk,
  message_index,
  chunk_index,
  attachment,
  attachment_index,
  statistics,
  metadata,
  metadata_index,
  summary_offset,
  data_end
};

enum class Compression : uint8_t { none, zstd };

struct Schema {
  uint16_t id = 0;  ///< from 1
  std::string name, encoding, data;
  bool operator==(const Schema&) const = default;
};

struct Channel {
  uint16_t id = 0;
  uint16_t schema = 0;  ///< 0: none
  std::string topic, encoding;
  Metadata metadata;
  bool operator==(const Channel&) const = default;
};

struct Message {
  uint16_t channel = 0;  ///< as read: 0 if no record describes it
  uint32_t sequence = 0;
  uint64_t log_ns = 0, publish_ns = 0;
  Bytes data;
};

struct Attachment {
  uint64_t log_ns = 0, create_ns = 0;
  std::string name, media_type;
  Bytes data;
};

struct ChunkIndex {
  uint64_t start_ns = 0, end_ns = 0;  ///< least and largest log_ns of its messages; 0 if it has none
  uint64_t offset = 0, length = 0;    ///< of the chunk record in the file, with its opcode and length
  std::map<uint16_t, uint64_t> message_index_offsets;
  uint64_t message_index_length = 0;
  std::string compression;  ///< "", "zstd" or, of other writers, "lz4"
  uint64_t compressed_size = 0, uncompressed_size = 0;
};

struct Statistics {
  uint64_t messages = 0;
  uint32_t attachments = 0, metadata = 0, chunks = 0;
  uint64_t start_ns = 0, end_ns = 0;
  std::map<uint16_t, uint64_t> channel_messages;
};

}  // namespace takt::mcap
