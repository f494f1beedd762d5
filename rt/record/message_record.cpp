// SPDX-License-Identifier: Apache-2.0
#include "rt/record/message_record.hpp"

#include <utility>

#include "rt/msg/scalar.hpp"
#include "rt/record/mcap/bytes.hpp"
#include "rt/record/picture_codec.hpp"
#include "rt/xxhash.hpp"

namespace takt::record {

uint64_t hash_of(std::span<const std::byte> packed) { return XXH3_64bits(packed.data(), packed.size()); }

namespace {

/// What a message has of its fields.
constexpr uint8_t kHash = 0, kAll = 1, kCoded = 2;
constexpr size_t kFieldsAt = 4 * 8 + 4;  ///< where that stands
constexpr size_t kHeadBytes = kFieldsAt + 1 + 8;

/// hash_of() without packing: what is recorded by its hash only is not copied.
uint64_t hash_in_place(const MessageType& type, const void* message) {
  XXH3_state_t state;
  XXH3_64bits_reset(&state);
  for_each_piece(type, message,
                 [&](std::span<const std::byte> piece) { XXH3_64bits_update(&state, piece.data(), piece.size()); });
  return XXH3_64bits_digest(&state);
}

}  // namespace

void pack(const MessageType& type, const Held& held, bool whole, std::vector<std::byte>& to) {
  mcap::ByteWriter out(to);
  out.number(held.header->sequence);
  out.number(static_cast<uint64_t>(held.header->stamp_ns));
  out.number(static_cast<uint64_t>(held.header->published_ns));
  out.number(static_cast<uint64_t>(held.header->visible_at_ns));
  out.number(static_cast<uint32_t>(held.header->level));
  out.number(whole ? kAll : kHash);
  out.number(hash_in_place(type, held.message()));
  if (!whole) return;
  to.reserve(to.size() + packed_bytes(type, held.message()));
  pack(type, held.message(), to);
}

void code(const MessageType& type, std::span<const std::byte> message, PictureCoder& coder,
          std::vector<std::byte>& to) {
  const auto head = message.first(kHeadBytes), packed = message.subspan(kHeadBytes);
  const size_t from = to.size();
  to.insert(to.end(), head.begin(), head.end());
  if (head[kFieldsAt] == std::byte{kHash}) return;
  to[from + kFieldsAt] = std::byte{kCoded};
  coder.code(type.fields, packed, to);
}

tl::expected<MessageRecord, std::string> unpack_message(std::span<const std::byte> packed) {
  MessageRecord record;
  mcap::ByteReader in(packed);
  try {
    record.sequence = in.number<uint64_t>();
    record.stamp_ns = static_cast<int64_t>(in.number<uint64_t>());
    record.published_ns = static_cast<int64_t>(in.number<uint64_t>());
    record.visible_at_ns = static_cast<int64_t>(in.number<uint64_t>());
    record.level = static_cast<int32_t>(in.number<uint32_t>());
    const auto fields = in.number<uint8_t>();
    record.whole = fields != kHash;
    record.coded = fields == kCoded;
    record.hash = in.number<uint64_t>();
    record.data = in.bytes(in.left());
  } catch (const mcap::TooShort& problem) {
    return tl::make_unexpected(std::string(problem.what()));
  }
  return record;
}

tl::expected<void, std::string> uncode(MessageRecord& record, std::vector<std::byte>& plain) {
  if (!record.coded) return {};
  auto packed = plain_of(record.data);
  if (!packed) return tl::make_unexpected(packed.error());
  plain = std::move(*packed);
  record.data = plain;
  return {};
}

std::string layout_of(const MessageType& type) {
  std::string text =
      R"({"header": "u64 sequence, i64 stamp_ns, i64 published_ns, i64 visible_at_ns, i32 level, u8 whole, u64 xxh3",)"
      R"( "fields": [)";
  for (const Field& field : type.fields) {
    const size_t scalar = scalar_bytes(field.scalar);
    if (&field != type.fields.data()) text += ", ";
    text += R"({"name": ")" + std::string(field.name) + R"(", "unit": ")" + std::string(field.unit) +
            R"(", "scalar": ")" + std::string(name_of(field.scalar)) + R"(", )";
    // An array is its number of elements (u32) and the elements, each of some scalars.
    if (field.is_array())
      text +=
          R"("array_of": )" + std::to_string(field.element_bytes / scalar) + (field.text ? R"(, "text": true})" : "}");
    else text += R"("count": )" + std::to_string(field.count) + "}";
  }
  return text + "]}";
}

}  // namespace takt::record
