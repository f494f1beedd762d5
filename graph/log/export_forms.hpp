// SPDX-License-Identifier: Apache-2.0
// Messages and events in the two encodings that `takt log export` writes: JSON and CDR, both in Foxglove's schemas.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "rt/log_line.hpp"
#include "rt/msg/field.hpp"

namespace takt::log {

/// One message in one schema.
struct ExportForm {
  std::string topic;  ///< behind the name of the port; the whole topic if it begins with a slash
  std::string schema;
  std::function<std::string()> definition;  ///< of the schema; valid as long as the type's fields
  std::vector<std::byte> bytes;
};

/// A message type as a record or a program describes it.
struct FieldsOf {
  std::string_view type_name;
  std::span<const Field> fields;
};

/// How messages are written.
class ExportEncoding {
 public:
  virtual ~ExportEncoding() = default;
  virtual std::string of_messages() const = 0;  ///< as MCAP names it: "json"
  virtual std::string of_schemas() const = 0;   ///< "jsonschema"

  struct Shown {
    std::vector<ExportForm> forms;
    bool fields_say_more = false;  ///< a form by the message's own fields belongs next to these
  };
  /// What a sound message shows of itself (rt/msg/viewer.hpp). `node`: whose it is, the frame of what is told in that
  /// of its sensor.
  virtual Shown shown(const MessageType& type, const void* message, std::string_view node, int64_t stamp_ns) const = 0;
  /// A packed message by its fields. Error: it is cut off or too long.
  virtual tl::expected<ExportForm, std::string> by_fields(const FieldsOf& type, std::span<const std::byte> packed,
                                                          int64_t stamp_ns) const = 0;
  virtual ExportForm log(int64_t at_ns, std::string_view name, std::string_view text, LogLevel level) const = 0;
};

const ExportEncoding& json_encoding();
const ExportEncoding& cdr_encoding();

}  // namespace takt::log
