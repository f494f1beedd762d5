// SPDX-License-Identifier: Apache-2.0
// Messages as other programs read them: plain CDR, in Foxglove's schemas where a message shows itself
// (rt/msg/viewer.hpp), else by its own fields. For a live server, an exported file, a DDS writer.
//
//   const world::Encoder encoder({.jpeg_quality = 75});
//   for (const world::Form& form : encoder.forms(type, message, "head_camera", stamp_ns))
//     send(world::topic_of("head_camera.pair", form.topic),  // "head_camera.pair.left"
//          form.schema,                                      // "foxglove_msgs/msg/CompressedImage"
//          world::schema_text(form.schema, type.fields),     // its definition, encoding "ros2msg"
//          form.bytes);                                      // encoding "cdr"
//
// Pictures are compressed in forms() and nowhere else, so say there what somebody listens to:
//
//   encoder.forms(type, message, node, stamp_ns, [&](std::string_view topic) { return listens(topic); });
//
// All functions may be called by several threads at once. They allocate: never call them in a job.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "rt/log_line.hpp"
#include "rt/msg/field.hpp"

namespace takt::world {

/// A message in one schema.
struct Form {
  std::string topic;   ///< behind the name of the port: "", ".left"; the whole topic if it begins with a slash: "/tf"
  std::string schema;  ///< "foxglove_msgs/msg/LaserScan", "takt_msgs/msg/Wheel"
  std::vector<std::byte> bytes;
};

/// What a Form will be of, before anything is encoded.
struct Outline {
  std::string topic, schema;
};

/// Whether somebody wants the form with this topic (Form::topic).
using Wanted = std::function<bool(std::string_view topic)>;

class Encoder {
 public:
  struct Options {
    int jpeg_quality = 75;  ///< 1 to 100, CompressedImage; 0: pictures as RawImage
  };
  Encoder() = default;
  explicit Encoder(Options options) : options_(options) {}

  /// All forms of a message, or those that are wanted. `message` is whole (MessageType::intact, or filled by
  /// record::unpack); if it is not sound() it has no forms. `node`: whose message it is; the frame of what is told in
  /// that of its sensor. No form either of a picture that has no pixels, or that is too large for a JPEG.
  std::vector<Form> forms(const MessageType& type, const void* message, std::string_view node, int64_t stamp_ns,
                          const Wanted& wanted = {}) const;

  /// Topics and schemas of what forms() would give for this message, at no cost to speak of: what there is to
  /// subscribe. An empty message may show less than a full one.
  std::vector<Outline> outline(const MessageType& type, const void* message) const;

 private:
  Options options_;
};

/// By the fields alone, of a message as it lies in memory. Its schema is own_schema(type.name).
Form own_form(const MessageType& type, const void* message, int64_t stamp_ns);
/// The same of a message as a record holds it (rt/record/packed_message.hpp). Error: it is cut off or too long.
tl::expected<Form, std::string> own_form(std::string_view type_name, std::span<const Field> fields,
                                         std::span<const std::byte> packed, int64_t stamp_ns);
/// A line of a log: an event, a text. Topic "". `name`: the node that it is about.
Form log_form(int64_t at_ns, std::string_view name, std::string_view text, LogLevel level = LogLevel::info);

/// "NODE.PORT" and the topic of a form: "NODE.PORT.left", "/tf".
std::string topic_of(std::string_view port, std::string_view form_topic);

/// "takt_msgs/msg/" and the name in the form that ROS 2 allows: of "laser_scan" it is "takt_msgs/msg/LaserScan".
std::string own_schema(std::string_view type_name);

/// The definition of a schema and of all that it uses, as ros2msg. `fields`: of the message's type, which decide what
/// a schema of takt_msgs is; those of Foxglove need none. Empty: there is no such schema.
std::string schema_text(std::string_view schema, std::span<const Field> fields = {});

}  // namespace takt::world
