// SPDX-License-Identifier: Apache-2.0
#include "rt/record/mcap/writer.hpp"

#include <zstd.h>

#include <algorithm>

#include "rt/record/mcap/records.hpp"

namespace takt::mcap {
namespace {

std::vector<std::byte> compressed(Bytes data, int level) {
  std::vector<std::byte> packed(ZSTD_compressBound(data.size()));
  const size_t size = ZSTD_compress(packed.data(), packed.size(), data.data(), data.size(), level);
  packed.resize(ZSTD_isError(size) != 0 ? 0 : size);
  return packed;
}

/// Whether samples of the data shrink by a fifth at least. Pixels with the noise of a camera shrink by a tenth, and
/// that takes most of what a recorder costs.
bool worth_compressing(Bytes data, int level) {
  constexpr size_t kSamples = 8, kSampleBytes = 4096;
  if (data.size() < 2 * kSamples * kSampleBytes) return true;
  std::vector<std::byte> samples;
  samples.reserve(kSamples * kSampleBytes);
  for (size_t i = 0; i < kSamples; ++i) {
    const Bytes sample = data.subspan((data.size() - kSampleBytes) / (kSamples - 1) * i, kSampleBytes);
    samples.insert(samples.end(), sample.begin(), sample.end());
  }
  return compressed(samples, level).size() * 5 < samples.size() * 4;
}

}  // namespace

Writer::Writer(Sink& sink, const Options& options) : sink_(sink), options_(options) {}

Writer::Done Writer::append(std::initializer_list<Bytes> parts) {
  if (auto done = sink_.append(std::span(parts.begin(), parts.size())); !done) return done;
  for (const Bytes part : parts) {
    size_ += part.size();
    crc_ = crc_of(crc_, part);
  }
  return {};
}

Writer::Done Writer::begin(std::string_view profile, std::string_view library) {
  std::vector<std::byte> head;
  ByteWriter(head).bytes(std::as_bytes(std::span(kMagic)));
  put_record(head, Op::header, [&](ByteWriter& to) { to.text(profile), to.text(library); });
  return append({head});
}

uint16_t Writer::add_schema(std::string name, std::string encoding, std::string data) {
  schemas_.push_back(
      {static_cast<uint16_t>(schemas_.size() + 1), std::move(name), std::move(encoding), std::move(data)});
  return schemas_.back().id;
}

uint16_t Writer::add_channel(uint16_t schema, std::string topic, std::string encoding, Metadata metadata) {
  const auto id = static_cast<uint16_t>(channels_.size() + 1);
  channels_.push_back({id, schema, std::move(topic), std::move(encoding), std::move(metadata)});
  return id;
}

/// Before the chunk that first uses them, so that a file without its end can be read.
Writer::Done Writer::write_definitions() {
  if (schemas_written_ == schemas_.size() && channels_written_ == channels_.size()) return {};
  std::vector<std::byte> data;
  for (size_t i = schemas_written_; i < schemas_.size(); ++i) put(data, schemas_[i]);
  for (size_t i = channels_written_; i < channels_.size(); ++i) put(data, channels_[i]);
  if (auto done = append({data}); !done) return done;
  schemas_written_ = schemas_.size();
  channels_written_ = channels_.size();
  return {};
}

Writer::Done Writer::write(const Message& message) {
  indexed_[message.channel].push_back({message.log_ns, chunk_.size()});
  put(chunk_, message);
  chunk_start_ns_ = chunk_messages_ == 0 ? message.log_ns : std::min(chunk_start_ns_, message.log_ns);
  chunk_end_ns_ = chunk_messages_ == 0 ? message.log_ns : std::max(chunk_end_ns_, message.log_ns);
  ++chunk_messages_;
  return chunk_.size() >= options_.chunk_bytes ? flush() : Done{};
}

Writer::Done Writer::flush() {
  if (chunk_messages_ == 0) return {};
  if (auto done = write_definitions(); !done) return drop_chunk(), done;
  ChunkIndex index;
  index.start_ns = chunk_start_ns_;
  index.end_ns = chunk_end_ns_;
  index.offset = size_;
  index.uncompressed_size = chunk_.size();
  std::vector<std::byte> packed;
  if (options_.compression == Compression::zstd && worth_compressing(chunk_, options_.level))
    packed = compressed(chunk_, options_.level);
  const bool smaller = !packed.empty() && packed.size() < chunk_.size();
  const std::vector<std::byte>& stored = smaller ? packed : chunk_;
  index.compression = smaller ? "zstd" : "";
  index.compressed_size = stored.size();
  std::vector<std::byte> head;
  put_chunk_head(head, index, crc_of(0, chunk_));
  index.length = head.size() + stored.size();
  const Done done = append({head, stored, indexes(index, size_ + index.length)});
  if (!done) return drop_chunk(), done;
  count_chunk(index);
  return {};
}

/// Message indexes of the chunk, as they lie from `at` on in the file.
std::vector<std::byte> Writer::indexes(ChunkIndex& index, uint64_t at) const {
  std::vector<std::byte> records;
  for (const auto& [channel, entries] : indexed_) {
    index.message_index_offsets[channel] = at + records.size();
    put_record(records, Op::message_index, [&, id = channel, &list = entries](ByteWriter& fields) {
      fields.number(id);
      fields.counted<uint32_t>([&] {
        for (const Indexed& entry : list) fields.number(entry.log_ns), fields.number(entry.offset);
      });
    });
  }
  index.message_index_length = records.size();
  return records;
}

void Writer::count_chunk(const ChunkIndex& index) {
  const bool first = statistics_.messages == 0;
  statistics_.start_ns = first ? index.start_ns : std::min(statistics_.start_ns, index.start_ns);
  statistics_.end_ns = first ? index.end_ns : std::max(statistics_.end_ns, index.end_ns);
  statistics_.messages += chunk_messages_;
  ++statistics_.chunks;
  for (const auto& [channel, entries] : indexed_) statistics_.channel_messages[channel] += entries.size();
  if (chunks_indexed_) put(chunk_indexes_, index);
  if (chunk_indexes_.size() > options_.most_index_bytes) chunk_indexes_ = {}, chunks_indexed_ = false;
  chunk_messages_ = 0;  // it is written
  drop_chunk();
}

void Writer::drop_chunk() {
  lost_ += chunk_messages_;
  chunk_messages_ = 0;
  chunk_.clear();
  indexed_.clear();
}

Writer::Done Writer::attach(const Attachment& attachment) {
  std::vector<std::byte> data;
  put(data, attachment);
  const uint64_t at = size_;
  if (auto done = append({data}); !done) return done;
  put_record(attachment_indexes_, Op::attachment_index, [&](ByteWriter& fields) {
    fields.number(at);
    fields.number(uint64_t{data.size()});
    fields.number(attachment.log_ns);
    fields.number(attachment.create_ns);
    fields.number(uint64_t{attachment.data.size()});
    fields.text(attachment.name);
    fields.text(attachment.media_type);
  });
  ++statistics_.attachments;
  return {};
}

Writer::Done Writer::metadata(std::string_view name, const Metadata& map) {
  std::vector<std::byte> data;
  put_record(data, Op::metadata, [&](ByteWriter& fields) { fields.text(name), fields.metadata(map); });
  const uint64_t at = size_;
  if (auto done = append({data}); !done) return done;
  put_record(metadata_indexes_, Op::metadata_index, [&](ByteWriter& fields) {
    fields.number(at);
    fields.number(uint64_t{data.size()});
    fields.text(name);
  });
  ++statistics_.metadata;
  return {};
}

/// The records of the summary section, each group with its offset record behind them all.
std::vector<std::byte> Writer::summary() {
  std::vector<std::byte> data, offsets;
  const auto group = [&](Op op, const auto& write) {
    const size_t from = data.size();
    write();
    if (data.size() == from) return;
    put_record(offsets, Op::summary_offset, [&](ByteWriter& fields) {
      fields.number(static_cast<uint8_t>(op));
      fields.number(size_ + from);
      fields.number(uint64_t{data.size() - from});
    });
  };
  group(Op::schema, [&] {
    for (const Schema& schema : schemas_) put(data, schema);
  });
  group(Op::channel, [&] {
    for (const Channel& channel : channels_) put(data, channel);
  });
  group(Op::statistics, [&] { put(data, statistics_, schemas_.size(), channels_.size()); });
  group(Op::chunk_index, [&] { ByteWriter(data).bytes(chunk_indexes_); });
  group(Op::attachment_index, [&] { ByteWriter(data).bytes(attachment_indexes_); });
  group(Op::metadata_index, [&] { ByteWriter(data).bytes(metadata_indexes_); });
  const uint64_t offsets_at = size_ + data.size();
  ByteWriter(data).bytes(offsets);
  put_footer(data, size_, offsets_at);
  return data;
}

Writer::Done Writer::finish() {
  if (auto done = flush(); !done) return done;
  if (auto done = write_definitions(); !done) return done;
  std::vector<std::byte> end;
  put_record(end, Op::data_end, [&](ByteWriter& fields) { fields.number(crc_); });
  if (auto done = append({end}); !done) return done;
  std::vector<std::byte> tail = summary();
  ByteWriter(tail).bytes(std::as_bytes(std::span(kMagic)));
  return append({tail});
}

}  // namespace takt::mcap
