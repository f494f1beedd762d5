// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/message_text.hpp"

#include <algorithm>
#include <cstring>

#include "rt/msg/scalar.hpp"

namespace takt::attach {
namespace {

using Json = nlohmann::ordered_json;

Json scalars(Scalar scalar, const std::byte* at, size_t count) {
  const auto value_at = [&](size_t i) {
    return visit_scalar(scalar, at + i * scalar_bytes(scalar), [](auto value) { return Json(value); });
  };
  if (count == 1) return value_at(0);
  Json list = Json::array();
  for (size_t i = 0; i < count; ++i) list.push_back(value_at(i));
  return list;
}

/// An array of `size` elements.
Json array_json(const Field& field, const std::byte* data, size_t size, size_t items) {
  if (field.text) return std::string(reinterpret_cast<const char*>(data), size);
  Json first = Json::array();
  const size_t bytes = field.element_bytes;
  for (size_t i = 0; i < std::min(size, items); ++i)
    first.push_back(scalars(field.scalar, data + i * bytes, bytes / scalar_bytes(field.scalar)));
  return {{"size", size}, {"first", first}};
}

}  // namespace

nlohmann::ordered_json message_json(const MessageType& type, const void* message, size_t items) {
  Json json;
  const auto* bytes = static_cast<const std::byte*>(message);
  for (const Field& field : type.fields) {
    const std::string name(field.name);
    if (!field.is_array()) {
      json[name] = scalars(field.scalar, bytes + field.offset, field.count);
    } else {
      const Array<std::byte>& array = any_array(bytes + field.offset);
      json[name] = array_json(field, array.data(), array.size, items);
    }
  }
  return json;
}

tl::expected<nlohmann::ordered_json, std::string> packed_json(std::span<const Field> fields,
                                                              std::span<const std::byte> packed, size_t items) {
  Json json;
  size_t at = 0;
  for (const Field& field : fields) {
    uint32_t count = field.count;
    if (field.is_array()) {
      if (packed.size() - at < sizeof count) return tl::make_unexpected(std::string(field.name) + " is cut off");
      std::memcpy(&count, packed.data() + at, sizeof count);
      at += sizeof count;
    }
    const size_t bytes = size_t{count} * field.element_bytes;
    if (packed.size() - at < bytes) return tl::make_unexpected(std::string(field.name) + " is cut off");
    const std::byte* data = packed.data() + at;
    json[std::string(field.name)] =
        field.is_array() ? array_json(field, data, count, items) : scalars(field.scalar, data, count);
    at += bytes;
  }
  if (at != packed.size()) return tl::make_unexpected(std::to_string(packed.size() - at) + " bytes too many");
  return json;
}

}  // namespace takt::attach
