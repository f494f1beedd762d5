// SPDX-License-Identifier: Apache-2.0
#include "graph/command/run_command.hpp"

#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <fstream>
#include <opencv2/core/utility.hpp>

#include "graph/check/check.hpp"
#include "graph/command/live_table.hpp"
#include "graph/command/prepare.hpp"
#include "graph/command/report.hpp"
#include "rt/memory/process_memory.hpp"

namespace takt::command {
namespace {

std::atomic<Executor*> g_running{nullptr};

extern "C" void stop_running(int) {
  if (Executor* executor = g_running.load()) executor->stop();
}

/// While alive, SIGINT and SIGTERM end the run cleanly.
class StopOnSignal {
 public:
  explicit StopOnSignal(Executor& executor) {
    g_running.store(&executor);
    struct sigaction action {};
    action.sa_handler = stop_running;
    sigaction(SIGINT, &action, &old_int_);
    sigaction(SIGTERM, &action, &old_term_);
  }
  ~StopOnSignal() {
    g_running.store(nullptr);
    sigaction(SIGINT, &old_int_, nullptr);
    sigaction(SIGTERM, &old_term_, nullptr);
  }

 private:
  struct sigaction old_int_ {
  }, old_term_{};
};

std::unique_ptr<Transport> make_transport(const std::string& name, const Plan& plan) {
  return name == "iceoryx" ? make_iceoryx_transport(plan.ports) : make_local_transport(plan.ports);
}

bool write_report(const std::filesystem::path& file, const nlohmann::ordered_json& report) {
  std::ofstream out(file);
  out << report.dump(2) << "\n";
  return static_cast<bool>(out);
}

/// Runs the composed graph; everything it needs exists and is checked.
int execute(const RunOptions& options, Prepared& prepared, std::vector<std::string> adjusted) {
  const graph::GraphSpec& graph = *prepared.graph;
  graph::Composition& composition = *prepared.composition;
  const auto transport = make_transport(options.transport, composition.plan);
  const Executor::Options run{static_cast<int64_t>(options.duration_s * 1e9), 50'000'000,
                              options.require_rt || !options.load.policy.empty()};
  Executor executor(composition.plan, *transport, *prepared.clock, run);
  const ProcessReading before = ProcessReading::now();
  RunResult result;
  {
    const StopOnSignal guard(executor);
    const LiveTable live(executor, fmt::format("takt run {} ({}, policy {})", graph.name, graph.profile,
                                               to_string(graph.schedule.policy)));
    result = executor.run();
  }
  const ProcessReading after = ProcessReading::now();
  for (auto& node : composition.nodes) node->finish();
  for (const std::string& refused : result.refused)
    adjusted.push_back(fmt::format("policy {} -> cooperative: {}", to_string(graph.schedule.policy), refused));
  const auto report = make_report({graph, composition, executor, result, *transport, before, after,
                                   hal::simulator_cpu_ns(prepared.devices), options.clock,
                                   std::string(to_string(graph.schedule.policy)), adjusted});
  std::fputs(summary_text(report).c_str(), stdout);
  if (!options.report.empty() && !write_report(options.report, report))
    return refuse("cannot write the report to " + options.report.string() + "; choose a writable --report", kBadInput);
  return report["ok"].get<bool>() ? kOk : kNotOk;
}

/// Locked memory, short wake-ups: what is refused is said.
std::vector<std::string> prepare_machine(const CpuLatencyHold& latency) {
  cv::setNumThreads(1);
  std::vector<std::string> lacks = prepare_process_memory().lacks;
  if (!latency.granted()) lacks.push_back(latency.lacks());
  return lacks;
}

}  // namespace

int run_graph(const RunOptions& options) {
  if (options.isolate == "subsystem")
    return refuse(
        "--isolate subsystem: this version runs all subsystems in one process; leave it out, or --isolate none",
        kDeviceOrSystem);
  std::error_code error;
  std::filesystem::create_directories(options.output, error);
  if (error)
    return refuse(fmt::format("--output {}: {}; choose a writable folder", options.output.string(), error.message()),
                  kBadInput);
  Prepared prepared;
  try {
    if (const int code = prepare(options, prepared); code != kOk) return code;
    const graph::CheckResult check = graph::check(*prepared.graph, prepared.composition->plan);
    if (!check.admitted && !options.unchecked) return refuse(check.text + "(--unchecked runs it all the same)", kNotOk);

    const CpuLatencyHold latency = hold_cpu_dma_latency();
    const std::vector<std::string> lacks = prepare_machine(latency);
    if (options.require_rt && !lacks.empty()) return refuse("--require-rt: " + lacks.front(), kDeviceOrSystem);
    std::vector<std::string> adjusted = prepared.graph->adjusted;
    adjusted.insert(adjusted.end(), lacks.begin(), lacks.end());
    for (const std::string& line : adjusted) std::fprintf(stderr, "takt: adjusted: %s\n", line.c_str());
    return execute(options, prepared, std::move(adjusted));
  } catch (const std::invalid_argument& problem) {  // more ports or edges than the transport carries
    return refuse(problem.what(), kBadInput);
  } catch (const std::exception& problem) {  // PolicyRefused, TransportError, no memory
    return refuse(problem.what(), kDeviceOrSystem);
  }
}

}  // namespace takt::command
