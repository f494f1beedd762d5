// SPDX-License-Identifier: Apache-2.0
#include "graph/world/specimen.hpp"

#include <cstring>

namespace takt::world {
namespace {

/// Scalars that say how large a picture is.
void set_size(const Field& field, std::byte* place, const Capacity& capacity) {
  if (field.scalar != Scalar::i32 || field.count != 1) return;
  const uint32_t size = field.name == "width"      ? capacity.width
                        : field.name == "height"   ? capacity.height
                        : field.name == "channels" ? capacity.channels
                                                   : 0;
  const auto number = static_cast<int32_t>(size);
  if (size > 0) std::memcpy(place, &number, sizeof number);
}

}  // namespace

AlignedBytes specimen(const MessageType& type, const Capacity& capacity) {
  AlignedBytes memory = aligned_bytes(type.bytes(capacity));
  type.place(memory.get(), capacity);
  for (const Field& field : type.fields) {
    std::byte* place = memory.get() + field.offset;
    if (!field.is_array()) {
      set_size(field, place, capacity);
      continue;
    }
    auto& array = *reinterpret_cast<Array<std::byte>*>(place);
    std::memset(array.data(), 0, size_t{array.capacity} * field.element_bytes);
    array.size = array.capacity;
  }
  if (!type.sound(memory.get())) type.place(memory.get(), capacity);
  return memory;
}

}  // namespace takt::world
