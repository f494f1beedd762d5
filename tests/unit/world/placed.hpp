// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstring>

#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/field.hpp"

namespace takt::test {

/// An empty message with room for so much.
template <class T>
struct Placed {
  explicit Placed(const Capacity& capacity) : memory(aligned_bytes(MessageType::of<T>().bytes(capacity))) {
    std::memset(memory.get(), 0, MessageType::of<T>().bytes(capacity));
    MessageType::of<T>().place(memory.get(), capacity);
  }
  T* operator->() { return reinterpret_cast<T*>(memory.get()); }
  const void* get() const { return memory.get(); }
  AlignedBytes memory;
};

}  // namespace takt::test
