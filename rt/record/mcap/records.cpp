// SPDX-License-Identifier: Apache-2.0
#include "rt/record/mcap/records.hpp"

#include <libdeflate.h>

namespace takt::mcap {

uint32_t crc_of(uint32_t before, Bytes data) { return libdeflate_crc32(before, data.data(), data.size()); }

void put(std::vector<std::byte>& to, const Schema& schema) {
  put_record(to, Op::schema, [&](ByteWriter& fields) {
    fields.number(schema.id);
    fields.text(schema.name);
    fields.text(schema.encoding);
    fields.text(schema.data);
  });
}

Schema get_schema(Bytes from) {
  ByteReader fields(from);
  Schema schema;
  schema.id = fields.number<uint16_t>();
  schema.name = fields.text();
  schema.encoding = fields.text();
  schema.data = fields.text();
  return schema;
}

void put(std::vector<std::byte>& to, const Channel& channel) {
  put_record(to, Op::channel, [&](ByteWriter& fields) {
    fields.number(channel.id);
    fields.number(channel.schema);
    fields.text(channel.topic);
    fields.text(channel.encoding);
    fields.metadata(channel.metadata);
  });
}

Channel get_channel(Bytes from) {
  ByteReader fields(from);
  Channel channel;
  channel.id = fields.number<uint16_t>();
  channel.schema = fields.number<uint16_t>();
  channel.topic = fields.text();
  channel.encoding = fields.text();
  channel.metadata = fields.metadata();
  return channel;
}

void put(std::vector<std::byte>& to, const Message& message) {
  put_record(to, Op::message, [&](ByteWriter& fields) {
    fields.number(message.channel);
    fields.number(message.sequence);
    fields.number(message.log_ns);
    fields.number(message.publish_ns);
    fields.bytes(message.data);
  });
}

Message get_message(Bytes from) {
  ByteReader fields(from);
  Message message;
  message.channel = fields.number<uint16_t>();
  message.sequence = fields.number<uint32_t>();
  message.log_ns = fields.number<uint64_t>();
  message.publish_ns = fields.number<uint64_t>();
  message.data = fields.bytes(fields.left());
  return message;
}

void put(std::vector<std::byte>& to, const Attachment& attachment) {
  put_record(to, Op::attachment, [&](ByteWriter& fields) {
    const size_t from = to.size();
    fields.number(attachment.log_ns);
    fields.number(attachment.create_ns);
    fields.text(attachment.name);
    fields.text(attachment.media_type);
    fields.counted<uint64_t>([&] { fields.bytes(attachment.data); });
    fields.number(crc_of(0, Bytes(to).subspan(from)));
  });
}

Attachment get_attachment(Bytes from) {
  ByteReader fields(from);
  Attachment attachment;
  attachment.log_ns = fields.number<uint64_t>();
  attachment.create_ns = fields.number<uint64_t>();
  attachment.name = fields.text();
  attachment.media_type = fields.text();
  attachment.data = fields.bytes(fields.number<uint64_t>());
  const Bytes covered = from.first(from.size() - fields.left());
  const auto crc = fields.number<uint32_t>();
  if (crc != 0 && crc != crc_of(0, covered)) throw std::runtime_error("attachment " + attachment.name + " is damaged");
  return attachment;
}

void put_chunk_head(std::vector<std::byte>& to, const ChunkIndex& index, uint32_t uncompressed_crc) {
  const size_t at = to.size();
  put_record(to, Op::chunk, [&](ByteWriter& fields) {
    fields.number(index.start_ns);
    fields.number(index.end_ns);
    fields.number(index.uncompressed_size);
    fields.number(uncompressed_crc);
    fields.text(index.compression);
    fields.number(index.compressed_size);
  });
  // The length of the record takes in what will lie behind.
  const uint64_t length = to.size() - at - sizeof(Op) - sizeof(uint64_t) + index.compressed_size;
  std::memcpy(to.data() + at + sizeof(Op), &length, sizeof length);
}

void put(std::vector<std::byte>& to, const ChunkIndex& index) {
  put_record(to, Op::chunk_index, [&](ByteWriter& fields) {
    fields.number(index.start_ns);
    fields.number(index.end_ns);
    fields.number(index.offset);
    fields.number(index.length);
    fields.counted<uint32_t>([&] {
      for (const auto& [channel, at] : index.message_index_offsets) fields.number(channel), fields.number(at);
    });
    fields.number(index.message_index_length);
    fields.text(index.compression);
    fields.number(index.compressed_size);
    fields.number(index.uncompressed_size);
  });
}

void put(std::vector<std::byte>& to, const Statistics& statistics, size_t schemas, size_t channels) {
  put_record(to, Op::statistics, [&](ByteWriter& fields) {
    fields.number(statistics.messages);
    fields.number(static_cast<uint16_t>(schemas));
    fields.number(static_cast<uint32_t>(channels));
    fields.number(statistics.attachments);
    fields.number(statistics.metadata);
    fields.number(statistics.chunks);
    fields.number(statistics.start_ns);
    fields.number(statistics.end_ns);
    fields.counted<uint32_t>([&] {
      for (const auto& [channel, count] : statistics.channel_messages) fields.number(channel), fields.number(count);
    });
  });
}

void put_footer(std::vector<std::byte>& to, uint64_t summary_at, uint64_t offsets_at) {
  ByteWriter writer(to);
  writer.number(static_cast<uint8_t>(Op::footer));
  writer.number(uint64_t{2 * sizeof(uint64_t) + sizeof(uint32_t)});
  writer.number(summary_at);
  writer.number(offsets_at);
  writer.number(crc_of(0, to));
}

}  // namespace takt::mcap
