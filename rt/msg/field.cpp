// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/field.hpp"

#include <array>

namespace takt {
namespace {

constexpr uint64_t kAlignment = 64;
constexpr size_t kMaxArrays = 16;
uint64_t align(uint64_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }

/// Calls visit(field, element capacity, offset in the message) for each array; returns the total bytes.
template <class Visit>
uint64_t walk(const MessageType& type, const Capacity& capacity, Visit visit) {
  std::array<uint32_t, kMaxArrays> counts{};
  type.capacities(capacity, counts);
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

uint64_t MessageType::bytes(const Capacity& capacity) const {
  return walk(*this, capacity, [](const Field&, uint32_t, uint64_t) {});
}

void MessageType::place(void* memory, const Capacity& capacity) const {
  construct(memory);
  auto* base = static_cast<std::byte*>(memory);
  walk(*this, capacity, [&](const Field& field, uint32_t count, uint64_t at) {
    auto* array = reinterpret_cast<Array<std::byte>*>(base + field.offset);
    array->offset = static_cast<uint32_t>(at - field.offset);
    array->size = 0;
    array->capacity = count;
  });
}

bool MessageType::intact(const void* memory, const Capacity& capacity) const {
  const auto* base = static_cast<const std::byte*>(memory);
  bool whole = true;
  walk(*this, capacity, [&](const Field& field, uint32_t count, uint64_t at) {
    const auto* array = reinterpret_cast<const Array<std::byte>*>(base + field.offset);
    whole = whole && array->offset == at - field.offset && array->size <= count && array->capacity == count;
  });
  return whole && sound(memory);
}

}  // namespace takt
