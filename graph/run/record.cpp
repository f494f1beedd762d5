// SPDX-License-Identifier: Apache-2.0
#include "graph/run/record.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <list>
#include <stdexcept>

#include "graph/language/registry.hpp"
#include "graph/language/words.hpp"
#include "graph/log/recorded_plan.hpp"
#include "graph/run/machine.hpp"
#include "graph/run/outputs.hpp"
#include "rt/abi.hpp"

namespace takt::command {
namespace {

/// As long may the thread that copies messages be kept from running before one is overwritten.
constexpr int64_t kUndisturbedNs = 250'000'000;
/// Outputs whose messages are smaller are recorded with all fields.
constexpr uint64_t kSmallBytes = 64 * 1024;

/// By port: recorded with all fields. Devices always are, or nothing could be replayed.
std::vector<char> whole_ports(const Plan& plan, const std::vector<std::string>& also) {
  const auto named = [&](const std::string& name) { return std::find(also.begin(), also.end(), name) != also.end(); };
  std::vector<char> whole(plan.ports.size(), 0);
  for (size_t p = 0; p < plan.ports.size(); ++p)
    whole[p] = plan.ports[p].chunk_bytes() <= kSmallBytes || named("all") ||
               named(plan.ports[p].node + "." + plan.ports[p].port);
  for (const TaskPlan& task : plan.tasks)
    for (const size_t port : task.ports) whole[port] |= static_cast<char>(task.device);
  return whole;
}

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

Observers observers(const RunOptions& options, const graph::GraphSpec& graph) {
  const uint32_t followers =
      (options.record.empty() ? 0u : 1u) + (graph.expect ? 1u : 0u) + (options.witness ? 1u : 0u);
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
                      const std::string& isolation) {
  if (!wanted()) return;
  auto file = mcap::FileSink::open(options_.record);
  if (!file) throw std::runtime_error("--record " + file.error() + "; choose another place");
  file_.emplace(std::move(*file));
  if (make_disk_) disk_ = make_disk_(*file_);
  mcap::Sink& sink = disk_ ? *disk_ : *file_;
  record::Head head;
  head.facts = {{"graph", absolute(graph.file)},
                {"schedule", absolute(graph.schedule.file)},
                {"params", graph.params_file.empty() ? "" : absolute(graph.params_file)},
                {"profile", graph.profile},
                {"mode", options_.load.mode},
                {"policy_asked", std::string(to_string(graph.schedule.policy))},
                {"policy_option", options_.load.policy},
                {"set", settings(options_, graph)},
                {"plugins", plugins(options_)},
                {"seed", std::to_string(options_.seed)},
                {"clock", options_.clock},
                {"transport", transport.name()},
                {"isolation", isolation},
                {"commit", version().commit},
                {"program", log::program_hash()},
                {"simd", registry_.vectors.names != nullptr ? registry_.vectors.names().front() : ""},
                {"machine", machine_facts().dump()}};
  const std::string texts[]{log::file_text(graph.file), log::file_text(graph.schedule.file),
                            log::plan_json(plan).dump(), log::asset_hashes(plan, graph.directory).dump()};
  std::list<std::string> parts;  // the head refers to them
  const char* names[]{"graph.yaml", "schedule.yaml", "plan.json", "assets.json"};
  for (size_t i = 0; i < std::size(texts); ++i)
    head.files.push_back({0, 0, names[i], i < 2 ? "application/yaml" : "application/json", mcap::bytes_of(texts[i])});
  for (size_t i = 1; i < graph.files.size(); ++i)  // what it includes, and the parameter file
    head.files.push_back({0, 0, log::part_name(i), "application/yaml",
                          mcap::bytes_of(parts.emplace_back(log::file_text(graph.files[i])))});
  record::Recorder::Options how;
  how.whole = whole_ports(plan, options_.record_ports);
  how.by_caller = options_.clock == "virtual";
  // Behind all lanes, before all that is ordinary. Beside workers that are ordinary themselves it is one of them.
  if (plan.policy != Policy::cooperative) how.priority = kLowestPriority;
  recorder_ = std::make_unique<record::Recorder>(plan, board, transport, sink, head, std::move(how));
}

void RunRecord::finish(const RunResult& result, uint64_t unheard_threads) {
  if (!recorder_) return;
  written_ = recorder_->finish({{"epoch_ns", std::to_string(result.epoch_ns)},
                                {"end_ns", std::to_string(result.end_ns)},
                                {"policy_granted", std::string(to_string(result.policy_granted))}},
                               unheard_threads);
  recorder_.reset();
}

void RunRecord::tell(nlohmann::ordered_json& report) const {
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
