// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/field.hpp"

#include "rt/msg/layout.hpp"

namespace takt {
namespace {

constexpr uint64_t kAlignment = 64;
uint64_t align(uint64_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }

/// Calls visit(field, element capacity, offset in the message) for each array; returns the total bytes.
template <class Visit>
uint64_t walk(const MessageType& type, const ArrayCounts& counts, Visit visit) {
  uint64_t at = align(type.header_bytes);
  size_t index = 0;
  for (const Field& field : type.fields) {
    if (!field.is_array()) continue;
    visit(field, counts[index], at);
    at = align(at + uint64_t{counts[index]} * field.element_bytes);
    ++index;
  }
  return at;
}

}  // namespace

ArrayCounts counts_of(const MessageType& type, const Capacity& capacity) {
  ArrayCounts counts{};
  type.capacities(capacity, counts);
  return counts;
}

uint64_t bytes_of(const MessageType& type, const ArrayCounts& counts) {
  return walk(type, counts, [](const Field&, uint32_t, uint64_t) {});
}

bool intact(const MessageType& type, const void* message, const ArrayCounts& counts) {
  const auto* base = static_cast<const std::byte*>(message);
  bool whole = true;
  walk(type, counts, [&](const Field& field, uint32_t count, uint64_t at) {
    const auto* array = reinterpret_cast<const Array<std::byte>*>(base + field.offset);
    whole = whole && array->offset == at - field.offset && array->size <= count && array->capacity == count;
  });
  return whole;
}

uint64_t MessageType::bytes(const Capacity& capacity) const { return bytes_of(*this, counts_of(*this, capacity)); }

void MessageType::place(void* memory, const Capacity& capacity) const {
  construct(memory);
  auto* base = static_cast<std::byte*>(memory);
  walk(*this, counts_of(*this, capacity), [&](const Field& field, uint32_t count, uint64_t at) {
    auto* array = reinterpret_cast<Array<std::byte>*>(base + field.offset);
    array->offset = static_cast<uint32_t>(at - field.offset);
    array->size = 0;
    array->capacity = count;
  });
}

bool MessageType::intact(const void* memory, const Capacity& capacity) const {
  return takt::intact(*this, memory, counts_of(*this, capacity)) && sound(memory);
}

}  // namespace takt
