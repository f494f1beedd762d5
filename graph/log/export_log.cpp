// SPDX-License-Identifier: Apache-2.0
#include "graph/log/export_log.hpp"

#include <map>
#include <utility>

#include "graph/log/recorded_type.hpp"
#include "graph/world/encoder.hpp"
#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/node_state.hpp"
#include "rt/record/mcap/writer.hpp"
#include "rt/record/recorder.hpp"

namespace takt::log {
namespace {

class Export {
 public:
  Export(record::LogFile& log, const graph::MessageTypes& types, const ExportEncoding& encoding, mcap::Sink& sink)
      : log_(log), types_(types), encoding_(encoding), file_(sink, {}) {}

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
      const auto written = !message ? tl::make_unexpected(std::string("it cannot be read"))
                           : !type  ? tl::make_unexpected(type.error())
                           : shown != nullptr
                               ? export_shown(*shown, channel.topic, capacity, memory.get(), *message)
                               : export_own_fields({type->name(), type->fields()}, channel.topic, *message);
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
    const auto shown = encoding_.shown(type, memory, port.substr(0, port.find('.')), message.stamp_ns);
    for (const ExportForm& form : shown.forms) write(form, port, message);
    if (shown.forms.empty() && !shown.fields_say_more) ++result_.showed_nothing;
    return shown.fields_say_more ? export_own_fields({type.name, type.fields}, port, message)
                                 : tl::expected<void, std::string>();
  }

  tl::expected<void, std::string> export_own_fields(const FieldsOf& type, const std::string& port,
                                                    const record::MessageRecord& message) {
    const auto form = encoding_.by_fields(type, message.data, message.stamp_ns);
    if (!form) return tl::make_unexpected(form.error());
    write(*form, port, message);
    return {};
  }

  void unreadable(const std::string& port, const std::string& why) {
    if (result_.unreadable++ == 0) result_.first_unreadable = port + ": " + why;
  }

  void export_events(const Json& plan) {
    for (size_t i = 0; i < log_.events().size(); ++i) {
      const record::RecordedEvent& event = log_.events()[i];
      record::MessageRecord at;
      at.sequence = i;
      at.stamp_ns = at.published_ns = event.at_ns;
      const auto* const said = std::get_if<record::LogSaid>(&event.what);
      const LogLevel level = said != nullptr ? static_cast<LogLevel>(said->level) : LogLevel::info;
      write(encoding_.log(event.at_ns, event_node(event, plan), event_text(event, plan), level),
            record::Recorder::kEvents, at);
    }
  }

  void write(const ExportForm& form, std::string_view port, const record::MessageRecord& message) {
    if (form.bytes.empty()) return unreadable(std::string(port), "it is too long for its encoding");
    auto [channel, added] = channels_.try_emplace({world::topic_of(port, form.topic), form.schema}, uint16_t{0});
    if (added) {
      auto [schema, is_new] = schemas_.try_emplace({form.schema, form.definition()}, uint16_t{0});
      if (is_new) schema->second = file_.add_schema(form.schema, encoding_.of_schemas(), schema->first.second);
      channel->second = file_.add_channel(schema->second, channel->first.first, encoding_.of_messages(), {});
    }
    keep(file_.write({channel->second, static_cast<uint32_t>(message.sequence),
                      static_cast<uint64_t>(message.published_ns), static_cast<uint64_t>(message.stamp_ns),
                      form.bytes}));
    ++result_.messages;
  }

  void keep(const mcap::Writer::Done& done) {
    if (!done && refused_.empty()) refused_ = done.error();
  }

  record::LogFile& log_;
  const graph::MessageTypes& types_;
  const ExportEncoding& encoding_;
  mcap::Writer file_;
  using Two = std::pair<std::string, std::string>;
  std::map<Two, uint16_t> channels_, schemas_;  ///< by topic and schema; by name and definition
  Exported result_;
  std::string refused_;
};

}  // namespace

tl::expected<Exported, std::string> export_log(record::LogFile& log, const graph::MessageTypes& types,
                                               const ExportEncoding& encoding, mcap::Sink& sink) {
  return Export(log, types, encoding, sink).run();
}

}  // namespace takt::log
