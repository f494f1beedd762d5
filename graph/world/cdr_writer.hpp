// SPDX-License-Identifier: Apache-2.0
// Plain CDR, little-endian, as DDS and ROS 2 write a message (XCDR version 1): a header of four bytes, then values,
// each aligned to its own size as counted from behind the header.
//
//   CdrWriter counted({});                       // writes nothing: how many bytes are needed
//   write(counted, message);
//   std::vector<std::byte> bytes(counted.bytes());
//   CdrWriter writer(bytes);
//   write(writer, message);
//   if (!writer.complete()) ...                  // a sequence too long for CDR
//
// Never writes behind the end of what it was given, never throws, never allocates.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

namespace takt::world {

class CdrWriter {
 public:
  static constexpr size_t kHeaderBytes = 4;

  explicit CdrWriter(std::span<std::byte> to);

  /// A bool, an integer or a floating-point number.
  template <class T>
  requires std::is_arithmetic_v<T>
  void number(T value) {
    if (std::byte* at = take(1, sizeof value)) std::memcpy(at, &value, sizeof value);
  }
  /// Up to its first 0, which ends a text of CDR.
  void text(std::string_view text);
  /// Of the elements that follow, before a sequence.
  void count(size_t elements);
  /// Numbers of `bytes_each`, one after the other.
  void numbers(const void* from, size_t elements, size_t bytes_each);
  /// Room for these, aligned. Null: there is none, or they are only counted; the caller then writes nothing.
  std::byte* take(size_t elements, size_t bytes_each);

  /// That the message needs, the header included.
  size_t bytes() const { return at_; }
  /// Whether all of it was written.
  bool complete() const { return !refused_ && at_ <= to_.size(); }

 private:
  std::span<std::byte> to_;
  size_t at_ = 0;
  bool refused_ = false;  ///< a number of elements that CDR cannot state
};

}  // namespace takt::world
