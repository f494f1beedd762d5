// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "graph/language/loader.hpp"
#include "graph/language/quantity.hpp"
#include "graph/language/schema.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

/// Sets `value` to the enumerator of a word; a word that is none was reported by the schema.
template <class Enum, size_t N>
void read_word(const json& entry, const char* key, const std::array<std::pair<const char*, Enum>, N>& words,
               Enum& value) {
  if (!entry.contains(key) || !entry[key].is_string()) return;
  for (const auto& [word, enumerator] : words)
    if (entry[key] == word) value = enumerator;
}

constexpr std::array kPolicies{std::pair{"deadline", Policy::deadline}, std::pair{"fixed", Policy::fixed},
                               std::pair{"cooperative", Policy::cooperative}};
constexpr std::array kCriticalities{std::pair{"high", Criticality::high}, std::pair{"low", Criticality::low}};
constexpr std::array kOnOverrun{std::pair{"continue", OnOverrun::proceed}, std::pair{"degrade", OnOverrun::degrade},
                                std::pair{"safe_stop", OnOverrun::safe_stop}};
constexpr std::array kOnMiss{std::pair{"continue", OnMiss::proceed}, std::pair{"skip", OnMiss::skip},
                             std::pair{"reuse_last", OnMiss::reuse_last}, std::pair{"safe_stop", OnMiss::safe_stop}};
constexpr std::array kPublish{std::pair{"asap", PublishAt::asap}, std::pair{"let", PublishAt::let}};

std::string entry_pointer(const std::string& id) { return child("/nodes", id); }

}  // namespace

Position Loader::schedule_at(const std::string& id, std::string_view key) const {
  return schedule_.value_at(child(entry_pointer(id), key));
}

std::optional<std::filesystem::path> Loader::schedule_path(Position& wanted_from) {
  if (options_.schedule) {
    wanted_from = {"--schedule", 0, 0};
    return *options_.schedule;
  }
  wanted_from = graph_.value_at("/schedule");
  const json named = graph_.root.is_object() ? graph_.root.value("schedule", json()) : json();
  if (named.is_string() && !named.get<std::string>().empty())
    return (std::filesystem::path(wanted_from.file).parent_path() / named.get<std::string>()).lexically_normal();
  if (!graph_.marks.contains("/schedule"))
    problem(graph_.value_at(""), "the graph names no schedule; add `schedule: PATH`, or call with --schedule FILE");
  return std::nullopt;
}

void Loader::read_schedule() {
  Position wanted_from;
  const auto path = schedule_path(wanted_from);
  if (!path) return;
  spec_.schedule.file = path->string();
  schedule_ = read_document(*path, wanted_from, problems_);
  if (schedule_.root.is_null()) return;
  validate(schedule_, Schema::schedule, problems_);
  const json& root = schedule_.root;
  if (!root.is_object()) return;
  if (root.contains("name") && root["name"].is_string()) spec_.schedule.name = root["name"].get<std::string>();
  read_word(root, "policy", kPolicies, spec_.schedule.policy);
  if (!options_.policy.empty()) {
    const json asked{{"policy", options_.policy}};
    std::vector<std::string> words;
    for (const auto& [word, policy] : kPolicies) words.emplace_back(word);
    if (std::find(words.begin(), words.end(), options_.policy) == words.end())
      problem({"--policy", 0, 0},
              fmt::format("there is no policy {}{}", ticked(options_.policy), alternatives(options_.policy, words)));
    read_word(asked, "policy", kPolicies, spec_.schedule.policy);
  }
  spec_.schedule.cores_position = schedule_.value_at("/cores");
  const json cores = root.value("cores", json::array());
  if (cores.is_array())
    for (const auto& core : cores)
      if (core.is_number_integer() && core >= 0 && core <= 1023) spec_.schedule.cores.push_back(core.get<int>());
  if (const auto anticipate = read_time(schedule_, root, "", "anticipate", "the schedule")) {
    spec_.schedule.anticipate_ns = *anticipate;
    if (*anticipate < 0 || *anticipate > kLongestAnticipate_ns)
      problem(schedule_.value_at("/anticipate"),
              fmt::format("`anticipate` is {}; it must lie between 0ms and {}", schedule_.raw("/anticipate"),
                          duration_text(kLongestAnticipate_ns)));
  }
  if (root.contains("measured") && root["measured"].is_object()) read_measured(root["measured"]);
  const json nodes = root.value("nodes", json::object());
  if (!nodes.is_object()) return;
  for (const auto& [id, value] : nodes.items())
    if (value.is_object()) read_entry(id, value, entry_pointer(id));
}

