// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/describe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "graph/attach/parameters.hpp"
#include "rt/abi.hpp"
#include "rt/record/message_record.hpp"
#include "rt/time/clock.hpp"

namespace takt::attach {
namespace {

using Json = nlohmann::ordered_json;

Json ms(int64_t ns) { return static_cast<double>(ns) / 1e6; }
Json ms_or_null(int64_t ns) { return ns > 0 ? ms(ns) : Json(nullptr); }
Json ms_or_null(std::optional<int64_t> ns) { return ns ? ms(*ns) : Json(nullptr); }

std::string name_of(const PortPlan& port) { return port.node + "." + port.port; }

std::string process_of(const Subject& subject, size_t task) {
  return task < subject.process_of.size() ? subject.processes[subject.process_of[task]] : "";
}

Json node_json(const Subject& subject, size_t t) {
  const TaskPlan& task = subject.plan.tasks[t];
  Json inputs = Json::array(), outputs = Json::array();
  for (const EdgePlan& edge : task.edges)
    inputs.push_back({{"name", task.node->inputs()[edge.input]->name()},
                      {"from", name_of(subject.plan.ports[edge.port])},
                      {"max_age_ms", ms_or_null(edge.max_age_ns)}});
  for (const size_t port : task.ports) outputs.push_back(name_of(subject.plan.ports[port]));
  return {{"name", task.name},
          {"type", type_of(subject, task.name)},
          {"device", task.device},
          {"process", process_of(subject, t)},
          {"rate_hz", task.rate ? Json(task.rate->hz()) : Json(nullptr)},
          {"on", task.on_port == kNone ? Json(nullptr) : Json(name_of(subject.plan.ports[task.on_port]))},
          {"deadline_ms", ms(task.deadline_ns)},
          {"budget_ms", ms_or_null(task.budget_ns)},
          {"criticality", to_string(task.criticality)},
          {"proven_ms", ms_or_null(subject.board.task(t).response_bound.bound_ns())},
          {"levels", task.node->levels().size()},
          {"inputs", inputs},
          {"outputs", outputs}};
}

Json port_json(const PortPlan& port) {
  return {{"name", name_of(port)},
          {"type", port.type->name},
          {"capacity", {port.capacity.width, port.capacity.height, port.capacity.channels, port.capacity.count}},
          {"layout", Json::parse(record::layout_of(*port.type))}};
}

const PortStatistics* statistics_of(const Subject& subject, const graph::PortName& name) {
  for (size_t p = 0; p < subject.plan.ports.size(); ++p)
    if (subject.plan.ports[p].node == name.node && subject.plan.ports[p].port == name.port)
      return &subject.board.port(p);
  return nullptr;  // the mode of the start leaves the node out
}

Json chain_json(const Subject& subject, const graph::ChainSpec& chain) {
  const PortStatistics* port = statistics_of(subject, chain.to);
  return {{"name", chain.name},
          {"from", chain.from.node + "." + chain.from.port},
          {"to", chain.to.node + "." + chain.to.port},
          {"bound_ms", ms(chain.max_age_ns)},
          {"proven_ms", port != nullptr ? ms_or_null(port->age_bound.bound_ns()) : Json(nullptr)}};
}

/// "0..0.5" in numbers, "sad | ssd" in words.
void add_range(const ParamBase& param, Json& to) {
  const std::string range = param.range_text();
  to["range"] = range;
  if (param.kind() == "choice")
    for (size_t at = 0; at != std::string::npos && at < range.size();) {
      const size_t end = range.find(" | ", at);
      to["choices"].push_back(range.substr(at, end == std::string::npos ? end : end - at));
      at = end == std::string::npos ? end : end + 3;
    }
  const size_t dots = range.find("..");
  if (dots == std::string::npos) return;
  const auto number = [](std::string_view text) -> Json {
    double value = 0;
    return std::from_chars(text.data(), text.data() + text.size(), value).ec == std::errc() ? Json(value)
                                                                                            : Json(nullptr);
  };
  to["least"] = number(std::string_view(range).substr(0, dots));
  to["most"] = number(std::string_view(range).substr(dots + 2));
}

Json parameters_of(const Subject& subject, const graph::NodeSpec& spec) {
  Json parameters = Json::array();
  const auto shell = subject.registry.nodes.find(spec.type)->make();
  for (const ParamBase* param : shell->params()) {
    const auto given = spec.params.find(std::string(param->name()));
    Json entry{{"node", spec.id},
               {"param", param->name()},
               {"unit", param->unit()},
               {"kind", param->kind()},
               {"live", param->fixed().empty() && param->unit() != kPath},
               {"fixed", param->fixed()},
               {"help", param->doc()},
               {"default", param->value_text()},
               {"value", param->value_text()}};
    if (given != spec.params.end())
      entry["value"] = std::visit([](const auto& value) { return Json(value); }, given->second.value);
    add_range(*param, entry);
    parameters.push_back(std::move(entry));
  }
  return parameters;
}

double seconds(const Subject& subject, int64_t at_ns) {
  const int64_t epoch_ns = subject.board.epoch_ns().load();
  return epoch_ns > 0 ? static_cast<double>(at_ns - epoch_ns) / 1e9 : 0.0;
}

Json device_json(const TaskPlan& task, const SourceRecord& source) {
  const SourceCounts counts = source.counts();
  return {{"name", task.name},
          {"state", to_text(source.state.load())},
          {"losses", source.losses.load()},
          {"received", counts.received},
          {"damaged", counts.damaged},
          {"resyncs", counts.resyncs},
          {"missing", counts.missing},
          {"unsent", counts.unsent},
          {"trouble", source.trouble.text()}};
}

const char* word(uint32_t state) {
  constexpr std::array<const char*, ProcessRecord::kStates> kWords{"starting", "composed", "joined",  "agreed",
                                                                   "running",  "saving",   "finished"};
  return state < kWords.size() ? kWords[state] : "unknown";
}

Json processes_json(const Subject& subject) {
  if (subject.processes.empty())
    return Json::array({{{"name", "all"}, {"pid", subject.run}, {"state", "running"}, {"restarts", 0}}});
  Json processes = Json::array({{{"name", "supervisor"}, {"pid", subject.run}, {"state", "running"}, {"restarts", 0}}});
  for (size_t p = 0; p < subject.processes.size(); ++p) {
    const ProcessRecord& process = subject.board.process(p);
    processes.push_back({{"name", subject.processes[p]},
                         {"pid", process.pid.load()},
                         {"state", word(process.state.load())},
                         {"restarts", process.restarts.load()}});
  }
  return processes;
}

}  // namespace

std::string type_of(const Subject& subject, const std::string& id) {
  for (const graph::NodeSpec& node : subject.graph.nodes)
    if (node.id == id) return node.type;
  for (const graph::DeviceSpec& device : subject.graph.devices)
    if (device.id == id) return device.kind;
  return "";
}

Json describe_json(const Subject& subject) {
  Json nodes = Json::array(), ports = Json::array(), chains = Json::array(), modes = Json::array(),
       parameters = Json::array();
  for (size_t t = 0; t < subject.plan.tasks.size(); ++t) nodes.push_back(node_json(subject, t));
  for (const PortPlan& port : subject.plan.ports) ports.push_back(port_json(port));
  for (const graph::ChainSpec& chain : subject.graph.chains) chains.push_back(chain_json(subject, chain));
  for (const ModePlan& mode : subject.plan.modes) modes.push_back(mode.name);
  for (const graph::NodeSpec& spec : subject.graph.nodes)
    for (Json& parameter : parameters_of(subject, spec)) parameters.push_back(std::move(parameter));
  return {{"name", subject.graph.name},
          {"profile", subject.graph.profile},
          {"schedule", subject.graph.schedule.name},
          {"policy", to_string(subject.plan.policy)},
          {"transport", subject.transport.name()},
          {"version", fmt::format("takt {} (commit {})", version().number, version().commit)},
          {"pid", subject.run},
          {"cores", subject.plan.cores},
          {"modes", modes},
          {"processes", subject.processes},
          {"frozen_folder", subject.frozen_folder.string()},
          {"replay_of", subject.replay_of},
          {"nodes", nodes},
          {"ports", ports},
          {"chains", chains},
          {"parameters", parameters}};
}

Json state_json(const Subject& subject) {
  const int64_t now_ns = MonotonicClock().now_ns();
  Json nodes = Json::array(), devices = Json::array(), chains = Json::array();
  for (size_t t = 0; t < subject.plan.tasks.size(); ++t) {
    const TaskStatistics& s = subject.board.task(t);
    nodes.push_back({{"completed", s.completed.load()},
                     {"deadline_misses", s.deadline_misses.load()},
                     {"skipped", s.skipped.load()},
                     {"paused", s.paused.load()},
                     {"overruns", s.budget_overruns.load()},
                     {"level", s.last_level.load()},
                     {"exec_ms", ms(s.last_exec_ns.load())},
                     {"response_ms", ms(s.last_response_ns.load())},
                     {"response_max_ms", ms(s.largest_response_ns.load())}});
    if (subject.plan.tasks[t].device) devices.push_back(device_json(subject.plan.tasks[t], subject.board.source(t)));
  }
  for (const graph::ChainSpec& chain : subject.graph.chains) {
    const PortStatistics* port = statistics_of(subject, chain.to);
    const bool any = port != nullptr && port->largest_age_ns.load() > 0;
    chains.push_back({{"age_ms", any ? ms(port->last_age_ns.load()) : Json(nullptr)},
                      {"age_max_ms", any ? ms(port->largest_age_ns.load()) : Json(nullptr)}});
  }
  const uint32_t mode = subject.board.mode_at(now_ns);
  return {{"running_s", std::max(0.0, seconds(subject, now_ns))},
          {"mode", mode < subject.plan.modes.size() ? subject.plan.modes[mode].name : subject.plan.mode},
          {"nodes", nodes},
          {"devices", devices},
          {"chains", chains},
          {"processes", processes_json(subject)},
          {"parameters", parameters_json(subject.registry.nodes, subject.graph, subject.plan, subject.board)},
          {"frozen", subject.frozen ? subject.frozen() : std::vector<std::string>{}}};
}

JobsSince::JobsSince(const Subject& subject) : subject_(subject) {
  for (size_t t = 0; t < subject.plan.tasks.size(); ++t) taken_.push_back(subject.board.task(t).job_count.load());
}

Json JobsSince::take() {
  Json jobs = Json::array();
  for (size_t t = 0; t < taken_.size(); ++t) {
    const TaskStatistics& s = subject_.board.task(t);
    const uint64_t count = s.job_count.load(std::memory_order_acquire);
    // The oldest one may be written over while it is read.
    uint64_t n = std::max(taken_[t], count - std::min<uint64_t>(count, s.jobs.size() - 1));
    for (; n < count; ++n) {
      const JobRecord job = s.jobs[n % s.jobs.size()];
      jobs.push_back({t, seconds(subject_, job.release_ns), seconds(subject_, job.start_ns),
                      seconds(subject_, job.finish_ns), job.cpu});
    }
    taken_[t] = count;
  }
  return jobs;
}

}  // namespace takt::attach
