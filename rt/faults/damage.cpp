// SPDX-License-Identifier: Apache-2.0
#include "rt/faults/damage.hpp"

#include <algorithm>
#include <cstring>

#include "rt/faults/message_fault.hpp"
#include "rt/msg/scalar.hpp"

namespace takt::faults {
namespace {

constexpr uint64_t kBytesPerFlip = 64;

Array<std::byte>& array_at(void* message, const Field& field) {
  return *reinterpret_cast<Array<std::byte>*>(static_cast<std::byte*>(message) + field.offset);
}

bool is_real(Scalar scalar) { return scalar == Scalar::f32 || scalar == Scalar::f64; }

bool has_arrays(const MessageType& type) {
  return std::any_of(type.fields.begin(), type.fields.end(), [](const Field& field) { return field.is_array(); });
}

/// Flips one bit in each stretch of kBytesPerFlip bytes, at a place that the seed chooses.
void flip(std::byte* bytes, uint64_t count, uint64_t seed) {
  for (uint64_t from = 0; from < count; from += kBytesPerFlip) {
    const uint64_t chosen = mixed(seed, from, 0);
    const uint64_t at = from + (chosen >> 8) % std::min(kBytesPerFlip, count - from);
    bytes[at] ^= static_cast<std::byte>(1U << (chosen & 7));
  }
}

}  // namespace

bool corrupt(const MessageType& type, void* message, uint64_t seed) {
  const bool whole_numbers = !has_arrays(type);
  bool changed = false;
  for (const Field& field : type.fields) {
    auto* at = static_cast<std::byte*>(message) + field.offset;
    uint64_t bytes = uint64_t{field.count} * field.element_bytes;
    if (field.is_array()) {
      Array<std::byte>& array = array_at(message, field);
      bytes = uint64_t{array.size} * field.element_bytes;
      at = reinterpret_cast<std::byte*>(&array) + array.offset;
    } else if (!whole_numbers && !is_real(field.scalar)) {
      continue;
    }
    if (bytes == 0) continue;
    flip(at, bytes, mixed(seed, field.offset, 1));
    changed = true;
  }
  return changed;
}

bool truncate(const MessageType& type, void* message, uint64_t seed) {
  bool changed = false;
  for (const Field& field : type.fields) {
    if (!field.is_array()) continue;
    Array<std::byte>& array = array_at(message, field);
    if (array.size == 0) continue;
    array.size = static_cast<uint32_t>(mixed(seed, field.offset, 2) % array.size);
    changed = true;
  }
  return changed;
}

void copy_used(const MessageType& type, const void* from, void* to) {
  std::memcpy(to, from, type.header_bytes);  // offsets of arrays count from themselves: the same in both
  for (const Field& field : type.fields) {
    if (!field.is_array()) continue;
    const auto* source = static_cast<const std::byte*>(from) + field.offset;
    auto* target = static_cast<std::byte*>(to) + field.offset;
    const Array<std::byte>& array = any_array(source);
    std::memcpy(target + array.offset, source + array.offset, uint64_t{array.size} * field.element_bytes);
  }
}

}  // namespace takt::faults
