// SPDX-License-Identifier: Apache-2.0
#include "graph/log/echo_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "graph/attach/message_text.hpp"
#include "graph/language/words.hpp"
#include "graph/log/recorded_type.hpp"
#include "rt/record/message_record.hpp"

namespace takt::log {
namespace {

struct Port {
  const mcap::Channel* channel;
  tl::expected<RecordedType, std::string> type;
};

/// By channel. Error: one of `wanted` is not there.
tl::expected<std::map<uint16_t, Port>, std::string> chosen(const record::LogFile& log,
                                                           std::span<const std::string> wanted) {
  std::vector<std::string> known;
  std::map<uint16_t, Port> ports;
  for (const mcap::Channel& channel : log.container().channels()) {
    if (!record::LogFile::of_a_port(channel)) continue;
    known.push_back(channel.topic);
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), channel.topic) == wanted.end()) continue;
    ports.emplace(channel.id, Port{&channel, type_of(log, channel)});
  }
  for (const std::string& name : wanted)
    if (channel_of(log, name) == nullptr)
      return tl::make_unexpected(fmt::format("the record has no output {}{}", graph::ticked(name),
                                             graph::alternatives(name, known, "outputs of this record")));
  return ports;
}

tl::expected<Json, std::string> message_line(const Port& port, const record::MessageRecord& message, size_t items) {
  if (!port.type) return tl::make_unexpected(port.type.error());
  Json line{{"port", port.channel->topic},
            {"type", port.type->name()},
            {"sequence", message.sequence},
            {"level", message.level},
            {"stamp_ns", message.stamp_ns}};
  if (!message.whole) {
    line["hash"] = fmt::format("{:016x}", message.hash);
    return line;
  }
  auto fields = attach::packed_json(port.type->fields(), message.data, items);
  if (!fields) return tl::make_unexpected(fields.error());
  line["message"] = std::move(*fields);
  return line;
}

}  // namespace

tl::expected<Echoed, std::string> echo_log(const record::LogFile& log, std::span<const std::string> wanted,
                                           size_t items, const std::function<void(const Json&)>& each) {
  const auto ports = chosen(log, wanted);
  if (!ports) return tl::make_unexpected(ports.error());
  Echoed result;
  std::vector<std::byte> plain;
  const auto walked = log.container().for_each([&](const mcap::Message& raw) {
    const auto port = ports->find(raw.channel);
    if (port == ports->end()) return true;
    auto message = record::unpack_message(raw.data);
    if (message)
      if (const auto read = record::uncode(*message, plain); !read) message = tl::make_unexpected(read.error());
    const tl::expected<Json, std::string> line =
        message.and_then([&](const auto& there) { return message_line(port->second, there, items); });
    if (line) {
      each(*line);
      ++result.messages;
      result.hash_only += message->whole ? 0 : 1;
    } else if (result.unreadable++ == 0) {
      result.first_unreadable = port->second.channel->topic + ": " + line.error();
    }
    return true;
  });
  if (!walked) return tl::make_unexpected(walked.error());
  return result;
}

}  // namespace takt::log
