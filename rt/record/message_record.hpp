// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/record/message_record.hpp>: record, experimental.
// A message of a port as a record keeps it: its header, and either all its fields or a hash of them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/record/packed_message.hpp"
#include "rt/shm/transport.hpp"

namespace takt::record {

class PictureCoder;  // rt/record/picture_codec.hpp

struct MessageRecord {
  uint64_t sequence = 0;
  int64_t stamp_ns = 0, published_ns = 0, visible_at_ns = 0;
  int32_t level = 0;
  bool whole = true;                ///< the fields are there; else only their hash
  bool coded = false;               ///< ... with pictures as JPEG (plain_of()), so that they need not have that hash
  uint64_t hash = 0;                ///< of the packed fields (XXH3, 64 bits)
  std::span<const std::byte> data;  ///< the packed fields, empty if not whole
};

/// Hash of the bytes that pack() gives for a message.
uint64_t hash_of(std::span<const std::byte> packed);

/// Appends header, hash and, if `whole`, fields of a message that is held.
void pack(const MessageType& type, const Held& held, bool whole, std::vector<std::byte>& to);
/// Appends the same message with its pictures as JPEG; one that has only a hash as it is.
void code(const MessageType& type, std::span<const std::byte> message, PictureCoder& coder, std::vector<std::byte>& to);
/// `data` points into `packed`. Error: too short.
tl::expected<MessageRecord, std::string> unpack_message(std::span<const std::byte> packed);
/// Where its pictures are JPEG, `data` points into `plain` afterwards, to packed fields; `coded` stays. Error: damaged.
tl::expected<void, std::string> uncode(MessageRecord& record, std::vector<std::byte>& plain);

/// The fields of the type as JSON text: name, unit, scalar, number of elements, whether it is text; so that a record
/// can be read without this program.
std::string layout_of(const MessageType& type);

}  // namespace takt::record
