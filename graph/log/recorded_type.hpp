// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "graph/log/recorded_plan.hpp"
#include "rt/msg/field.hpp"
#include "rt/record/log_file.hpp"

namespace takt::log {

/// A message type as a record describes it. It is enough to print, compare and export messages of types that this
/// program was not built with:
///
///   const auto type = type_of(log, channel);
///   if (type) json = attach::packed_json(type->fields(), message.data, 8);
///
/// Offsets of its fields are 0: a record packs them one after the other.
class RecordedType {
 public:
  /// Error: the schema does not list fields; the field at fault is named.
  static tl::expected<RecordedType, std::string> read(const mcap::Schema& schema);

  RecordedType(RecordedType&&) = default;
  RecordedType& operator=(RecordedType&&) = default;

  /// Without the "takt." of its schema: "wheel".
  const std::string& name() const { return name_; }
  /// Valid as long as this object and those it was moved to.
  std::span<const Field> fields() const { return fields_; }
  /// Whether messages of both have the same bytes with the same meaning. Units and offsets may differ.
  bool same_fields(std::span<const Field> others) const;
  /// Whether it is this type of the program: name and fields.
  bool is(const MessageType& type) const { return type.name == name_ && same_fields(type.fields); }

 private:
  RecordedType() = default;
  std::string name_;
  Json layout_;  ///< holds the words of the fields
  std::vector<Field> fields_;
};

/// What the record says of the messages of a channel; null if it says nothing.
const mcap::Schema* schema_of(const record::LogFile& log, const mcap::Channel& channel);
/// The type of its messages. Error: the record does not describe it.
tl::expected<RecordedType, std::string> type_of(const record::LogFile& log, const mcap::Channel& channel);
/// The channel of "NODE.PORT"; null if the record has none.
const mcap::Channel* channel_of(const record::LogFile& log, std::string_view port);

}  // namespace takt::log
