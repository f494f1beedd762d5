// SPDX-License-Identifier: Apache-2.0
#include "graph/log/export_forms.hpp"
#include "graph/world/encoder.hpp"

namespace takt::log {
namespace {

class CdrEncoding final : public ExportEncoding {
 public:
  std::string of_messages() const override { return "cdr"; }
  std::string of_schemas() const override { return "ros2msg"; }
  Shown shown(const MessageType& type, const void* message, std::string_view node, int64_t stamp_ns) const override {
    Shown shown;
    for (world::Form& form : encoder_.forms(type, message, node, stamp_ns))
      shown.forms.push_back(with_definition(std::move(form), {type.name, type.fields}));
    return shown;  // the encoder adds the fields itself
  }
  tl::expected<ExportForm, std::string> by_fields(const FieldsOf& type, std::span<const std::byte> packed,
                                                  int64_t stamp_ns) const override {
    auto form = world::own_form(type.type_name, type.fields, packed, stamp_ns);
    if (!form) return tl::make_unexpected(form.error());
    return with_definition(std::move(*form), type);
  }
  ExportForm log(int64_t at_ns, std::string_view name, std::string_view text, LogLevel level) const override {
    return with_definition(world::log_form(at_ns, name, text, level), {});
  }

 private:
  static ExportForm with_definition(world::Form form, FieldsOf type) {
    return {std::move(form.topic), form.schema,
            [schema = form.schema, type] { return world::schema_text(schema, type.fields); }, std::move(form.bytes)};
  }
  world::Encoder encoder_;
};

}  // namespace

const ExportEncoding& cdr_encoding() {
  static const CdrEncoding encoding;
  return encoding;
}

}  // namespace takt::log
