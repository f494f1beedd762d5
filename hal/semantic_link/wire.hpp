// SPDX-License-Identifier: Apache-2.0
// Plain values as bytes, one after the other, little-endian, without padding.
#pragma once
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace takt::semantic_link {

static_assert(std::endian::native == std::endian::little, "values are copied as they lie in memory");

template <class T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T> || std::is_array_v<T>;

/// The caller has made sure of the room.
class WireWriter {
 public:
  explicit WireWriter(std::span<uint8_t> into) : into_(into) {}
  template <Plain... T>
  void put(const T&... values) {
    (put_bytes({reinterpret_cast<const uint8_t*>(&values), sizeof values}), ...);
  }
  void put_bytes(std::span<const uint8_t> bytes) {
    if (!bytes.empty()) std::memcpy(into_.data() + size_, bytes.data(), bytes.size());
    size_ += bytes.size();
  }
  size_t size() const { return size_; }
  std::span<const uint8_t> written() const { return into_.first(size_); }

 private:
  std::span<uint8_t> into_;
  size_t size_ = 0;
};

class WireReader {
 public:
  explicit WireReader(std::span<const uint8_t> from) : rest_(from) {}
  /// False if the bytes end before the last value does.
  template <Plain... T>
  bool get(T&... values) {
    return (get_one(values) && ...);
  }
  std::span<const uint8_t> rest() const { return rest_; }

 private:
  template <class T>
  bool get_one(T& value) {
    if (rest_.size() < sizeof value) return false;
    std::memcpy(&value, rest_.data(), sizeof value);
    rest_ = rest_.subspan(sizeof value);
    return true;
  }
  std::span<const uint8_t> rest_;
};

}  // namespace takt::semantic_link
