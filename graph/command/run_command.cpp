// SPDX-License-Identifier: Apache-2.0
#include "graph/command/run_command.hpp"

#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <fstream>
#include <opencv2/core/utility.hpp>

#include "graph/check/check.hpp"
#include "graph/command/live_table.hpp"
#include "graph/command/report.hpp"
#include "hal/drivers.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/shm/transport_error.hpp"

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
  struct sigaction old_int_ {}, old_term_ {};
};

int refuse(const std::vector<graph::Problem>& problems, Exit code) {
  for (const auto& problem : problems) std::fprintf(stderr, "%s\n", graph::to_string(problem).c_str());
  std::fprintf(stderr, "takt: %zu problem%s, nothing was started\n", problems.size(), problems.size() == 1 ? "" : "s");
  return code;
}

int refuse(const std::string& text, Exit code) {
  std::fprintf(stderr, "takt: error: %s\n", text.c_str());
  return code;
}

struct Sources {
  hal::Devices devices;
  graph::DeviceFactory factory(const graph::GraphSpec& graph, const Clock& clock, uint64_t seed) {
    return [this, &graph, &clock, seed](const graph::DeviceSpec& spec) -> tl::expected<std::unique_ptr<Node>, graph::ComposeError> {
      hal::DeviceConfig config{spec.id, spec.kind, spec.driver, spec.settings, graph.directory, seed};
      auto node = hal::make_device(config, devices, clock);
      if (node) return std::move(*node);
      graph::ComposeError error;
      error.problems.push_back({spec.position, fmt::format("device {}: {}; {}", spec.id, node.error().what, node.error().fix)});
      error.device_failed = !node.error().bad_input;
      return tl::make_unexpected(std::move(error));
    };
  }
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
int execute(const RunOptions& options, const graph::GraphSpec& graph, graph::Composition& composition, Clock& clock,
            Sources& sources, std::vector<std::string> adjusted) {
  const auto transport = make_transport(options.transport, composition.plan);
  const Executor::Options run{static_cast<int64_t>(options.duration_s * 1e9), 50'000'000,
                              options.require_rt || !options.load.policy.empty()};
  Executor executor(composition.plan, *transport, clock, run);
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
                                   hal::simulator_cpu_ns(sources.devices), options.clock,
                                   std::string(to_string(graph.schedule.policy)), adjusted});
  std::fputs(summary_text(report).c_str(), stdout);
  if (!options.report.empty() && !write_report(options.report, report))
    return refuse("cannot write the report to " + options.report.string() + "; choose a writable --report", kBadInput);
  return report["ok"].get<bool>() ? kOk : kNotOk;
}

}  // namespace

int run_graph(const RunOptions& options) {
  const NodeTypes types = graph::node_types();
  const graph::Loaded loaded = graph::load(options.graph, options.load, types);
  if (!loaded.graph) return refuse(loaded.problems, kBadInput);
  const graph::GraphSpec& graph = *loaded.graph;
  cv::setNumThreads(1);

  const auto memory = prepare_process_memory();
  const CpuLatencyHold latency = hold_cpu_dma_latency();
  std::vector<std::string> adjusted = graph.adjusted;
  adjusted.insert(adjusted.end(), memory.lacks.begin(), memory.lacks.end());
  if (options.require_rt && !memory.lacks.empty()) return refuse("--require-rt: " + memory.lacks.front(), kDeviceOrSystem);
  if (!latency.granted()) adjusted.push_back(latency.lacks());
  for (const std::string& line : adjusted) std::fprintf(stderr, "takt: adjusted: %s\n", line.c_str());

  MonotonicClock real;
  VirtualClock simulated(1'000'000'000);
  Clock& clock = options.clock == "virtual" ? static_cast<Clock&>(simulated) : real;
  Sources sources;
  std::error_code ignored;
  std::filesystem::create_directories(options.output, ignored);
  try {
    auto composition = graph::compose(graph, types, sources.factory(graph, clock, options.seed), clock,
                                      {options.output, options.seed});
    if (!composition)
      return refuse(composition.error().problems, composition.error().device_failed ? kDeviceOrSystem : kBadInput);
    const graph::CheckResult check = graph::check(graph, composition->plan);
    if (!check.admitted && !options.unchecked) return refuse(check.text, kNotOk);
    return execute(options, graph, *composition, clock, sources, std::move(adjusted));
  } catch (const PolicyRefused& refused) {
    return refuse(refused.what(), kDeviceOrSystem);
  } catch (const TransportError& error) {
    return refuse(error.what(), kDeviceOrSystem);
  } catch (const std::exception& error) {
    return refuse(error.what(), kDeviceOrSystem);
  }
}

}  // namespace takt::command
