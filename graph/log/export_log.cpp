// SPDX-License-Identifier: Apache-2.0
#include "graph/log/export_log.hpp"

#include <cmath>
#include <cstring>
#include <functional>
#include <map>

#include "graph/attach/message_text.hpp"
#include "graph/log/recorded_type.hpp"
#include "graph/view/markup.hpp"
#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/pose.hpp"
#include "rt/msg/scalar.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/record/mcap/writer.hpp"
#include "rt/record/recorder.hpp"

namespace takt::log {
namespace {

/// Numbers that Foxglove's schemas give to the types of packed elements.
enum class Numeric : int { u8 = 1, i16 = 4, f32 = 7 };

template <class T>
std::string packed(const T* elements, size_t count) {
  return view::base64({reinterpret_cast<const char*>(elements), count * sizeof(T)});
}

Json time_json(int64_t ns) { return {{"sec", ns / 1'000'000'000}, {"nsec", ns % 1'000'000'000}}; }

Json vector_json(double x, double y, double z) { return {{"x", x}, {"y", y}, {"z", z}}; }

Json pose_json(const Transform& t) {
  return {{"position", vector_json(t.x, t.y, t.z)},
          {"orientation", {{"x", t.qx}, {"y", t.qy}, {"z", t.qz}, {"w", t.qw}}}};
}

Json field_json(const char* name, int offset, Numeric type) {
  return {{"name", name}, {"offset", offset}, {"type", static_cast<int>(type)}};
}

/// Where a message comes from, for the frames it is told in.
struct Origin {
  std::string node;
  int64_t stamp_ns = 0;
};

Json image_json(const Origin& from, int width, int height, int channels, const uint8_t* pixels, size_t size) {
  return {{"timestamp", time_json(from.stamp_ns)},
          {"frame_id", from.node},
          {"width", width},
          {"height", height},
          {"encoding", channels == 3 ? "bgr8" : "mono8"},
          {"step", width * channels},
          {"data", packed(pixels, size)}};
}

Json image(const Origin& from, const void* message) {
  const auto& m = *static_cast<const Image*>(message);
  return image_json(from, m.width, m.height, m.channels, m.pixels.data(), m.pixels.size);
}

Json left_image(const Origin& from, const void* message) {
  const auto& m = *static_cast<const StereoPair*>(message);
  return image_json(from, m.width, m.height, m.channels, m.left.data(), m.left.size);
}

Json right_image(const Origin& from, const void* message) {
  const auto& m = *static_cast<const StereoPair*>(message);
  return image_json(from, m.width, m.height, m.channels, m.right.data(), m.right.size);
}

Json disparity_image(const Origin& from, const void* message) {
  const auto& m = *static_cast<const DisparityMap*>(message);
  return {{"timestamp", time_json(from.stamp_ns)},
          {"frame_id", from.node},
          {"width", m.width},
          {"height", m.height},
          {"encoding", "16UC1"},  // 65535 where the disparity is invalid
          {"step", m.width * 2},
          {"data", packed(m.disparity.data(), m.disparity.size)}};
}

Json cloud(const Origin& from, const void* message) {
  const auto& m = *static_cast<const PointCloud*>(message);
  struct Element {
    Point point;
    uint8_t red, green, blue, alpha;
  };
  std::vector<Element> elements(m.points.size);
  for (uint32_t i = 0; i < m.points.size; ++i) {
    const Colour colour = i < m.colours.size ? m.colours[i] : Colour{255, 255, 255};
    elements[i] = {m.points[i], colour.r, colour.g, colour.b, 255};
  }
  return {{"timestamp", time_json(from.stamp_ns)},
          {"frame_id", from.node},
          {"pose", pose_json({})},
          {"point_stride", sizeof(Element)},
          {"fields",
           {field_json("x", 0, Numeric::f32), field_json("y", 4, Numeric::f32), field_json("z", 8, Numeric::f32),
            field_json("red", 12, Numeric::u8), field_json("green", 13, Numeric::u8),
            field_json("blue", 14, Numeric::u8), field_json("alpha", 15, Numeric::u8)}},
          {"data", packed(elements.data(), elements.size())}};
}

Json scan(const Origin& from, const void* message) {
  const auto& m = *static_cast<const LaserScan*>(message);
  Json ranges = Json::array();
  for (uint32_t i = 0; i < m.range_m.size; ++i) ranges.push_back(m.range_m[i]);
  const double beams = m.range_m.size > 0 ? m.range_m.size - 1 : 0;
  return {{"timestamp", time_json(from.stamp_ns)},
          {"frame_id", from.node},
          {"pose", pose_json({})},
          {"start_angle", m.first_angle_rad},
          {"end_angle", m.first_angle_rad + beams * m.step_rad},
          {"ranges", ranges},
          {"intensities", Json::array()}};
}

Json grid(const Origin& from, const void* message) {
  const auto& m = *static_cast<const Grid*>(message);
  Transform corner;
  corner.x = m.origin_x_m;
  corner.y = m.origin_y_m;
  return {{"timestamp", time_json(from.stamp_ns)},
          {"frame_id", "robot"},
          {"pose", pose_json(corner)},
          {"column_count", m.width},
          {"cell_size", {{"x", m.cell_m}, {"y", m.cell_m}}},
          {"row_stride", m.width * 2},
          {"cell_stride", 2},
          {"fields", {field_json("occupancy", 0, Numeric::i16)}},  // 0 free .. 1000 occupied, -1 unknown
          {"data", packed(m.cells.data(), m.cells.size)}};
}

Json pose_in(const Origin& from, const char* frame, const Transform& transform) {
  return {{"timestamp", time_json(from.stamp_ns)}, {"frame_id", frame}, {"pose", pose_json(transform)}};
}

Json pose(const Origin& from, const void* message) {
  return pose_in(from, "map", static_cast<const Pose*>(message)->transform);
}

Json motion(const Origin& from, const void* message) {
  return pose_in(from, "first_camera", static_cast<const Motion*>(message)->pose);
}

Json odometry(const Origin& from, const void* message) {
  const auto& m = *static_cast<const Odometry*>(message);
  Transform t;
  t.x = m.x_m;
  t.y = m.y_m;
  t.qw = std::cos(m.theta_rad / 2);
  t.qz = std::sin(m.theta_rad / 2);
  return pose_in(from, "odometry", t);
}

Json log_json(int64_t at_ns, const std::string& name, const std::string& text) {
  return {{"timestamp", time_json(at_ns)},
          {"level", 2},  // INFO
          {"message", text},
          {"name", name},
          {"file", ""},
          {"line", 0}};
}

Json text(const Origin& from, const void* message) {
  const auto& m = *static_cast<const TextStatus*>(message);
  return log_json(from.stamp_ns, from.node, std::string(m.text.data(), m.text.size));
}

Json transform(const Origin& from, const Transform& t) {
  const Json pose = pose_json(t);
  return {{"timestamp", time_json(from.stamp_ns)},
          {"parent_frame_id", "robot"},
          {"child_frame_id", from.node},
          {"translation", pose["position"]},
          {"rotation", pose["orientation"]}};
}

Json cloud_transform(const Origin& from, const void* message) {
  return transform(from, static_cast<const PointCloud*>(message)->sensor_in_robot);
}

Json scan_transform(const Origin& from, const void* message) {
  return transform(from, static_cast<const LaserScan*>(message)->sensor_in_robot);
}

/// One way in which messages of a type are shown.
struct Form {
  std::string topic;  ///< behind the name of the port; the whole topic if it begins with a slash
  std::string schema;
  std::function<Json(const Origin&, const void*)> make;
};

/// A type that has forms, and these.
struct Shown {
  const MessageType* type;
  std::vector<Form> forms;
};

/// Null: messages of this type, as the record describes it, are shown by their own fields.
const Shown* shown(const RecordedType& recorded) {
  static const std::vector<Shown> known{
      {&MessageType::of<Image>(), {{"", "foxglove.RawImage", image}}},
      {&MessageType::of<StereoPair>(),
       {{".left", "foxglove.RawImage", left_image}, {".right", "foxglove.RawImage", right_image}}},
      {&MessageType::of<DisparityMap>(), {{"", "foxglove.RawImage", disparity_image}}},
      {&MessageType::of<PointCloud>(),
       {{"", "foxglove.PointCloud", cloud}, {"/tf", "foxglove.FrameTransform", cloud_transform}}},
      {&MessageType::of<LaserScan>(),
       {{"", "foxglove.LaserScan", scan}, {"/tf", "foxglove.FrameTransform", scan_transform}}},
      {&MessageType::of<Grid>(), {{"", "foxglove.Grid", grid}}},
      {&MessageType::of<Pose>(), {{"", "foxglove.PoseInFrame", pose}}},
      {&MessageType::of<Motion>(), {{"", "foxglove.PoseInFrame", motion}}},
      {&MessageType::of<Odometry>(), {{"", "foxglove.PoseInFrame", odometry}}},
      {&MessageType::of<TextStatus>(), {{"", "foxglove.Log", text}}}};
  for (const Shown& one : known)
    if (one.type->name == recorded.name() && recorded.same_fields(one.type->fields)) return &one;
  return nullptr;
}

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
  Export(record::LogFile& log, mcap::Sink& sink) : log_(log), file_(sink, {}) {}