void Loader::read_entry(const std::string& id, const json& value, const std::string& pointer) {
  ScheduleEntry entry;
  entry.position = schedule_.key_at(pointer);
  if (!claimed_.contains(id))
    problem(entry.position, fmt::format("the schedule names {}, but graph {} has no such node or device{}", ticked(id),
                                        ticked(spec_.name), alternatives(id, ids())));
  read_release(entry, id, value, pointer);
  const std::string what = "the entry of " + ticked(id);
  const auto time = [&](const char* key, int64_t& ns) {
    if (const auto read = read_time(schedule_, value, pointer, key, what)) ns = *read;
  };
  time("min_interval", entry.min_interval_ns);
  time("offset", entry.offset_ns);
  time("deadline", entry.deadline_ns);
  time("budget", entry.budget_ns);
  check_times(entry, id, pointer);
  read_word(value, "criticality", kCriticalities, entry.criticality);
  read_word(value, "on_overrun", kOnOverrun, entry.on_overrun);
  read_word(value, "on_miss", kOnMiss, entry.on_miss);
  read_word(value, "publish", kPublish, entry.publish);
  read_core(entry, id, value, pointer);
  read_memory(entry, id, value, pointer);
  if (claimed_.contains(id)) spec_.schedule.entries[id] = std::move(entry);
}

void Loader::read_core(ScheduleEntry& entry, const std::string& id, const json& value, const std::string& pointer) {
  if (!value.contains("core") || !value["core"].is_number_integer() || value["core"] < 0 || value["core"] > 1023)
    return;
  entry.core = value["core"].get<int>();
  const std::vector<int>& cores = spec_.schedule.cores;
  const Position at = schedule_.value_at(child(pointer, "core"));
  if (value.contains("on"))
    problem(at,
            fmt::format("`core` of {} goes with `rate` only; an `on` node runs where its producer does", ticked(id)));
  else if (!cores.empty() && std::find(cores.begin(), cores.end(), entry.core) == cores.end())
    problem(at, fmt::format("`core` of {} is {}, which is none of the schedule's; valid are: {}", ticked(id),
                            entry.core, fmt::join(cores, ", ")));
  else if (spec_.schedule.policy != Policy::fixed)
    spec_.adjusted.push_back(
        fmt::format("core {} of {} -> none: only under the policy fixed a node has a core of its own", entry.core, id));
}

void Loader::read_memory(ScheduleEntry& entry, const std::string& id, const json& value, const std::string& pointer) {
  if (!value.contains("memory") || !value["memory"].is_primitive()) return;
  const std::string at = child(pointer, "memory");
  const auto megabytes = parse_in_unit(schedule_.raw(at), "MB");
  if (megabytes && *megabytes >= 0 && *megabytes <= 1e6) entry.memory_bytes = std::llround(*megabytes * 1e6);
  else
    problem(schedule_.value_at(at),
            fmt::format("`memory` of {} {}", ticked(id),
                        megabytes ? "must lie between 0 MB and 1000000 MB" : megabytes.error()));
}

void Loader::read_release(ScheduleEntry& entry, const std::string& id, const json& value, const std::string& pointer) {
  const std::string rate = child(pointer, "rate");
  if (value.contains("rate") && (value["rate"].is_string() || value["rate"].is_number())) {
    const auto read = parse_rate(schedule_.raw(rate));
    if (read) entry.rate = *read;
    else problem(schedule_.value_at(rate), fmt::format("`rate` of {} {}", ticked(id), read.error()));
  }
  if (value.contains("on") && value["on"].is_string()) {
    const auto text = value["on"].get<std::string>();
    if (const size_t dot = text.find('.'); dot != std::string::npos)
      entry.on = PortName{text.substr(0, dot), text.substr(dot + 1)};
  }
  if (value.contains("every") && value["every"].is_number_integer() && value["every"] >= 1 &&
      value["every"] <= 1'000'000)
    entry.every = value["every"].get<int>();
  const bool rated = schedule_.marks.contains(rate), on = schedule_.marks.contains(child(pointer, "on"));
  if (rated && on)
    problem(schedule_.key_at(child(pointer, "on")),
            fmt::format("{} has both `rate` and `on`; keep one: `rate` releases it by the clock, `on` by a message",
                        ticked(id)));
  // A device may do without: its own rate in the graph then holds.
  const auto device =
      std::find_if(spec_.devices.begin(), spec_.devices.end(), [&](const auto& d) { return d.id == id; });
  if (!rated && !on && device == spec_.devices.end())
    problem(entry.position,
            fmt::format("{} has neither `rate` nor `on`; give it a rate in Hz (rate: 15) or a port that "
                        "releases it (on: id.port)",
                        ticked(id)));
  for (const char* key : {"every", "min_interval"})
    if (value.contains(key) && !on)
      problem(schedule_.key_at(child(pointer, key)),
              fmt::format("{} of {} goes with `on` only; leave it out, or lower the rate", ticked(key), ticked(id)));
  if (value.contains("offset") && on && !rated)
    problem(
        schedule_.key_at(child(pointer, "offset")),
        fmt::format("`offset` of {} goes with `rate` only; an `on` node starts when the message is there", ticked(id)));
}

