// SPDX-License-Identifier: Apache-2.0
#include "graph/log/export_log.hpp"

#include <functional>
#include <map>

#include "graph/attach/message_text.hpp"
#include "graph/log/foxglove.hpp"
#include "graph/log/recorded_type.hpp"
#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/node_state.hpp"
#include "rt/msg/scalar.hpp"
#include "rt/record/mcap/writer.hpp"
#include "rt/record/recorder.hpp"

namespace takt::log {
namespace {

Json scalars_schema(Scalar scalar, size_t count) {
  const Json one{{"type", scalar == Scalar::f32 || scalar == Scalar::f64 ? "number" : "integer"}};
  if (count == 1) return one;
  return {{"type", "array"}, {"items", one}};
}

/// JSON Schema of what packed_json() makes of a field.
Json field_schema(const Field& field) {
  if (field.text) return {{"type", "string"}};
  if (!field.is_array()) return scalars_schema(field.scalar, field.count);
  const Json element = scalars_schema(field.scalar, field.element_bytes / scalar_bytes(field.scalar));
  const Json first{{"type", "array"}, {"items", element}};
  return {{"type", "object"}, {"properties", {{"size", {{"type", "integer"}}}, {"first", first}}}};
}

/// JSON Schema of messages that are shown by their own fields. Units are the descriptions.
Json own_schema(const RecordedType& type) {
  const Json whole{{"type", "integer"}};
  Json properties = Json::object();
  for (const Field& field : type.fields()) {
    Json& schema = properties[std::string(field.name)] = field_schema(field);
    if (!field.unit.empty()) schema["description"] = field.unit;
  }
  if (!properties.contains("timestamp"))
    properties["timestamp"] = {{"type", "object"}, {"properties", {{"sec", whole}, {"nsec", whole}}}};
  return {{"type", "object"}, {"properties", properties}};
}

/// JSON Schema of a message, from one.
Json schema_from(const Json& value, const std::string& name = "") {
  if (value.is_object()) {
    Json properties = Json::object();
    for (const auto& [key, member] : value.items()) properties[key] = schema_from(member, key);
    return {{"type", "object"}, {"properties", properties}};
  }
  if (value.is_array()) {
    Json schema{{"type", "array"}};
    schema["items"] = value.empty() ? Json{{"type", "number"}} : schema_from(value.front());
    return schema;
  }
  if (value.is_string() && name == "data") return {{"type", "string"}, {"contentEncoding", "base64"}};
  if (value.is_string()) return {{"type", "string"}};
  return {{"type", value.is_number_integer() ? "integer" : "number"}};
}

class Export {
 public:
  Export(record::LogFile& log, const graph::MessageTypes& types, mcap::Sink& sink)
      : log_(log), types_(types), file_(sink, {}) {}

  tl::expected<Exported, std::string> run() {
    const auto text = log_.attached("plan.json");
    const Json plan = text ? Json::parse(*text, nullptr, false) : Json();
    if (!plan.is_object() || !plan.contains("ports")) return tl::make_unexpected("the record does not hold its plan");
    keep(file_.begin("", "takt log export"));
    for (size_t p = 0; p < plan["ports"].size(); ++p) {
      const std::string port = plan["ports"][p].value("name", "");
      if (const mcap::Channel* channel = channel_of(log_, port)) export_port(*channel, capacity_of(plan, p));
    }
    export_events(plan);
    keep(file_.finish());
    if (!refused_.empty()) return tl::make_unexpected(refused_);
    result_.bytes = file_.written_bytes();
    return result_;
  }

 private:
  void export_port(const mcap::Channel& channel, const Capacity& capacity) {
    const auto type = type_of(log_, channel);
    if (type && type->name() == NodeState::type_name) {
      result_.states += log_.messages(channel.id).size();
      return;
    }
    const MessageType* shown = type ? shown_type(*type) : nullptr;
    if (type && shown == nullptr) result_.own_fields.insert(type->name());
    const AlignedBytes memory = aligned_bytes(shown != nullptr ? shown->bytes(capacity) : 0);
    for (const auto& [sequence, there] : log_.messages(channel.id)) {
      if (!there.whole) {
        ++result_.hash_only;
        continue;
      }
      const auto message = log_.message(channel.id, sequence);
      const auto written = !message           ? tl::make_unexpected(std::string("it cannot be read"))
                           : !type            ? tl::make_unexpected(type.error())
                           : shown != nullptr ? export_shown(*shown, channel.topic, capacity, memory.get(), *message)
                                              : export_own_fields(*type, channel.topic, *message);
      if (!written) unreadable(channel.topic, written.error());
    }
  }