  tl::expected<Exported, std::string> run() {
    const auto text = log_.attached("plan.json");
    const Json plan = text ? Json::parse(*text, nullptr, false) : Json();
    if (!plan.is_object() || !plan.contains("ports")) return tl::make_unexpected("the record does not hold its plan");
    keep(file_.begin("", "takt log export"));
    for (size_t p = 0; p < plan["ports"].size(); ++p) {
      const std::string port = plan["ports"][p].value("name", "");
      if (const mcap::Channel* channel = channel_of(log_, port)) export_port(*channel, capacity_of(plan, p));
      else unreadable(port, "the record has no such channel");
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
    const Shown* known = type ? shown(*type) : nullptr;
    if (type && known == nullptr) result_.own_fields.insert(type->name());
    const AlignedBytes memory = aligned_bytes(known != nullptr ? known->type->bytes(capacity) : 0);
    for (const auto& [sequence, there] : log_.messages(channel.id)) {
      if (!there.whole) {
        ++result_.hash_only;
        continue;
      }
      const auto message = log_.message(channel.id, sequence);
      const auto written = !message           ? tl::make_unexpected(std::string("it cannot be read"))
                           : !type            ? tl::make_unexpected(type.error())
                           : known != nullptr ? export_shown(*known, channel.topic, capacity, memory.get(), *message)
                                              : export_own_fields(*type, channel.topic, *message);
      if (!written) unreadable(channel.topic, written.error());
    }
  }

  tl::expected<void, std::string> export_shown(const Shown& shown, const std::string& port, const Capacity& capacity,
                                               void* memory, const record::MessageRecord& message) {
    shown.type->place(memory, capacity);
    if (const auto filled = record::unpack(*shown.type, message.data, memory); !filled) return filled;
    const Origin from{port.substr(0, port.find('.')), message.stamp_ns};
    for (const Form& form : shown.forms) {
      const Json json = form.make(from, memory);
      write(form.schema, form.topic.starts_with("/") ? form.topic : port + form.topic, message, json,
            [&] { return schema_from(json); });
    }
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
    const auto [schema, added] = schemas_.try_emplace(name, uint16_t{0});
    if (added) {
      Json text = json();
      text["title"] = name;
      schema->second = file_.add_schema(name, "jsonschema", text.dump());
    }
    return schema->second;
  }

  void keep(const mcap::Writer::Done& done) {
    if (!done && refused_.empty()) refused_ = done.error();
  }

  record::LogFile& log_;
  mcap::Writer file_;
  std::map<std::string, uint16_t> channels_, schemas_;
  Exported result_;
  std::string refused_;
};

}  // namespace

tl::expected<Exported, std::string> export_log(record::LogFile& log, mcap::Sink& sink) {
  return Export(log, sink).run();
}

}  // namespace takt::log
