// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/messages.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "hal/semantic_link/wire.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/scalar.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/record/packed_message.hpp"

namespace takt::semantic_link {
namespace {

template <class T>
MessageKind kind(Kind kind, std::string_view name, uint32_t count, Way way, bool lasting) {
  return {kind, name, &MessageType::of<T>(), {0, 0, 1, count}, way, lasting};
}

template <size_t N>
bool ended(const char (&text)[N]) {
  return text[N - 1] == 0;
}

bool finite(const Field& field, const std::byte* scalars, size_t bytes) {
  if (field.scalar != Scalar::f32 && field.scalar != Scalar::f64) return true;
  const size_t step = scalar_bytes(field.scalar);
  for (size_t at = 0; at < bytes; at += step)
    if (!visit_scalar(field.scalar, scalars + at, [](auto value) { return std::isfinite(static_cast<double>(value)); }))
      return false;
  return true;
}

/// No number in it is infinite or none.
bool finite(const MessageType& type, const std::byte* message) {
  return std::all_of(type.fields.begin(), type.fields.end(), [&](const Field& field) {
    const std::byte* at = message + field.offset;
    if (!field.is_array()) return finite(field, at, size_t{field.count} * field.element_bytes);
    const auto& array = any_array(at);
    return finite(field, array.data(), size_t{array.size} * field.element_bytes);
  });
}

bool possible(const ObjectReports& reports) {
  double attributes = 0;
  for (const ObjectPlace& place : reports.places.items()) {
    const auto count = static_cast<double>(place.attributes);
    if (count < 0 || count != std::floor(count)) return false;
    attributes += count;
  }
  const auto names = reports.names.items();
  const auto values = reports.attributes.items();
  return reports.in_map <= 1 && reports.names.size == reports.places.size && attributes == reports.attributes.size &&
         std::all_of(names.begin(), names.end(), [](const auto& n) { return ended(n.name) && ended(n.type); }) &&
         std::all_of(values.begin(), values.end(), [](const auto& v) { return ended(v.name) && ended(v.value); });
}

bool possible(const LaserScan& scan) {
  const auto range = scan.range_m.items();
  return scan.sweep_s >= 0 && scan.max_range_m >= 0 &&
         std::all_of(range.begin(), range.end(), [](float r) { return r >= 0; });
}

bool possible(const ActionOutcome& outcome) { return outcome.state <= action_state::failed && ended(outcome.reason); }

bool possible(const ActionCommand& command) {
  return ended(command.action) &&
         std::all_of(std::begin(command.objects), std::end(command.objects), [](const auto& o) { return ended(o); });
}

bool possible(Kind kind, const void* message) {
  switch (kind) {
    case Kind::objects: return possible(*static_cast<const ObjectReports*>(message));
    case Kind::scan: return possible(*static_cast<const LaserScan*>(message));
    case Kind::outcome: return possible(*static_cast<const ActionOutcome*>(message));
    case Kind::action: return possible(*static_cast<const ActionCommand*>(message));
    default: return true;
  }
}

template <class... T>
size_t write(std::span<uint8_t> into, const T&... values) {
  WireWriter out(into);
  out.put(values...);
  return out.size();
}

template <class... T>
bool read_all(std::span<const uint8_t> bytes, T&... values) {
  WireReader in(bytes);
  return in.get(values...) && in.rest().empty();
}

}  // namespace

std::span<const MessageKind, kMessageKinds> message_kinds() {
  using enum Way;
  static const std::array<MessageKind, kMessageKinds> kinds{
      kind<ObjectReports>(Kind::objects, "objects", 64, to_client, false),
      kind<LaserScan>(Kind::scan, "scan", 4096, to_client, false),
      kind<Odometry>(Kind::odometry, "odometry", 0, to_client, false),
      kind<ActionOutcome>(Kind::outcome, "outcome", 0, to_client, true),
      kind<TextStatus>(Kind::status, "status", 4096, to_client, true),
      kind<VelocityCommand>(Kind::velocity, "velocity", 0, to_server, false),
      kind<ActionCommand>(Kind::action, "action", 0, to_server, true),
      kind<RobotTask>(Kind::task, "task", 4096, to_server, true)};
  return kinds;
}

const MessageKind& info_of(Kind kind) { return message_kinds()[index_of(kind)]; }

size_t most_bytes(const MessageKind& info) {
  std::array<uint32_t, 16> counts{};
  info.type->capacities(info.capacity, counts);
  size_t bytes = 0, array = 0;
  for (const Field& field : info.type->fields)
    bytes += field.is_array() ? sizeof(uint32_t) + size_t{counts[array++]} * field.element_bytes
                              : size_t{field.count} * field.element_bytes;
  return bytes;
}

uint64_t layout() {
  static const uint64_t value = [] {
    std::string text;
    for (const MessageKind& info : message_kinds()) {
      text.append(info.name).append(":").append(info.type->name);
      for (const Field& field : info.type->fields)
        text.append(" ").append(field.name).append(" ").append(name_of(field.scalar)) +=
            "*" + std::to_string(field.count) + "*" + std::to_string(field.element_bytes);
    }
    return siphash({}, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  }();
  return value;
}

Placed::Placed(const MessageKind& info) : memory_(aligned_bytes(info.type->bytes(info.capacity))) {
  info.type->place(memory_.get(), info.capacity);
}

bool write_message(const MessageKind& info, const void* message, std::vector<std::byte>& to) {
  std::array<uint32_t, 16> most{};
  info.type->capacities(info.capacity, most);
  size_t array = 0;
  for (const Field& field : info.type->fields)
    if (field.is_array() && any_array(static_cast<const std::byte*>(message) + field.offset).size > most[array++])
      return false;
  record::pack(*info.type, message, to);
  return true;
}

tl::expected<void, Fault> read_message(const MessageKind& info, std::span<const uint8_t> bytes, void* message) {
  if (record::unpack(*info.type, std::as_bytes(bytes), message) &&
      finite(*info.type, static_cast<const std::byte*>(message)) && possible(info.kind, message))
    return {};
  return tl::unexpected(Fault::content);
}

size_t write_note(const Hello& n, std::span<uint8_t> into) {
  WireWriter out(into);
  out.put_bytes({reinterpret_cast<const uint8_t*>(n.robot.data()), n.robot.size()});
  out.put(n.nonce, n.layout);
  return out.size();
}
size_t write_note(const Welcome& n, std::span<uint8_t> into) { return write(into, n.nonce, n.sent_ns, n.heard_ns); }
size_t write_note(const RefusalNote& n, std::span<uint8_t> into) { return write(into, n.nonce, n.reason); }
size_t write_note(const Alive& n, std::span<uint8_t> into) { return write(into, n.sent_ns, n.heard_ns); }

std::optional<Hello> read_hello(std::span<const uint8_t> bytes) {
  char robot[sizeof(Hello::robot)];
  Hello n;
  if (!read_all(bytes, robot, n.nonce, n.layout) || !ended(robot)) return std::nullopt;
  std::copy(std::begin(robot), std::end(robot), n.robot.begin());
  return n;
}
std::optional<Welcome> read_welcome(std::span<const uint8_t> bytes) {
  Welcome n;
  return read_all(bytes, n.nonce, n.sent_ns, n.heard_ns) ? std::optional(n) : std::nullopt;
}
std::optional<RefusalNote> read_refusal(std::span<const uint8_t> bytes) {
  RefusalNote n;
  const bool all =
      read_all(bytes, n.nonce, n.reason) && n.reason >= Reason::unknown_robot && n.reason <= Reason::other_messages;
  return all ? std::optional(n) : std::nullopt;
}
std::optional<Alive> read_alive(std::span<const uint8_t> bytes) {
  Alive n;
  return read_all(bytes, n.sent_ns, n.heard_ns) ? std::optional(n) : std::nullopt;
}

}  // namespace takt::semantic_link
