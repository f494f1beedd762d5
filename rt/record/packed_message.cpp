// SPDX-License-Identifier: Apache-2.0
#include "rt/record/packed_message.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <utility>

#include "rt/msg/scalar.hpp"

namespace takt::record {
namespace {

static_assert(std::endian::native == std::endian::little, "scalars are copied as they lie in memory");

using Bytes = std::span<const std::byte>;

const Array<std::byte>& array_at(const void* message, const Field& field) {
  return any_array(static_cast<const std::byte*>(message) + field.offset);
}

uint64_t field_bytes(const void* message, const Field& field) {
  if (!field.is_array()) return uint64_t{field.count} * field.element_bytes;
  return sizeof(uint32_t) + uint64_t{array_at(message, field).size} * field.element_bytes;
}

std::string scalar_text(Scalar scalar, const std::byte* at) {
  return visit_scalar(scalar, at, [](auto value) {
    std::array<char, 32> text;  // the shortest that is read back as the same number
    const auto end = std::to_chars(text.data(), text.data() + text.size(), +value).ptr;
    return std::string(text.data(), end);
  });
}

/// The scalar at that byte of both, as text.
std::string values_at(const Field& field, Bytes reference, Bytes other, uint64_t scalar_at) {
  return scalar_text(field.scalar, other.data() + scalar_at) + " instead of " +
         scalar_text(field.scalar, reference.data() + scalar_at);
}

/// Walks two packed messages side by side.
class Comparison {
 public:
  Comparison(Bytes reference, Bytes other) : reference_(reference), other_(other) {}

  std::optional<Difference> field(const Field& field) {
    if (!field.is_array())
      return scalars(field, std::string(field.name), uint64_t{field.count} * field.element_bytes, field.count > 1);
    if (const auto ends = short_of(sizeof(uint32_t))) return difference(std::string(field.name) + ".size", *ends);
    const std::string name(field.name);
    const uint32_t size = count(reference_), others = count(other_);
    if (size != others)
      return Difference{name + ".size", at_, std::to_string(others) + " instead of " + std::to_string(size)};
    at_ += sizeof(uint32_t);
    return scalars(field, name, uint64_t{size} * field.element_bytes, true);
  }

  std::optional<Difference> rest() const {
    if (reference_.size() == other_.size()) return std::nullopt;
    return difference("length", at_);
  }

 private:
  uint32_t count(Bytes from) const {
    uint32_t value = 0;
    std::memcpy(&value, from.data() + at_, sizeof value);
    return value;
  }

  /// Where the shorter one ends, if it holds no `bytes` more.
  std::optional<uint64_t> short_of(uint64_t bytes) const {
    const uint64_t shorter = std::min(reference_.size(), other_.size());
    return shorter - at_ < bytes ? std::optional(shorter) : std::nullopt;
  }

  Difference difference(const std::string& what, uint64_t at) const {
    return {what, at, std::to_string(other_.size()) + " bytes instead of " + std::to_string(reference_.size())};
  }

  std::optional<Difference> scalars(const Field& field, const std::string& name, uint64_t bytes, bool indexed) {
    if (const auto ends = short_of(bytes)) return difference(name, *ends);
    const Bytes a = reference_.subspan(at_, bytes), b = other_.subspan(at_, bytes);
    const uint64_t from = std::exchange(at_, at_ + bytes);
    if (bytes == 0 || std::memcmp(a.data(), b.data(), bytes) == 0) return std::nullopt;
    const auto part = static_cast<uint64_t>(std::mismatch(a.begin(), a.end(), b.begin()).first - a.begin());
    const uint64_t scalar = part / scalar_bytes(field.scalar) * scalar_bytes(field.scalar);
    const std::string index = indexed ? "[" + std::to_string(part / field.element_bytes) + "]" : "";
    return Difference{name + index, from + part, values_at(field, a, b, scalar)};
  }

  Bytes reference_, other_;
  uint64_t at_ = 0;
};

}  // namespace

uint64_t packed_bytes(const MessageType& type, const void* message) {
  uint64_t bytes = 0;
  for (const Field& field : type.fields) bytes += field_bytes(message, field);
  return bytes;
}

void for_each_piece(const MessageType& type, const void* message, const std::function<void(Bytes)>& each) {
  for (const Field& field : type.fields) {
    if (!field.is_array()) {
      each({static_cast<const std::byte*>(message) + field.offset, size_t{field.count} * field.element_bytes});
      continue;
    }
    const Array<std::byte>& array = array_at(message, field);
    each(std::as_bytes(std::span(&array.size, 1)));
    each({array.data(), size_t{array.size} * field.element_bytes});
  }
}

void pack(const MessageType& type, const void* message, std::vector<std::byte>& to) {
  for_each_piece(type, message, [&](Bytes piece) { to.insert(to.end(), piece.begin(), piece.end()); });
}

tl::expected<void, std::string> unpack(const MessageType& type, Bytes packed, void* message) {
  uint64_t at = 0;
  const auto take = [&](void* to, uint64_t bytes) {
    if (packed.size() - at < bytes) return false;
    if (bytes > 0) std::memcpy(to, packed.data() + at, bytes);
    at += bytes;
    return true;
  };
  const auto wrong = [&](const Field& field, const std::string& what) {
    return tl::unexpected(std::string(type.name) + "." + std::string(field.name) + " " + what);
  };
  for (const Field& field : type.fields) {
    auto* place = static_cast<std::byte*>(message) + field.offset;
    if (!field.is_array()) {
      if (!take(place, uint64_t{field.count} * field.element_bytes)) return wrong(field, "is cut off");
      continue;
    }
    auto& array = *reinterpret_cast<Array<std::byte>*>(place);
    uint32_t size = 0;
    if (!take(&size, sizeof size)) return wrong(field, "is cut off");
    if (size > array.capacity)
      return wrong(
          field, "has " + std::to_string(size) + " elements, and there is room for " + std::to_string(array.capacity));
    if (!take(array.data(), uint64_t{size} * field.element_bytes)) return wrong(field, "is cut off");
    array.size = size;
  }
  if (at != packed.size())
    return tl::unexpected(std::string(type.name) + ": " + std::to_string(packed.size() - at) + " bytes too many");
  return {};
}

std::optional<Difference> first_difference(std::span<const Field> fields, Bytes reference, Bytes other) {
  Comparison comparison(reference, other);
  for (const Field& field : fields)
    if (auto found = comparison.field(field)) return found;
  return comparison.rest();
}

}  // namespace takt::record
