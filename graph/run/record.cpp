// SPDX-License-Identifier: Apache-2.0
#include "graph/run/record.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>

#include "graph/flight/places.hpp"
#include "graph/language/registry.hpp"
#include "graph/language/words.hpp"
#include "graph/log/recorded_plan.hpp"
#include "graph/run/machine.hpp"
#include "graph/run/outputs.hpp"
#include "rt/abi.hpp"
#include "rt/machine/limits.hpp"

namespace takt::command {
namespace {

/// As long may the thread that copies messages be kept from running before one is overwritten.
constexpr int64_t kUndisturbedNs = 250'000'000;
/// Outputs whose messages are smaller are recorded with all fields.
constexpr uint64_t kSmallBytes = 64 * 1024;

/// By port. Those of devices always have all fields, or nothing could be replayed; pictures as the graph says.
std::vector<record::PortRule> port_rules(const Plan& plan, const std::vector<std::string>& also,
                                         const graph::RecordSpec& spec) {
  const auto named = [&](const std::string& name) { return std::find(also.begin(), also.end(), name) != also.end(); };
  std::vector<record::PortRule> rules(plan.ports.size());
  for (size_t p = 0; p < plan.ports.size(); ++p)
    if (plan.ports[p].chunk_bytes() > kSmallBytes && !named("all") &&
        !named(plan.ports[p].node + "." + plan.ports[p].port))
      rules[p].keep = record::PortRule::hash;
  for (const TaskPlan& task : plan.tasks) {
    for (const size_t port : task.ports)
      if (task.device || is_state_port(task, port)) rules[port].keep = record::PortRule::all;
  }
  for (size_t p = 0; p < plan.ports.size(); ++p)
    if (const record::PortRule* rule = flight::rule_of(spec, plan.ports[p])) rules[p].jpeg = rule->jpeg;
  return rules;
}

/// Behind all lanes, before all that is ordinary. Beside workers that are ordinary themselves a recorder is one of
/// them.
int priority_on(const Plan& plan) { return plan.policy != Policy::cooperative ? kLowestPriority : 0; }

/// What a replay gives to --set: kept values first, since --set of the command line wins.
std::string settings(const RunOptions& options, const graph::GraphSpec& graph) {
  std::vector<std::string> lines;
  for (const auto& value : graph.kept.values) lines.push_back(value.name + "=" + value.text);
  lines.insert(lines.end(), options.load.set.begin(), options.load.set.end());
  return fmt::format("{}", fmt::join(lines, "\n"));
}

/// "NAME HASH", a line for each.
std::string plugins(const RunOptions& options) {
  std::string lines;
  for (const auto& plugin : options.load.plugins) lines += fmt::format("{} {}\n", plugin.name, plugin.hash);
  return lines;
}

std::string absolute(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::absolute(file, error).string();
}

}  // namespace

bool keeps_ring(const RunOptions& options, const graph::GraphSpec& graph) {
  return options.ring == "on" ||
         (options.ring == "auto" && options.clock != "virtual" && options.witness == nullptr && graph.record.ring);
}

Observers observers(const RunOptions& options, const graph::GraphSpec& graph) {
  const uint32_t followers = (options.record.empty() ? 0u : 1u) +
                             (options.keep_ring ? flight::FlightRecorder::kFollowers : 0u) + (graph.expect ? 1u : 0u) +
                             (options.witness ? 1u : 0u) + (graph.exported.empty() ? 0u : 1u);
  return {1, followers, kUndisturbedNs};
}

RunRecord::RunRecord(const Registry& registry, const RunOptions& options, const Plan& plan)
    : registry_(registry), options_(options) {
  std::vector<std::string> names;
  for (const PortPlan& port : plan.ports) names.push_back(port.node + "." + port.port);
  for (const std::string& name : options_.record_ports)
    if (name != "all" && std::find(names.begin(), names.end(), name) == names.end())
      throw std::invalid_argument(fmt::format("--record-port {}: there is no such output{}", graph::ticked(name),
                                              graph::alternatives(name, names, "outputs of this graph")));
}

void RunRecord::begin(const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board, Transport& transport,
                      const std::string& isolation, std::vector<std::string> processes) {
  if (!listens()) return;
  const record::Head head = head_of(graph, plan, transport, isolation);
  if (wanted()) begin_file(graph.record, plan, board, transport, head);
  if (!options_.keep_ring) return;
  flight::FlightRecorder::Options how;
  how.folder = options_.output / "flight";
  how.processes = std::move(processes);
  how.by_caller = options_.clock == "virtual";
  how.priority = priority_on(plan);
  how.say = [](const std::string& line) { std::fprintf(stderr, "takt: %s\n", line.c_str()); };
  try {
    flight_ = std::make_unique<flight::FlightRecorder>(graph, plan, board, transport, head, std::move(how));
  } catch (const std::exception& problem) {  // no thread, no memory: the run is worth more
    std::fprintf(stderr, "takt: adjusted: no ring: %s\n", machine::explain(problem).c_str());
    return;
  }
  if (!flight_->lacks().empty()) std::fprintf(stderr, "takt: adjusted: no ring: %s\n", flight_->lacks().c_str());
  for (const std::string& doubt : flight_->doubts()) std::fprintf(stderr, "takt: note: %s\n", doubt.c_str());
}

std::filesystem::path RunRecord::frozen_folder() const {
  return flight_ ? std::filesystem::absolute(flight_->frozen_folder()) : std::filesystem::path();
}

record::Head RunRecord::head_of(const graph::GraphSpec& graph, const Plan& plan, const Transport& transport,
                                const std::string& isolation) {
  record::Head head;
  head.facts = {{"graph", absolute(graph.file)},
                {"schedule", absolute(graph.schedule.file)},
                {"params", graph.params_file.empty() ? "" : absolute(graph.params_file)},
                {"profile", graph.profile},
                {"mode", options_.load.mode},
                {"part", graph.machine},
                {"policy_asked", std::string(to_string(graph.schedule.policy))},
                {"policy_option", options_.load.policy},
                {"set", settings(options_, graph)},
                {"plugins", plugins(options_)},
                {"seed", std::to_string(options_.seed)},
                {"snapshots_ns", std::to_string(graph.record.state_every_ns())},
                {"clock", options_.clock},
                {"transport", transport.name()},
                {"isolation", isolation},
                {"commit", version().commit},
                {"program", log::program_hash()},
                {"simd", registry_.vectors.names != nullptr ? registry_.vectors.names().front() : ""},
                {"machine", machine_facts().dump()}};
  const auto attach = [&](std::string name, const char* type, std::string text) {
    head.files.push_back({0, 0, std::move(name), type, mcap::bytes_of(texts_.emplace_back(std::move(text)))});
  };
  attach("graph.yaml", "application/yaml", log::file_text(graph.file));
  attach("schedule.yaml", "application/yaml", log::file_text(graph.schedule.file));
  attach("plan.json", "application/json", log::plan_json(plan).dump());
  attach("assets.json", "application/json", log::asset_hashes(plan, graph.directory).dump());
  for (size_t i = 1; i < graph.files.size(); ++i)  // what it includes, and the parameter file
    attach(log::part_name(i), "application/yaml", log::file_text(graph.files[i]));
  return head;
}

void RunRecord::begin_file(const graph::RecordSpec& spec, const Plan& plan, const RunBoard& board, Transport& transport,
                           const record::Head& head) {
  auto file = mcap::FileSink::open(options_.record);
  if (!file) throw std::runtime_error("--record " + file.error() + "; choose another place");
  file_.emplace(std::move(*file));
  if (make_disk_) disk_ = make_disk_(*file_);
  mcap::Sink& sink = disk_ ? *disk_ : *file_;
  record::Recorder::Options how;
  how.ports = port_rules(plan, options_.record_ports, spec);
  how.by_caller = options_.clock == "virtual";
  how.written_at = &written_at_;
  how.priority = priority_on(plan);
  how.snapshot_every_ns = spec.state_every_ns();
  recorder_ = std::make_unique<record::Recorder>(plan, board, transport, sink, head, std::move(how));
}

void RunRecord::finish(const RunResult& result, uint64_t unheard_threads) {
  const mcap::Metadata facts{{"epoch_ns", std::to_string(result.epoch_ns)},
                             {"end_ns", std::to_string(result.end_ns)},
                             {"policy_granted", std::string(to_string(result.policy_granted))}};
  if (flight_) flight_->finish(facts, unheard_threads);
  if (!recorder_) return;
  written_ = recorder_->finish(facts, unheard_threads);
  recorder_.reset();
  if (const auto there = file_->still_there(); !there && written_.refused.empty()) {
    written_.refused = there.error();
    options_.outputs->code =
        refuse(fmt::format("--record {}: {}", options_.record.string(), there.error()), kDeviceOrSystem);
  }
}

void RunRecord::tell(nlohmann::ordered_json& report) const {
  if (flight_) report["flight"] = flight_->told();
  if (!wanted()) return;
  if (written_.messages + written_.jobs == 0 && written_.not_written > 0)
    options_.outputs->code =
        refuse(fmt::format("--record {}: nothing was written: {}", options_.record.string(), written_.refused),
               kDeviceOrSystem);
  report["recorder_lost"] = written_.lost();
  report["record"] = {{"file", options_.record.filename().string()},
                      {"messages", written_.messages},
                      {"jobs", written_.jobs},
                      {"events", written_.events},
                      {"mb", static_cast<double>(written_.bytes) / 1e6},
                      {"lost",
                       {{"overwritten", written_.overwritten},
                        {"no_room", written_.no_room},
                        {"not_written", written_.not_written},
                        {"jobs", written_.incomplete_jobs},
                        {"threads", written_.unheard_threads}}},
                      {"refused", written_.refused},
                      {"longest_pause_ms", static_cast<double>(written_.longest_pause_ns) / 1e6},
                      {"cpu_ms",
                       {{"copying", static_cast<double>(written_.capture_cpu_ns) / 1e6},
                        {"writing", static_cast<double>(written_.write_cpu_ns) / 1e6}}}};
}

}  // namespace takt::command