void Loader::check_times(const ScheduleEntry& entry, const std::string& id, const std::string& pointer) {
  const auto wrong = [&](const char* key, const char* rule) {
    problem(schedule_at(id, key),
            fmt::format("{} of {} is {}; {}", ticked(key), ticked(id), schedule_.raw(child(pointer, key)), rule));
  };
  const auto given = [&](const char* key) { return schedule_.marks.contains(child(pointer, key)); };
  const auto readable = [&](const char* key) {
    return given(key) && parse_duration_ns(schedule_.raw(child(pointer, key))).has_value();
  };
  if (entry.offset_ns < 0) wrong("offset", "it must not be negative");
  if (entry.min_interval_ns < 0) wrong("min_interval", "it must not be negative");
  if (readable("deadline") && entry.deadline_ns <= 0) wrong("deadline", "it must be above 0");
  if (readable("budget") && entry.budget_ns <= 0) wrong("budget", "it must be above 0");
  // One job of a node at a time: with a deadline beyond the period two could be due at once (and SCHED_DEADLINE
  // takes no such reservation).
  if (entry.rate && entry.deadline_ns > entry.rate->period_ns())
    problem(schedule_at(id, "deadline"),
            fmt::format("`deadline` of {} is {}, longer than its period of {} ({}); shorten it or lower the rate",
                        ticked(id), schedule_.raw(child(pointer, "deadline")), duration_text(entry.rate->period_ns()),
                        rate_text(*entry.rate)));
}

void Loader::check_schedule() {
  if (!schedule_.root.is_object() || !schedule_.root.contains("nodes")) return;
  auto& entries = spec_.schedule.entries;
  for (const auto& device : spec_.devices) {
    const bool written = schedule_.marks.contains(entry_pointer(device.id));
    ScheduleEntry& entry = entries[device.id];
    if (!written) entry.position = device.position;
    if (entry.rate || entry.on) continue;
    // The device's own rate: it is then released as often as it delivers.
    entry.rate = device.rate;
    if (!device.rate && !graph_.marks.contains(child(child("/devices", device.id), "rate")) &&
        !schedule_.marks.contains(child(entry_pointer(device.id), "rate")))
      problem(device.position, fmt::format("device {} has no rate; give it one here (rate: 15) or in the schedule {}",
                                           ticked(device.id), ticked(spec_.schedule.file)));
  }
  for (const auto& node : spec_.nodes)
    if (!schedule_.marks.contains(entry_pointer(node.id)))
      problem(node.position,
              fmt::format("node {} has no entry in the schedule {}; give it a rate in Hz (rate: 15) or a "
                          "port that releases it (on: id.port) there",
                          ticked(node.id), ticked(spec_.schedule.file)));
  for (const auto& [id, entry] : entries)
    if (entry.on) check_on(id, entry);
  check_on_cycles();
}

void Loader::check_on(const std::string& id, const ScheduleEntry& entry) {
  const Position at = schedule_at(id, "on");
  const auto self = parts_.find(id), producer = parts_.find(entry.on->node);
  if (producer == parts_.end())
    return problem(
        at, fmt::format("`on` of {} is {}, but there is no node or device {}{}", ticked(id), ticked(entry.on->text()),
                        ticked(entry.on->node), alternatives(entry.on->node, ids())));
  if (producer->second.known && producer->second.output(entry.on->port) == nullptr)
    return problem(at, fmt::format("`on` of {} is {}, but {} has no output {}{}", ticked(id), ticked(entry.on->text()),
                                   ticked(entry.on->node), ticked(entry.on->port),
                                   alternatives(entry.on->port, producer->second.output_names(),
                                                "outputs of " + ticked(entry.on->node))));
  if (self == parts_.end()) return;
  std::vector<std::string> read;
  for (const auto& edge : *self->second.edges) {
    if (edge.from == *entry.on) return;
    read.push_back(edge.from.text());
  }
  if (self->second.sound)
    problem(at, fmt::format("`on` of {} is {}, which none of its inputs reads{}", ticked(id), ticked(entry.on->text()),
                            alternatives(entry.on->text(), read, "its inputs read")));
}

void Loader::check_on_cycles() {
  // Each entry follows at most one producer, so a walk along `on` ends or meets itself.
  std::set<std::string> done;
  for (const auto& [start, unused] : spec_.schedule.entries) {
    std::vector<std::string> walk;
    for (std::string id = start; !done.contains(id);) {
      const auto again = std::find(walk.begin(), walk.end(), id);
      if (again != walk.end()) {
        std::vector<std::string> cycle(again, walk.end());
        cycle.push_back(id);
        problem(schedule_at(id, "on"),
                fmt::format("cycle of `on` edges: {}; each waits for the next, so give one of them a rate",
                            join_words(cycle, " -> ")));
        break;
      }
      walk.push_back(id);
      const auto entry = spec_.schedule.entries.find(id);
      if (entry == spec_.schedule.entries.end() || !entry->second.on || entry->second.rate) break;
      id = entry->second.on->node;
    }
    done.insert(walk.begin(), walk.end());
  }
}

}  // namespace takt::graph
