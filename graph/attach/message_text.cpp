// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/message_text.hpp"

#include <algorithm>

#include "rt/msg/robot_task.hpp"
#include "rt/msg/scalar.hpp"
#include "rt/msg/text_status.hpp"

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

Json array_json(const Field& field, const std::byte* at, size_t element_bytes, size_t items) {
  const Array<std::byte>& array = any_array(at);
  const std::byte* data = array.data();
  Json first = Json::array();
  for (size_t i = 0; i < std::min<size_t>(array.size, items); ++i)
    first.push_back(scalars(field.scalar, data + i * element_bytes, element_bytes / scalar_bytes(field.scalar)));
  return {{"size", array.size}, {"first", first}};
}

}  // namespace

nlohmann::ordered_json message_json(const MessageType& type, const void* message, size_t items) {
  Json json;
  const auto* bytes = static_cast<const std::byte*>(message);
  for (const Field& field : type.fields) {
    const std::string name(field.name);
    if (!field.is_array()) {
      json[name] = scalars(field.scalar, bytes + field.offset, field.count);
    } else if (type.name == TextStatus::type_name || type.name == RobotTask::type_name) {
      const auto& text = *reinterpret_cast<const Array<char>*>(bytes + field.offset);
      json[name] = std::string(text.data(), text.size);
    } else {
      json[name] = array_json(field, bytes + field.offset, field.element_bytes, items);
    }
  }
  return json;
}

}  // namespace takt::attach
