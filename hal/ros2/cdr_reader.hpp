// SPDX-License-Identifier: Apache-2.0
// Plain CDR from strangers, of either byte order. Every read is checked: what goes beyond the bytes, or beyond what the
// caller allows, makes the reader not ok(), and all that is read from then on 0 or empty.
//
//   CdrReader reader(bytes);
//   const auto stamp = reader.number<int32_t>();
//   const std::string_view frame = reader.text(64);   // at most so many characters
//   if (!reader.ok()) ...
//
// Never throws, never allocates. What it gives points into the bytes.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

namespace takt::ros2 {

class CdrReader {
 public:
  explicit CdrReader(std::span<const std::byte> bytes) {
    ok_ = bytes.size() >= kHeaderBytes && bytes[0] == std::byte{0} && bytes[1] <= std::byte{1};
    if (!ok_) return;
    swaps_ = bytes[1] == std::byte{0};  // CDR_BE; this machine is little-endian
    bytes_ = bytes.subspan(kHeaderBytes);
  }
  bool ok() const { return ok_; }
  /// Behind all that was read; the protocol fills up to whole words.
  bool at_end() const { return ok_ && bytes_.size() - at_ < kHeaderBytes; }

  template <class T>
  requires std::is_arithmetic_v<T> T number() {
    const std::span<const std::byte> piece = take(1, sizeof(T));
    return piece.empty() ? T{} : value<T>(piece.data());
  }
  /// Without its 0 at the end.
  std::string_view text(size_t most) {
    const auto size = number<uint32_t>();
    if (size == 0 || size - 1 > most) return fail(), std::string_view();
    const std::span<const std::byte> piece = take(size, 1);
    if (piece.empty() || piece.back() != std::byte{0}) return fail(), std::string_view();
    return {reinterpret_cast<const char*>(piece.data()), size - 1};
  }
  /// How many elements of a sequence follow.
  size_t count(size_t most) {
    const auto size = number<uint32_t>();
    if (size > most) fail();
    return ok_ ? size : 0;
  }
  /// The elements of a sequence of numbers; `to` is as large as count() allowed.
  template <class T>
  void numbers(size_t count, std::span<T> to) {
    const std::span<const std::byte> piece = take(count, sizeof(T));
    for (size_t i = 0; i < std::min(count, to.size()); ++i)
      to[i] = piece.empty() ? T{} : value<T>(piece.data() + i * sizeof(T));
  }
  /// Those of bytes, where they lie.
  std::span<const std::byte> bytes(size_t count) { return take(count, 1); }

 private:
  static constexpr size_t kHeaderBytes = 4;
  void fail() { ok_ = false; }
  std::span<const std::byte> take(size_t count, size_t bytes_each) {
    if (!ok_ || count == 0) return {};
    const size_t from = (at_ + bytes_each - 1) / bytes_each * bytes_each;
    if (from > bytes_.size() || count > (bytes_.size() - from) / bytes_each)
      return fail(), std::span<const std::byte>();
    at_ = from + count * bytes_each;
    return bytes_.subspan(from, count * bytes_each);
  }
  template <class T>
  T value(const std::byte* from) const {
    std::array<std::byte, sizeof(T)> raw;
    std::memcpy(raw.data(), from, sizeof(T));
    if (swaps_) std::reverse(raw.begin(), raw.end());
    T number;
    std::memcpy(&number, raw.data(), sizeof(T));
    return number;
  }
  std::span<const std::byte> bytes_;
  size_t at_ = 0;
  bool ok_ = false, swaps_ = false;
};

}  // namespace takt::ros2
