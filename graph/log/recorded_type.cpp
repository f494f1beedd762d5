// SPDX-License-Identifier: Apache-2.0
#include "graph/log/recorded_type.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "rt/msg/scalar.hpp"

namespace takt::log {
namespace {

constexpr std::string_view kPrefix = "takt.";
constexpr uint64_t kMostScalars = 1U << 20U;  // of one field or element: what is larger is damage

std::optional<Scalar> scalar_named(std::string_view name) {
  for (auto scalar = Scalar::u8;; scalar = static_cast<Scalar>(static_cast<int>(scalar) + 1)) {
    if (name_of(scalar) == name) return scalar;
    if (scalar == Scalar::f64) return std::nullopt;
  }
}

/// The text of a member that lives as long as `json`; nothing if it is none.
std::optional<std::string_view> word(const Json& json, const char* member) {
  const auto found = json.find(member);
  if (found == json.end() || !found->is_string()) return std::nullopt;
  return found->get_ref<const std::string&>();
}

/// Number of scalars; 0 if it is not stated or cannot be.
uint32_t scalar_count(const Json& json, const char* member) {
  const auto found = json.find(member);
  if (found == json.end() || !found->is_number_unsigned() || *found > kMostScalars) return 0;
  return found->get<uint32_t>();
}

tl::expected<Field, std::string> read_field(const Json& json) {
  const auto name = word(json, "name"), unit = word(json, "unit"), scalar_name = word(json, "scalar");
  if (!name || !unit || !scalar_name) return tl::make_unexpected("lacks its name, unit or scalar");
  const auto scalar = scalar_named(*scalar_name);
  if (!scalar)
    return tl::make_unexpected(
        fmt::format("({}) has scalars of type {}, which is none of u8, i16, u16, i32, u32, i64, u64, f32, f64", *name,
                    *scalar_name));
  const uint32_t count = scalar_count(json, "count"), array_of = scalar_count(json, "array_of");
  if ((count == 0) == (array_of == 0))
    return tl::make_unexpected(fmt::format("({}) must state either its count or what it is an array of", *name));
  const auto bytes = static_cast<uint32_t>(scalar_bytes(*scalar));
  const auto text = json.find("text");
  return Field{*name,
               *unit,
               *scalar,
               0,
               count,
               array_of > 0 ? array_of * bytes : bytes,
               text != json.end() && *text == true && array_of == 1 && bytes == 1};
}

}  // namespace

tl::expected<RecordedType, std::string> RecordedType::read(const mcap::Schema& schema) {
  RecordedType type;
  type.name_ = schema.name.starts_with(kPrefix) ? schema.name.substr(kPrefix.size()) : schema.name;
  type.layout_ = Json::parse(schema.data, nullptr, false);
  const auto list = type.layout_.is_object() ? type.layout_.find("fields") : type.layout_.end();
  if (list == type.layout_.end() || !list->is_array() || list->empty())
    return tl::make_unexpected(schema.name + ": the record does not list the fields of this type");
  for (size_t i = 0; i < list->size(); ++i) {
    const auto field = read_field((*list)[i]);
    if (!field) return tl::make_unexpected(fmt::format("{}: field {} {}", schema.name, i + 1, field.error()));
    type.fields_.push_back(*field);
  }
  return type;
}

bool RecordedType::same_fields(std::span<const Field> others) const {
  return std::equal(fields_.begin(), fields_.end(), others.begin(), others.end(), [](const Field& a, const Field& b) {
    return a.name == b.name && a.scalar == b.scalar && a.count == b.count && a.element_bytes == b.element_bytes;
  });
}

const mcap::Schema* schema_of(const record::LogFile& log, const mcap::Channel& channel) {
  const auto& all = log.container().schemas();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const auto& schema) { return schema.id == channel.schema; });
  return found == all.end() ? nullptr : &*found;
}

tl::expected<RecordedType, std::string> type_of(const record::LogFile& log, const mcap::Channel& channel) {
  const mcap::Schema* schema = schema_of(log, channel);
  if (schema == nullptr) return tl::make_unexpected(std::string("the record does not describe its type"));
  return RecordedType::read(*schema);
}

const mcap::Channel* channel_of(const record::LogFile& log, std::string_view port) {
  const auto& all = log.container().channels();
  const auto found = std::find_if(all.begin(), all.end(), [&](const auto& channel) {
    return channel.topic == port && record::LogFile::of_a_port(channel);
  });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace takt::log
