// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/array.hpp>: core, stable.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace takt {

/// A variable-length run of elements inside a message. The elements live behind the message header in the same
/// shared-memory chunk; `offset` counts from the address of the Array itself, so that the message means the same in
/// every process that maps the chunk. An Array must therefore never be copied out of its message.
/// `capacity` is fixed by the graph before start; `size` is what this message uses.
template <class T>
struct Array {
  static_assert(std::is_trivially_copyable_v<T>);
  uint32_t offset = 0;
  uint32_t size = 0;
  uint32_t capacity = 0;

  Array() = default;
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;

  T* data() { return reinterpret_cast<T*>(reinterpret_cast<std::byte*>(this) + offset); }
  const T* data() const { return reinterpret_cast<const T*>(reinterpret_cast<const std::byte*>(this) + offset); }
  std::span<T> items() { return {data(), size}; }
  std::span<const T> items() const { return {data(), size}; }
  T& operator[](size_t i) { return data()[i]; }
  const T& operator[](size_t i) const { return data()[i]; }
  bool empty() const { return size == 0; }

  /// Sets the used size, at most `capacity`; returns false (and uses the capacity) if more was asked for.
  bool resize(size_t wanted) {
    const bool fits = wanted <= capacity;
    size = fits ? static_cast<uint32_t>(wanted) : capacity;
    return fits;
  }
  /// Appends one element; false if the array is full.
  bool push_back(const T& value) {
    if (size == capacity) return false;
    data()[size++] = value;
    return true;
  }
};

}  // namespace takt
