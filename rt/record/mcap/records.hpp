// SPDX-License-Identifier: Apache-2.0
// Records as bytes, written and read: the one place that knows the order of their fields.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "rt/record/mcap/format.hpp"

namespace takt::mcap {

/// CRC-32 as zlib has it, of what `before` is the CRC of and `data` behind it.
uint32_t crc_of(uint32_t before, Bytes data);

/// One record: opcode, length, and the fields that `fill(ByteWriter&)` writes.
template <class Fill>
void put_record(std::vector<std::byte>& to, Op op, const Fill& fill) {
  ByteWriter writer(to);
  writer.number(static_cast<uint8_t>(op));
  writer.counted<uint64_t>([&] { fill(writer); });
}

void put(std::vector<std::byte>& to, const Schema& schema);
void put(std::vector<std::byte>& to, const Channel& channel);
void put(std::vector<std::byte>& to, const Message& message);
void put(std::vector<std::byte>& to, const Attachment& attachment);
void put(std::vector<std::byte>& to, const ChunkIndex& index);
void put(std::vector<std::byte>& to, const Statistics& statistics, size_t schemas, size_t channels);
/// A chunk record up to the stored bytes of the chunk, which lie behind it in the file.
void put_chunk_head(std::vector<std::byte>& to, const ChunkIndex& index, uint32_t uncompressed_crc);
/// Behind the summary section that `to` is, which begins at `summary_at` in the file: CRC over both.
void put_footer(std::vector<std::byte>& to, uint64_t summary_at, uint64_t offsets_at);

// Of the fields, without opcode and length. Throw TooShort; fields that a later version may have appended are passed
// over.
Schema get_schema(Bytes fields);
Channel get_channel(Bytes fields);
Message get_message(Bytes fields);  ///< `data` lies in `fields`
/// Also throws std::runtime_error if its CRC is wrong. `data` lies in `fields`.
Attachment get_attachment(Bytes fields);

}  // namespace takt::mcap
