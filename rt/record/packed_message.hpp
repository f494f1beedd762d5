// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/record/packed_message.hpp>: record, experimental.
// A message as the bytes that a record holds: its fields one after the other as the descriptors list them, without
// padding and without the unused part of its arrays. Little-endian. A field is its scalars; an array is its number of
// elements (u32) and the elements. So equal messages have equal bytes wherever they lay.
#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/msg/field.hpp"

namespace takt::record {

/// Bytes that pack() appends for this message.
uint64_t packed_bytes(const MessageType& type, const void* message);

/// The packed bytes piece by piece, in their order, where they lie.
void for_each_piece(const MessageType& type, const void* message,
                    const std::function<void(std::span<const std::byte>)>& each);

/// Appends the message. No allocation if `to` has room for packed_bytes().
void pack(const MessageType& type, const void* message, std::vector<std::byte>& to);

/// Fills a placed message (MessageType::place). Error: bytes of another length, or an array larger than its capacity;
/// the message is then of no use.
tl::expected<void, std::string> unpack(const MessageType& type, std::span<const std::byte> packed, void* message);

/// Where two packed messages of one type part.
struct Difference {
  std::string field;   ///< with the element's index for arrays: "points[17]", "points.size"
  uint64_t byte = 0;   ///< index into the packed bytes
  std::string values;  ///< "0.25 instead of 0.5"
};

/// `fields`: those of the type, their offsets do not matter. Nothing: the same bytes. `other` is told against
/// `reference`; bytes that are no message of the type differ in the field in which they end.
std::optional<Difference> first_difference(std::span<const Field> fields, std::span<const std::byte> reference,
                                           std::span<const std::byte> other);

}  // namespace takt::record
