// SPDX-License-Identifier: Apache-2.0
// What the runs of a graph keep of themselves (`record`).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "graph/language/loader.hpp"
#include "graph/language/quantity.hpp"
#include "rt/record/picture_codec.hpp"

namespace takt::graph {

using nlohmann::json;

namespace {

/// What follows `word` and a blank as a whole number from 1 to `most`; nothing if it is none.
std::optional<uint32_t> number_after(std::string_view text, std::string_view word, double most) {
  if (!text.starts_with(word) || !text.substr(word.size()).starts_with(' ')) return std::nullopt;
  const auto number = parse_in_unit(text.substr(word.size()), "1");
  if (!number || *number < 1 || *number > most || *number != std::floor(*number)) return std::nullopt;
  return static_cast<uint32_t>(*number);
}

/// Takes one word of a port's rule in; what is wrong with it, or "".
std::string read_record_rule(std::string_view word, record::PortRule& rule) {
  constexpr uint8_t kJpegQuality = 85;
  if (word == "none") rule.keep = record::PortRule::nothing;
  else if (word == "hash") rule.keep = record::PortRule::hash;
  else if (word == "jpeg") rule.jpeg = kJpegQuality;
  else if (word.starts_with("jpeg ")) {
    const auto quality = number_after(word, "jpeg", 100);
    if (!quality) return "`jpeg` takes a quality from 1 to 100, as in `jpeg 85`";
    rule.jpeg = static_cast<uint8_t>(*quality);
  } else if (word.starts_with("every ")) {
    const auto every = number_after(word, "every", 1e6);
    if (!every) return "`every` takes a whole number from 1 to 1000000, as in `every 5`";
    rule.every = *every;
  } else if (word != "all") {
    const auto pause_ns = parse_duration_ns(word);
    if (!pause_ns || *pause_ns <= 0)
      return "valid: all, hash, none, `every N`, a time such as 1s, `jpeg` or `jpeg QUALITY`, or several of these with "
             "commas between them";
    rule.pause_ns = *pause_ns;
  }
  return "";
}

}  // namespace

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
  const PortInfo* port = part->second.output(given.port.port);
  if (port == nullptr)
    return problem(given.position, fmt::format("`record` has a rule for {}, but {} has no output {}{}", ticked(name),
                                               ticked(given.port.node), ticked(given.port.port),
                                               alternatives(given.port.port, part->second.output_names(),
                                                            "outputs of " + ticked(given.port.node))));
  const std::string text = graph_.raw(at);
  for (size_t from = 0; from <= text.size();) {
    const size_t comma = std::min(text.find(',', from), text.size());
    std::string_view word = std::string_view(text).substr(from, comma - from);
    while (word.starts_with(' ')) word.remove_prefix(1);
    while (word.ends_with(' ')) word.remove_suffix(1);
    if (const std::string wrong = read_record_rule(word, given.rule); !wrong.empty())
      return problem(graph_.value_at(at), fmt::format("{} of `record` is {}; {}", ticked(name), ticked(word), wrong));
    from = comma + 1;
  }
  if (given.rule.keep != record::PortRule::all && text.find(',') != std::string::npos)
    return problem(graph_.value_at(at),
                   fmt::format("{} of `record` is {}; `none` and `hash` stand alone", ticked(name), ticked(text)));
  if (given.rule.jpeg > 0 && port->type != nullptr && !record::may_have_pictures(port->type->fields))
    return problem(graph_.value_at(at), fmt::format("{} of `record` is {}, but its messages ({}) have no pictures",
                                                    ticked(name), ticked(text), port->type->name));
  spec_.record.ports.push_back(std::move(given));
}

}  // namespace takt::graph
