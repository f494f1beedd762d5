// SPDX-License-Identifier: Apache-2.0
// What the runs of a graph keep of themselves (`record`).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "graph/language/loader.hpp"
#include "graph/language/quantity.hpp"

namespace takt::graph {

using nlohmann::json;

void Loader::read_record() {
  const json record = graph_.root.value("record", json());
  if (!record.is_object()) return;
  RecordSpec& spec = spec_.record;
  spec.position = graph_.value_at("/record");
  spec.ring = !record.contains("ring") || record["ring"] != json(false);
  read_record_size(record, "disk", 16, spec.disk_bytes);
  read_record_size(record, "memory", 0, spec.memory_bytes);
  read_record_size(record, "frozen", 1, spec.frozen_bytes);
  const auto time = [&](std::string_view key, int64_t least_ns, int64_t& into) {
    const auto ns = read_time(graph_, record, "/record", key, "`record`");
    if (!ns) return;
    if (*ns >= least_ns) into = *ns;
    else
      problem(graph_.value_at(child("/record", key)),
              fmt::format("{} of `record` is {}; it must be at least {} s", ticked(key),
                          graph_.raw(child("/record", key)), least_ns / 1'000'000'000));
  };
  time("keep", 1'000'000'000, spec.keep_ns);
  time("before", 0, spec.before_ns);
  time("after", 0, spec.after_ns);
  if (record.contains("snapshots") && graph_.raw("/record/snapshots") == "none") spec.snapshot_ns = 0;
  else time("snapshots", 1'000'000'000, spec.snapshot_ns);
  const json freeze = record.value("freeze", json::array());
  for (size_t i = 0; freeze.is_array() && i < freeze.size(); ++i)
    if (auto condition = read_plain_condition(freeze[i], child("/record/freeze", i)))
      spec.freeze.push_back(std::move(*condition));
  const json ports = record.value("ports", json::object());
  if (!ports.is_object()) return;
  for (const auto& [name, ignored] : ports.items()) read_record_port(name);
}

void Loader::read_record_size(const json& value, std::string_view key, int64_t least_mb, int64_t& bytes) {
  if (!value.contains(key) || !value[std::string(key)].is_primitive()) return;
  const std::string at = child("/record", key);
  const auto megabytes = parse_in_unit(graph_.raw(at), "MB");
  if (megabytes && *megabytes >= static_cast<double>(least_mb) && *megabytes <= 1e9) {
    bytes = std::llround(*megabytes * 1e6);
    return;
  }
  problem(graph_.value_at(at),
          fmt::format("{} of `record` {}", ticked(key),
                      megabytes ? fmt::format("must be at least {} MB", least_mb) : megabytes.error()));
}

/// `all`, `hash`, `none`, `every 5`, or a time: one message with all fields in so much of it.
void Loader::read_record_port(const std::string& name) {
  const std::string at = child("/record/ports", name);
  const size_t dot = std::min(name.find('.'), name.size());
  RecordSpec::Port given;
  given.port = {name.substr(0, dot), name.substr(std::min(name.size(), dot + 1))};
  given.position = graph_.key_at(at);
  const auto part = parts_.find(given.port.node);
  if (part == parts_.end())
    return problem(given.position,
                   fmt::format("`record` has a rule for {}, but there is no node or device {}{}", ticked(name),
                               ticked(given.port.node), alternatives(given.port.node, ids())));
  if (!part->second.known) return;
  if (part->second.output(given.port.port) == nullptr)
    return problem(given.position, fmt::format("`record` has a rule for {}, but {} has no output {}{}", ticked(name),
                                               ticked(given.port.node), ticked(given.port.port),
                                               alternatives(given.port.port, part->second.output_names(),
                                                            "outputs of " + ticked(given.port.node))));
  const std::string word = graph_.raw(at);
  constexpr std::string_view kEvery = "every ";
  if (word == "none") given.rule.keep = record::PortRule::nothing;
  else if (word == "hash") given.rule.keep = record::PortRule::hash;
  else if (word.starts_with(kEvery)) {
    const auto count = parse_in_unit(std::string_view(word).substr(kEvery.size()), "1");
    if (!count || *count < 1 || *count > 1e6 || *count != std::floor(*count))
      return problem(graph_.value_at(at), fmt::format("{} of `record` is {}; `every` takes a whole number from 1 to "
                                                      "1000000, as in `every 5`",
                                                      ticked(name), ticked(word)));
    given.rule.every = static_cast<uint32_t>(*count);
  } else if (word != "all") {
    const auto pause_ns = parse_duration_ns(word);
    if (!pause_ns || *pause_ns <= 0)
      return problem(graph_.value_at(at),
                     fmt::format("{} of `record` is {}; valid: all, hash, none, `every N`, or a time such as 1s",
                                 ticked(name), ticked(word)));
    given.rule.pause_ns = *pause_ns;
  }
  spec_.record.ports.push_back(std::move(given));
}

}  // namespace takt::graph
