// SPDX-License-Identifier: Apache-2.0
#include "graph/log/log_content.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>

#include "graph/log/cut_log.hpp"
#include "graph/log/recorded_type.hpp"
#include "rt/record/recorder.hpp"

namespace takt::log {
namespace {

using record::LogFile;
using record::RecordedJob;

Json plan_of(const LogFile& log) { return Json::parse(log.attached("plan.json").value_or("")); }

uint64_t count(const mcap::Metadata& facts, const char* name) {
  return std::strtoull(fact(facts, name).c_str(), nullptr, 10);
}

/// Channels of ports by topic.
std::vector<mcap::Channel> port_channels(const LogFile& log) {
  std::vector<mcap::Channel> channels;
  for (const mcap::Channel& channel : log.container().channels())
    if (LogFile::of_a_port(channel)) channels.push_back(channel);
  std::sort(channels.begin(), channels.end(),
            [](const mcap::Channel& a, const mcap::Channel& b) { return a.topic < b.topic; });
  return channels;
}

/// Those of the plan: another writer may leave out a channel without messages.
std::set<std::string> planned_ports(const LogFile& log) {
  std::set<std::string> ports;
  const Json plan = Json::parse(log.attached("plan.json").value_or(""), nullptr, false);
  if (plan.is_object() && plan.contains("ports"))
    for (const Json& port : plan["ports"]) ports.insert(port.value("name", ""));
  return ports;
}

std::vector<const RecordedJob*> sorted_jobs(const LogFile& log) {
  std::vector<const RecordedJob*> jobs;
  for (const RecordedJob& job : log.jobs()) jobs.push_back(&job);
  std::stable_sort(jobs.begin(), jobs.end(), [](const RecordedJob* a, const RecordedJob* b) {
    return std::pair(a->task, a->index) < std::pair(b->task, b->index);
  });
  return jobs;
}

void append(std::vector<std::byte>& to, std::string_view words) {
  const mcap::Bytes bytes = mcap::bytes_of(words);
  to.insert(to.end(), bytes.begin(), bytes.end());
}

/// First release to last publication, s.
double span_s(const LogFile& log) {
  int64_t first = INT64_MAX, last = INT64_MIN;
  for (const RecordedJob& job : log.jobs()) {
    first = std::min(first, job.release_ns);
    last = std::max(last, job.published_ns);
  }
  return last > first ? static_cast<double>(last - first) / 1e9 : 0;
}

struct NodeFigures {
  uint64_t jobs = 0, late = 0, degraded = 0, cut_off = 0, restarts = 0;
  std::vector<int64_t> exec_ns, age_ns;
};

double median_ms(std::vector<int64_t>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle) / 1e6;
}

/// By node in the order of the plan; ages are those of the newest message of each edge at the start of the job.
std::vector<std::pair<std::string, NodeFigures>> figures(const LogFile& log) {
  const Json plan = plan_of(log);
  std::vector<std::pair<std::string, NodeFigures>> all;
  std::vector<std::vector<uint16_t>> channels;  // by task and edge
  for (const Json& task : plan.at("tasks")) {
    all.push_back({task.at("name").get<std::string>(), {}});
    channels.emplace_back();
    for (const Json& edge : task.at("edges"))
      channels.back().push_back(log.channel(edge.at("from").get<std::string>()));
  }
  for (const RecordedJob& job : log.jobs()) {
    if (job.task >= all.size()) continue;
    NodeFigures& node = all[job.task].second;
    if (job.cut_off) {
      ++node.cut_off;
      continue;
    }
    ++node.jobs;
    node.late += job.late ? 1 : 0;
    node.degraded += job.level > 0 ? 1 : 0;
    node.exec_ns.push_back(job.cpu_ns);
    for (const RecordedJob::Input& input : job.inputs) {
      if (input.held.empty() || input.edge >= channels[job.task].size()) continue;
      const auto& messages = log.messages(channels[job.task][input.edge]);
      const auto newest = messages.find(input.held.back().first + input.held.back().count - 1);
      if (newest != messages.end()) node.age_ns.push_back(job.start_ns - newest->second.stamp_ns);
    }
  }
  for (const record::RecordedEvent& event : log.events())
    if (event.task < all.size()) all[event.task].second.restarts += std::holds_alternative<record::Restart>(event.what);
  return all;
}

std::string schema_name(const LogFile& log, const mcap::Channel& channel) {
  const mcap::Schema* schema = schema_of(log, channel);
  return schema == nullptr ? "" : schema->name;
}

/// The first field in which two messages of one channel differ, where both are there with all fields.
std::string where_they_part(LogFile& from, LogFile& to, const mcap::Channel& channel, uint64_t sequence) {
  const auto reference = from.message(channel.id, sequence), other = to.message(to.channel(channel.topic), sequence);
  if (!reference || !other) return "";
  if (reference->stamp_ns != other->stamp_ns)
    return fmt::format(": stamp {} instead of {}", other->stamp_ns, reference->stamp_ns);
  if (!reference->whole || !other->whole) return ": by its hash";
  const auto type = type_of(from, channel), other_type = type_of(to, *channel_of(to, channel.topic));
  if (!type || !other_type) return ": " + (type ? other_type.error() : type.error());
  if (!type->same_fields(other_type->fields())) return fmt::format(": {} has other fields in the second", type->name());
  const auto part = record::first_difference(type->fields(), reference->data, other->data);
  return part ? fmt::format(": {} (byte {}) is {}", part->field, part->byte, part->values) : "";
}

void compare_channel(LogFile& from, LogFile& to, const mcap::Channel& channel, LogDifference& result) {
  const auto &a = from.messages(channel.id), &b = to.messages(to.channel(channel.topic));
  result.messages += a.size() + b.size();
  uint64_t both = 0, different = 0, first = 0;
  for (const auto& [sequence, known] : a) {
    const auto other = b.find(sequence);
    if (other == b.end()) continue;
    ++both;
    if (other->second.hash == known.hash && other->second.stamp_ns == known.stamp_ns) continue;
    if (different++ == 0) first = sequence;
  }
  if (different == 0 && a.size() == b.size() && both == a.size()) return;
  result.same = false;
  std::string line = fmt::format("{}: {} of {} common messages differ", channel.topic, different, both);
  if (a.size() != both || b.size() != both)
    line += fmt::format(", {} only in the first, {} only in the second", a.size() - both, b.size() - both);
  if (different > 0) line += fmt::format("; first {}{}", first, where_they_part(from, to, channel, first));
  result.lines.push_back(line);
}

/// What `takt log serve` could not send.
Json gaps_of(const LogFile& log) {
  Json gaps = Json::array();
  for (const auto& one : log.container().metadata()) {
    if (one.name != "takt gap") continue;
    const auto at_s = [&](const char* key) {
      return static_cast<double>(static_cast<int64_t>(count(one.map, key)) - epoch_ns(log)) / 1e9;
    };
    gaps.push_back({{"from_s", at_s("from_ns")}, {"to_s", at_s("to_ns")}, {"what", fact(one.map, "what")}});
  }
  return gaps;
}

/// How often each kind of event happened, and the restarts one by one.
std::map<std::string, uint64_t> event_counts(const LogFile& log) {
  std::map<std::string, uint64_t> counts;
  for (const record::RecordedEvent& event : log.events()) ++counts[record::name_of(event.kind)];
  return counts;
}

/// Also where they are the same in number: what they say may differ.
void compare_events(const LogFile& from, const LogFile& to, LogDifference& result) {
  if (from.events() == to.events()) return;
  result.same = false;
  auto before = event_counts(from), after = event_counts(to);
  for (const auto& [kind, count] : after) before.try_emplace(kind, 0);
  for (const auto& [kind, count] : before)
    if (count != after[kind]) result.lines.push_back(fmt::format("events: {} {} -> {}", kind, count, after[kind]));
  const auto [x, y] = std::mismatch(from.events().begin(), from.events().end(), to.events().begin(), to.events().end());
  const auto& first = x != from.events().end() ? *x : *y;
  result.lines.push_back(fmt::format("events: the first that differs is number {} ({})", x - from.events().begin() + 1,
                                     record::name_of(first.kind)));
}

void compare_jobs(const LogFile& from, const LogFile& to, LogDifference& result) {
  const auto a = sorted_jobs(from), b = sorted_jobs(to);
  const bool same = std::equal(a.begin(), a.end(), b.begin(), b.end(),
                               [](const RecordedJob* x, const RecordedJob* y) { return *x == *y; });
  if (same) return;
  result.same = false;
  auto before = figures(from), after = figures(to);
  const double from_s = std::max(span_s(from), 1e-9), to_s = std::max(span_s(to), 1e-9);
  for (auto& [name, now] : after) {
    const auto then = std::find_if(before.begin(), before.end(), [&n = name](const auto& x) { return x.first == n; });
    if (then == before.end()) {
      result.lines.push_back(name + ": only in the second");
      continue;
    }
    NodeFigures& was = then->second;
    result.lines.push_back(fmt::format(
        "{}: {:.2f} Hz -> {:.2f} Hz, late {} -> {}, degraded {} -> {}, exec p50 {:.2f} -> {:.2f} ms, input age p50 "
        "{:.1f} -> {:.1f} ms",
        name, static_cast<double>(was.jobs) / from_s, static_cast<double>(now.jobs) / to_s, was.late, now.late,
        was.degraded, now.degraded, median_ms(was.exec_ns), median_ms(now.exec_ns), median_ms(was.age_ns),
        median_ms(now.age_ns)));
  }
}

}  // namespace

