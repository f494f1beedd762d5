// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "graph/attach/message_text.hpp"
#include "graph/log/export_forms.hpp"
#include "graph/view/markup.hpp"
#include "graph/world/shown.hpp"
#include "hal/settings/json.hpp"
#include "rt/msg/scalar.hpp"

namespace takt::log {
namespace {

using Json = nlohmann::ordered_json;
using world::Packed;
using world::Schema;
namespace detail = world::detail;

/// As Foxglove's JSON names a member that ROS 2 names in small letters.
template <class S>
std::string json_name(std::string_view name) {
  if constexpr (std::is_same_v<S, world::Time> || std::is_same_v<S, world::Duration>)
    return name == "nanosec" ? "nsec" : std::string(name);
  if constexpr (std::is_same_v<S, world::CameraCalibration>)
    if (name.size() == 1) return {static_cast<char>(name[0] - 'a' + 'A')};
  return std::string(name);
}

Json base64(std::string_view bytes) { return view::base64(bytes); }

template <class T>
Json json_of(const T& value) {
  if constexpr (std::is_arithmetic_v<T>) return value;
  else if constexpr (std::is_same_v<T, std::string_view>) return std::string(value);
  else if constexpr (Schema<T>) {
    Json json = Json::object();
    world::for_each_member(
        value, [&](std::string_view name, const auto& member) { json[json_name<T>(name)] = json_of(member); });
    return json;
  } else if constexpr (Packed<T>) {
    std::vector<typename T::Element> elements(value.size());
    value.fill(reinterpret_cast<std::byte*>(elements.data()));
    return json_of(std::span<const typename T::Element>(elements));
  } else if constexpr (std::is_same_v<T, std::span<const uint8_t>>) {
    return base64({reinterpret_cast<const char*>(value.data()), value.size()});
  } else {
    Json list = Json::array();
    for (const auto& element : value) list.push_back(json_of(element));
    return list;
  }
}

Json number_schema(bool is_real) { return {{"type", is_real ? "number" : "integer"}}; }
Json list_schema(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

/// JSON Schema of what json_of() makes of a T.
template <class T>
Json json_schema() {
  if constexpr (std::is_same_v<T, bool>) return {{"type", "boolean"}};
  else if constexpr (std::is_arithmetic_v<T>) return number_schema(std::is_floating_point_v<T>);
  else if constexpr (std::is_same_v<T, std::string_view>) return {{"type", "string"}};
  else if constexpr (Schema<T>) {
    Json properties = Json::object();
    world::for_each_member(
        T{}, [&]<class M>(std::string_view name, const M&) { properties[json_name<T>(name)] = json_schema<M>(); });
    return {{"type", "object"}, {"properties", properties}};
  } else if constexpr (detail::Fixed<T>::value) return list_schema(json_schema<typename detail::Fixed<T>::Element>());
  else if constexpr (Packed<T>) return json_schema<std::span<const typename T::Element>>();
  else if constexpr (std::is_same_v<T, std::span<const uint8_t>>)
    return {{"type", "string"}, {"contentEncoding", "base64"}};
  else return list_schema(json_schema<typename detail::Sequence<T>::Element>());
}

std::vector<std::byte> text_bytes(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);  // a text may be no UTF-8
  const auto* from = reinterpret_cast<const std::byte*>(text.data());
  return {from, from + text.size()};
}

std::string titled(Json schema, const std::string& name) {
  schema["title"] = name;
  return schema.dump();
}

template <Schema S>
ExportForm form_of(const std::string& topic, const S& value) {
  const std::string name = "foxglove" + std::string(S::schema_name.substr(S::schema_name.find('/')));
  ExportForm form{topic, name, {}, text_bytes(json_of(value))};
  form.schema[std::string_view("foxglove").size()] = '.';
  form.definition = [name = form.schema] { return titled(json_schema<S>(), name); };
  return form;
}

struct JsonSink {
  std::vector<ExportForm> forms;
  bool wants(const std::string&, std::string_view) const { return true; }
  template <Schema S>
  void take(const std::string& topic, const S& value) {
    forms.push_back(form_of(topic, value));
  }
};

Json scalars_schema(Scalar scalar, size_t count) {
  const Json one = number_schema(scalar == Scalar::f32 || scalar == Scalar::f64);
  return count == 1 ? one : list_schema(one);
}

/// JSON Schema of what packed_json() makes of a field.
Json field_schema(const Field& field) {
  if (field.text) return {{"type", "string"}};
  if (!field.is_array()) return scalars_schema(field.scalar, field.count);
  const Json first = list_schema(scalars_schema(field.scalar, field.element_bytes / scalar_bytes(field.scalar)));
  return {{"type", "object"}, {"properties", {{"size", {{"type", "integer"}}}, {"first", first}}}};
}

/// JSON Schema of messages that are shown by their own fields. Units are the descriptions.
std::string own_schema(const FieldsOf& type, const std::string& name) {
  Json properties = Json::object();
  for (const Field& field : type.fields) {
    Json& schema = properties[std::string(field.name)] = field_schema(field);
    if (!field.unit.empty()) schema["description"] = field.unit;
  }
  if (!properties.contains("timestamp")) properties["timestamp"] = json_schema<world::Time>();
  return titled({{"type", "object"}, {"properties", properties}}, name);
}

class JsonEncoding final : public ExportEncoding {
 public:
  std::string of_messages() const override { return "json"; }
  std::string of_schemas() const override { return "jsonschema"; }
  Shown shown(const MessageType& type, const void* message, std::string_view node, int64_t stamp_ns) const override {
    JsonSink sink;
    world::Shown<JsonSink> viewer(sink, node, stamp_ns, 0);
    type.show(message, viewer);
    return {std::move(sink.forms), viewer.fields_say_more()};
  }
  tl::expected<ExportForm, std::string> by_fields(const FieldsOf& type, std::span<const std::byte> packed,
                                                  int64_t stamp_ns) const override {
    auto json = attach::packed_json(type.fields, packed, SIZE_MAX);
    if (!json) return tl::make_unexpected(json.error());
    if (!json->contains("timestamp")) (*json)["timestamp"] = json_of(world::time_of(stamp_ns));
    const std::string name = "takt." + std::string(type.type_name);
    return ExportForm{"", name, [type, name] { return own_schema(type, name); }, text_bytes(*json)};
  }
  ExportForm log(int64_t at_ns, std::string_view name, std::string_view text, LogLevel level) const override {
    return form_of("", world::Log{world::time_of(at_ns), world::number_of(level), text, name, "", 0});
  }
};

}  // namespace

const ExportEncoding& json_encoding() {
  static const JsonEncoding encoding;
  return encoding;
}

}  // namespace takt::log
