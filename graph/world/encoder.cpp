// SPDX-License-Identifier: Apache-2.0
#include "graph/world/encoder.hpp"

#include <cstring>
#include <tuple>

#include "graph/world/own_schema.hpp"
#include "graph/world/shown.hpp"
#include "graph/world/sinks.hpp"
#include "rt/msg/scalar.hpp"

namespace takt::world {
namespace {

/// Whether the message may be looked into. Types that are described only have no functions.
bool is_sound(const MessageType& type, const void* message) { return type.sound == nullptr || type.sound(message); }

/// Lets a sound message show itself. Whether its own fields are to follow.
template <class Sink>
bool show(const MessageType& type, const void* message, Sink& sink, std::string_view node, int64_t stamp_ns,
          int quality) {
  if (type.show == nullptr) return true;
  Shown<Sink> shown(sink, node, stamp_ns, quality);
  type.show(message, shown);
  return shown.fields_say_more();
}

template <class Piece>
Form own(std::string_view type_name, std::span<const Field> fields, int64_t stamp_ns, const Piece& piece) {
  return {"", own_schema(type_name), written([&](CdrWriter& to) { write_own(to, stamp_ns, fields, piece); })};
}

/// The definitions that need no fields.
using WellKnown = std::tuple<CompressedImage, RawImage, CameraCalibration, CloudOfPoints, Scan, GridOfCells,
                             PoseInFrame, PosesInFrame, FrameTransform, FrameTransforms, Log, SceneUpdate>;

template <class... S>
std::string well_known(std::string_view schema, const std::tuple<S...>*) {
  std::string text;
  (void)((full_name(S::schema_name) == schema && (text = definition<S>(), true)) || ...);
  return text;
}

}  // namespace

std::vector<Form> Encoder::forms(const MessageType& type, const void* message, std::string_view node, int64_t stamp_ns,
                                 const Wanted& wanted) const {
  FormSink sink{wanted};
  if (!is_sound(type, message)) return {};
  if (show(type, message, sink, node, stamp_ns, options_.jpeg_quality) && sink.wants("", ""))
    sink.forms.push_back(own_form(type, message, stamp_ns));
  return std::move(sink.forms);
}

std::vector<Outline> Encoder::outline(const MessageType& type, const void* message) const {
  OutlineSink sink;
  if (!is_sound(type, message)) return {};
  if (show(type, message, sink, "", 0, options_.jpeg_quality)) sink.outlines.push_back({"", own_schema(type.name)});
  return std::move(sink.outlines);
}

Form own_form(const MessageType& type, const void* message, int64_t stamp_ns) {
  const auto* base = static_cast<const std::byte*>(message);
  return own(type.name, type.fields, stamp_ns, [&](const Field& field) -> std::span<const std::byte> {
    if (!field.is_array()) return {base + field.offset, size_t{field.count} * field.element_bytes};
    const Array<std::byte>& array = any_array(base + field.offset);
    return {array.data(), size_t{array.size} * field.element_bytes};
  });
}

tl::expected<Form, std::string> own_form(std::string_view type_name, std::span<const Field> fields,
                                         std::span<const std::byte> packed, int64_t stamp_ns) {
  std::vector<std::span<const std::byte>> pieces;
  for (const Field& field : fields) {
    uint32_t count = field.count;
    if (field.is_array()) {
      if (packed.size() < sizeof count) return tl::make_unexpected(std::string(field.name) + " is cut off");
      std::memcpy(&count, packed.data(), sizeof count);
      packed = packed.subspan(sizeof count);
    }
    const size_t bytes = size_t{count} * field.element_bytes;
    if (packed.size() < bytes) return tl::make_unexpected(std::string(field.name) + " is cut off");
    pieces.push_back(packed.first(bytes));
    packed = packed.subspan(bytes);
  }
  if (!packed.empty()) return tl::make_unexpected(std::to_string(packed.size()) + " bytes too many");
  return own(type_name, fields, stamp_ns,
             [&](const Field& field) { return pieces[static_cast<size_t>(&field - fields.data())]; });
}

Form log_form(int64_t at_ns, std::string_view name, std::string_view text, LogLevel level) {
  return {"", full_name(Log::schema_name), encoded(Log{time_of(at_ns), number_of(level), text, name, "", 0})};
}

std::string topic_of(std::string_view port, std::string_view form_topic) {
  return form_topic.starts_with('/') ? std::string(form_topic) : std::string(port) + std::string(form_topic);
}

std::string schema_text(std::string_view schema, std::span<const Field> fields) {
  if (schema.starts_with("takt_msgs/msg/")) return own_definition(fields);
  return well_known(schema, static_cast<const WellKnown*>(nullptr));
}

}  // namespace takt::world