std::string fact(const mcap::Metadata& facts, const std::string& name) {
  const auto found = facts.find(name);
  return found == facts.end() ? "" : found->second;
}

std::string content_hash(const LogFile& log) {
  std::vector<std::byte> all;
  append(all, log.attached("plan.json").value_or(""));
  append(all, log.attached("assets.json").value_or(""));
  std::set<std::string> ports = planned_ports(log);
  for (const mcap::Channel& channel : port_channels(log)) ports.insert(channel.topic);
  for (const std::string& port : ports) {
    append(all, port);
    for (const auto& [sequence, known] : log.messages(log.channel(port))) {
      const uint64_t numbers[]{sequence, static_cast<uint64_t>(known.stamp_ns), known.hash};
      const auto bytes = std::as_bytes(std::span(numbers));
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
  }
  for (const RecordedJob* job : sorted_jobs(log)) record::pack(*job, all, log.format());
  for (const record::RecordedEvent& event : log.events()) record::pack(event, all);
  return fmt::format("{:016x}", record::hash_of(all));
}

Json content_json(LogFile& log) {
  const mcap::Metadata &facts = log.facts(), &end = log.end();
  Json channels = Json::array();
  for (const mcap::Channel& channel : port_channels(log)) {
    const auto& messages = log.messages(channel.id);
    const uint64_t first = messages.empty() ? 0 : messages.begin()->first;
    const uint64_t last = messages.empty() ? 0 : messages.rbegin()->first;
    uint64_t bytes = 0;
    for (const auto& [sequence, known] : messages) bytes += known.size;
    channels.push_back({{"port", channel.topic},
                        {"type", schema_name(log, channel)},
                        {"messages", messages.size()},
                        {"missing", messages.empty() ? 0 : last - first + 1 - messages.size()},
                        {"fields", channel.metadata.contains("fields") ? channel.metadata.at("fields") : ""},
                        {"mb", static_cast<double>(bytes) / 1e6}});
  }
  Json nodes = Json::array();
  for (auto& [name, node] : figures(log))
    nodes.push_back({{"name", name},
                     {"jobs", node.jobs},
                     {"late", node.late},
                     {"degraded", node.degraded},
                     {"cut_off", node.cut_off},
                     {"restarts", node.restarts}});
  Json lost;
  if (end.contains("lost_overwritten"))
    lost = {{"overwritten", count(end, "lost_overwritten")},
            {"no_room", count(end, "lost_no_room")},
            {"not_written", count(end, "lost_not_written")},
            {"jobs", count(end, "lost_jobs")},
            {"threads", count(end, "lost_threads")}};
  return {{"facts", facts},
          {"end", end},
          {"duration_s", span_s(log)},
          {"nodes", nodes},
          {"ports", channels},
          {"events", event_counts(log)},
          {"format", log.format()},
          {"lost", lost},
          {"gaps", gaps_of(log)},
          {"damages", log.damages()},
          {"left_out", log.left_out()},
          {"hash", content_hash(log)}};
}

std::string content_text(const Json& content) {
  const Json& facts = content["facts"];
  const auto word = [&](const char* key) { return facts.value(key, ""); };
  std::string text = fmt::format("{} on {}, profile {}, {} clock, {}, commit {}, SIMD {}\n{:.1f} s of jobs\n",
                                 word("graph"), word("schedule"), word("profile"), word("clock"),
                                 word("isolation") == "none" ? "one process" : "a process per subsystem",
                                 word("commit"), word("simd"), content["duration_s"].get<double>());
  if (facts.contains("cut")) text += "cut: " + word("cut") + "\n";
  text += fmt::format("\n{:<34}{:<24}{:>9}{:>9}{:>10}  {}\n", "port", "type", "messages", "missing", "MB", "fields");
  for (const Json& port : content["ports"])
    text += fmt::format("{:<34}{:<24}{:>9}{:>9}{:>10.1f}  {}\n", port["port"].get<std::string>(),
                        port["type"].get<std::string>(), port["messages"].get<uint64_t>(),
                        port["missing"].get<uint64_t>(), port["mb"].get<double>(), port["fields"].get<std::string>());
  text +=
      fmt::format("\n{:<34}{:>9}{:>9}{:>10}{:>9}{:>10}\n", "node", "jobs", "late", "degraded", "cut off", "restarts");
  for (const Json& node : content["nodes"])
    text += fmt::format("{:<34}{:>9}{:>9}{:>10}{:>9}{:>10}\n", node["name"].get<std::string>(),
                        node["jobs"].get<uint64_t>(), node["late"].get<uint64_t>(), node["degraded"].get<uint64_t>(),
                        node["cut_off"].get<uint64_t>(), node["restarts"].get<uint64_t>());
  if (content["format"] == 1) text += "\nformat 1: restarts and other events are not in it\n";
  std::string events;
  for (const auto& [kind, number] : content["events"].items())
    events += fmt::format("{}{} {}", events.empty() ? "\nevents: " : ", ", number.get<uint64_t>(), kind);
  if (!events.empty()) text += events + "\n";
  const Json& lost = content["lost"];
  if (lost.is_null()) text += "\nthe record lacks the end of its run: what was lost is not known\n";
  else
    text += fmt::format(
        "\nlost: {} messages overwritten, {} records found the queue full, {} not written, {} jobs "
        "incomplete, {} threads unheard\n",
        lost["overwritten"].get<uint64_t>(), lost["no_room"].get<uint64_t>(), lost["not_written"].get<uint64_t>(),
        lost["jobs"].get<uint64_t>(), lost["threads"].get<uint64_t>());
  for (const Json& gap : content["gaps"])
    text += fmt::format("gap from {:.3f} to {:.3f} s: {}\n", gap["from_s"].get<double>(), gap["to_s"].get<double>(),
                        gap["what"].get<std::string>());
  for (const Json& damage : content["damages"]) text += "not whole: " + damage.get<std::string>() + "\n";
  for (const Json& left : content["left_out"]) text += "left out: " + left.get<std::string>() + "\n";
  return text + "content " + content["hash"].get<std::string>() + "\n";
}

LogDifference difference(LogFile& from, LogFile& to) {
  LogDifference result;
  compare_jobs(from, to, result);
  compare_events(from, to, result);
  // Another writer may leave out a channel without messages.
  const auto only_in = [&](const LogFile& log, const mcap::Channel& channel, const char* which) {
    if (log.messages(channel.id).empty()) return;
    result.same = false;
    result.lines.push_back(fmt::format("{}: only in the {}", channel.topic, which));
  };
  for (const mcap::Channel& channel : port_channels(from)) {
    if (to.channel(channel.topic) != 0) compare_channel(from, to, channel, result);
    else only_in(from, channel, "first");
  }
  for (const mcap::Channel& channel : port_channels(to))
    if (from.channel(channel.topic) == 0) only_in(to, channel, "second");
  return result;
}

}  // namespace takt::log
