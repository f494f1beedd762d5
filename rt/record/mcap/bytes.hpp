// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/record/mcap/bytes.hpp>: record, experimental.
// Little-endian bytes of MCAP records: written into a buffer, read with every length checked.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace takt::mcap {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");

using Bytes = std::span<const std::byte>;
using Metadata = std::map<std::string, std::string>;

inline Bytes bytes_of(std::string_view text) { return std::as_bytes(std::span(text.data(), text.size())); }

class ByteWriter {
 public:
  explicit ByteWriter(std::vector<std::byte>& to) : to_(to) {}
  void bytes(Bytes data) {
    if (data.empty()) return;
    if (data.size() > kSmall) {  // an image need not be zeroed first
      to_.insert(to_.end(), data.begin(), data.end());
      return;
    }
    const size_t at = to_.size();
    to_.resize(at + data.size());
    std::memcpy(to_.data() + at, data.data(), data.size());
  }
  template <class T>
  void number(T value) {
    static_assert(std::is_unsigned_v<T>);
    bytes(std::as_bytes(std::span(&value, 1)));
  }
  void text(std::string_view text) {
    number(static_cast<uint32_t>(text.size()));
    bytes(bytes_of(text));
  }
  /// Fills in, as a Length, how many bytes were written after it.
  template <class Length, class Write>
  void counted(const Write& write) {
    const size_t at = to_.size();
    number(Length{0});
    write();
    const auto length = static_cast<Length>(to_.size() - at - sizeof(Length));
    std::memcpy(to_.data() + at, &length, sizeof length);
  }
  void metadata(const Metadata& map) {
    counted<uint32_t>([&] {
      for (const auto& [key, value] : map) text(key), text(value);
    });
  }

 private:
  static constexpr size_t kSmall = 1024;
  std::vector<std::byte>& to_;
};

/// What is read ends before it should.
struct TooShort : std::runtime_error {
  TooShort() : std::runtime_error("a record ends before its fields do") {}
};

/// Throws TooShort.
class ByteReader {
 public:
  explicit ByteReader(Bytes from) : rest_(from) {}
  size_t left() const { return rest_.size(); }
  Bytes bytes(uint64_t size) {
    if (size > rest_.size()) throw TooShort();
    const Bytes taken = rest_.first(static_cast<size_t>(size));
    rest_ = rest_.subspan(static_cast<size_t>(size));
    return taken;
  }
  template <class T>
  T number() {
    T value;
    std::memcpy(&value, bytes(sizeof value).data(), sizeof value);
    return value;
  }
  std::string text() {
    const Bytes data = bytes(number<uint32_t>());
    return {reinterpret_cast<const char*>(data.data()), data.size()};
  }
  Metadata metadata() {
    ByteReader entries(bytes(number<uint32_t>()));
    Metadata map;
    while (entries.left() > 0) {
      std::string key = entries.text();
      map[std::move(key)] = entries.text();
    }
    return map;
  }

 private:
  Bytes rest_;
};

}  // namespace takt::mcap