  /// Null: messages of this type, as the record describes it, are shown by their own fields.
  const MessageType* shown_type(const RecordedType& recorded) const {
    const auto known = types_.find(recorded.name());
    return known != types_.end() && known->second->show != nullptr && recorded.is(*known->second) ? known->second
                                                                                                  : nullptr;
  }

  tl::expected<void, std::string> export_shown(const MessageType& type, const std::string& port,
                                               const Capacity& capacity, void* memory,
                                               const record::MessageRecord& message) {
    type.place(memory, capacity);
    if (const auto filled = record::unpack(type, message.data, memory); !filled) return filled;
    if (!type.sound(memory)) return tl::make_unexpected(std::string("its fields say more than its arrays hold"));
    FoxgloveViewer viewer(port.substr(0, port.find('.')), message.stamp_ns);
    type.show(memory, viewer);
    for (const FoxgloveViewer::Form& form : viewer.forms)
      write(form.schema, form.topic.starts_with("/") ? form.topic : port + form.topic, message, form.json,
            [&] { return schema_from(form.json); });
    return {};
  }

  tl::expected<void, std::string> export_own_fields(const RecordedType& type, const std::string& port,
                                                    const record::MessageRecord& message) {
    auto json = attach::packed_json(type.fields(), message.data, SIZE_MAX);
    if (!json) return tl::make_unexpected(json.error());
    if (!json->contains("timestamp")) (*json)["timestamp"] = time_json(message.stamp_ns);
    write("takt." + type.name(), port, message, *json, [&] { return own_schema(type); });
    return {};
  }

  void unreadable(const std::string& port, const std::string& why) {
    if (result_.unreadable++ == 0) result_.first_unreadable = port + ": " + why;
  }

  void export_events(const Json& plan) {
    for (size_t i = 0; i < log_.events().size(); ++i) {
      const record::RecordedEvent& event = log_.events()[i];
      const Json json = log_json(event.at_ns, event_node(event, plan), event_text(event, plan));
      record::MessageRecord at;
      at.sequence = i;
      at.stamp_ns = at.published_ns = event.at_ns;
      write("foxglove.Log", record::Recorder::kEvents, at, json, [&] { return schema_from(json); });
    }
  }

  void write(const std::string& schema_name, const std::string& topic, const record::MessageRecord& message,
             const Json& json, const std::function<Json()>& schema_json) {
    auto [channel, added] = channels_.try_emplace(topic, uint16_t{0});
    if (added) channel->second = file_.add_channel(schema(schema_name, schema_json), topic, "json", {});
    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);  // a text may be no UTF-8
    keep(file_.write({channel->second, static_cast<uint32_t>(message.sequence),
                      static_cast<uint64_t>(message.published_ns), static_cast<uint64_t>(message.stamp_ns),
                      mcap::bytes_of(text)}));
    ++result_.messages;
  }

  uint16_t schema(const std::string& name, const std::function<Json()>& json) {
    Json content = json();
    content["title"] = name;
    const auto [schema, added] = schemas_.try_emplace(content.dump(), uint16_t{0});
    if (added) schema->second = file_.add_schema(name, "jsonschema", schema->first);
    return schema->second;
  }

  void keep(const mcap::Writer::Done& done) {
    if (!done && refused_.empty()) refused_ = done.error();
  }

  record::LogFile& log_;
  const graph::MessageTypes& types_;
  mcap::Writer file_;
  std::map<std::string, uint16_t> channels_, schemas_;  ///< by topic; by content
  Exported result_;
  std::string refused_;
};

}  // namespace

tl::expected<Exported, std::string> export_log(record::LogFile& log, const graph::MessageTypes& types,
                                               mcap::Sink& sink) {
  return Export(log, types, sink).run();
}

}  // namespace takt::log
