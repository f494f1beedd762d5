// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/follow.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/language/words.hpp"
#include "rt/record/packed_message.hpp"
#include "rt/time/clock.hpp"

namespace takt::attach {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kLookEveryMs = 3;  ///< while messages are wanted
constexpr int kIdleMs = 50;      ///< while none are
constexpr int64_t kLongest_ns = 3'600'000'000'000;

/// Made once for all who follow an output.
std::optional<std::string> packed(const MessageType& type, const void* message) {
  std::vector<std::byte> bytes;
  bytes.reserve(record::packed_bytes(type, message));
  record::pack(type, message, bytes);
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

int64_t interval_ns(const Json& wish, const char* key) {
  const Json value = wish.value(key, Json(0));
  return value.is_number() ? static_cast<int64_t>(std::clamp(value.get<double>() * 1e6, 0.0, double{kLongest_ns})) : 0;
}

}  // namespace

tl::expected<size_t, std::string> find_port(const Plan& plan, const std::string& name) {
  std::vector<std::string> known;
  for (const PortPlan& port : plan.ports) known.push_back(port.node + "." + port.port);
  const auto found = std::find(known.begin(), known.end(), name);
  if (found != known.end()) return static_cast<size_t>(found - known.begin());
  return tl::unexpected(fmt::format("there is no output {}{}", graph::ticked(name),
                                    graph::alternatives(name, known, "outputs of this graph")));
}

void Follow::run(const std::atomic<bool>& ending) {
  while (!ending.load()) {
    while (connection_.readable(looks_.empty() ? kIdleMs : kLookEveryMs))
      if (!take_wish()) return;
    const int64_t now = MonotonicClock().now_ns();
    if (!send_messages(now) || !send_state(now)) return;
  }
}

bool Follow::take_wish() {
  const auto wish = connection_.read_line();
  if (!wish || !wish->is_object()) return false;
  for (const char* key : {"add", "drop"})
    if (wish->contains(key) && !wish->at(key).is_string())
      return connection_.write({{"error", fmt::format("{} names an output", key)}});
  if (wish->contains("add")) return add(*wish);
  if (wish->contains("drop")) {
    if (const auto port = find_port(subject_.plan, wish->at("drop"))) looks_.erase(*port);
    return true;
  }
  if (wish->contains("state_every_ms")) {
    state_every_ns_ = interval_ns(*wish, "state_every_ms");
    next_state_ns_ = 0;
    return true;
  }
  return connection_.write({{"error", "unknown wish; known: add, drop, state_every_ms"}});
}

bool Follow::add(const Json& wish) {
  const auto port = find_port(subject_.plan, wish.at("add"));
  if (!port) return connection_.write({{"error", port.error()}});
  Look& look = looks_[*port];
  if (!look.tap) look.tap = taps_.at(*port);
  look.every_ns = interval_ns(wish, "every_ms");
  return true;
}

bool Follow::send_messages(int64_t now) {
  for (auto& [port, look] : looks_) {
    if (now < look.next_ns) continue;
    const auto message = look.tap->newer_than(look.seen, now);
    if (message == nullptr) continue;
    look.seen = message->sequence;
    // From when it was due: a look that is late by a little does not make the next one late, too.
    look.next_ns = std::max(look.next_ns, now - look.every_ns) + look.every_ns;
    const std::optional<std::string>& bytes = message->drawn(packed);
    const PortPlan& plan = subject_.plan.ports[port];
    if (!connection_.write({{"message", plan.node + "." + plan.port},
                            {"sequence", message->sequence},
                            {"stamp_ns", message->stamp_ns},
                            {"level", message->level},
                            {"age_ms", static_cast<double>(now - message->stamp_ns) / 1e6},
                            {"bytes", bytes->size()}},
                           *bytes))
      return false;
  }
  return true;
}

bool Follow::send_state(int64_t now) {
  if (state_every_ns_ == 0) return looks_.empty() ? !connection_.gone() : true;
  if (now < next_state_ns_) return true;
  next_state_ns_ = now + state_every_ns_;
  return connection_.write({{"state", state_json(subject_)},
                            {"epoch_ns", subject_.board.epoch_ns().load()},
                            {"jobs", jobs_.take()},
                            {"events", events_.take()}});
}

}  // namespace takt::attach
