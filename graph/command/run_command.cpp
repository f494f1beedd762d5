// SPDX-License-Identifier: Apache-2.0
#include "graph/command/run_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sched.h>
#include <unistd.h>

#include <array>
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
std::atomic<bool> g_stop_asked{false};

extern "C" void stop_running(int) {
  g_stop_asked.store(true);
  if (Executor* executor = g_running.load()) executor->stop();
}

/// While it lives SIGINT, SIGTERM and SIGHUP end the run cleanly; one that comes while the run is still being prepared
/// ends it as soon as there is something to end. An ignored SIGHUP (nohup) stays
/// ignored; SIGINT does not: shells ignore it for whatever a script starts in the background.
class StopOnSignal {
 public:
  StopOnSignal() {
    g_stop_asked.store(false);
    struct sigaction action {};
    action.sa_handler = stop_running;
    for (size_t i = 0; i < kSignals.size(); ++i) {
      sigaction(kSignals[i], nullptr, &old_[i]);
      if (kSignals[i] != SIGHUP || old_[i].sa_handler != SIG_IGN) sigaction(kSignals[i], &action, nullptr);
    }
  }
  ~StopOnSignal() {
    for (size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &old_[i], nullptr);
  }

 private:
  static constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, kSignals.size()> old_{};
};

/// What a signal stops while this lives.
class Stoppable {
 public:
  explicit Stoppable(Executor& executor) {
    g_running.store(&executor);
    if (g_stop_asked.load()) executor.stop();
  }
  ~Stoppable() { g_running.store(nullptr); }
};

/// Whether a file can be written there, without making it yet.
bool writable(const std::filesystem::path& file) {
  if (access(file.c_str(), F_OK) == 0) return access(file.c_str(), W_OK) == 0;
  const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  return access(folder.c_str(), W_OK) == 0;
}

/// The cores of the schedule that this process may use; none of them: all it may use.
void limit_cores(std::vector<int>& cores, std::vector<std::string>& adjusted) {
  cpu_set_t allowed;
  if (cores.empty() || sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
  std::vector<int> usable, all;
  for (int core = 0; core < CPU_SETSIZE; ++core)
    if (CPU_ISSET(core, &allowed)) all.push_back(core);
  for (const int core : cores)
    if (core >= 0 && core < CPU_SETSIZE && CPU_ISSET(core, &allowed)) usable.push_back(core);
  if (usable.size() == cores.size()) return;
  if (usable.empty()) usable = all;
  adjusted.push_back(fmt::format("cores [{}] -> [{}]: this process may use no others", fmt::join(cores, ", "),
                                 fmt::join(usable, ", ")));
  cores = usable;
}

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
    const Stoppable stoppable(executor);
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
  if (!options.report.empty() && !writable(options.report))
    return refuse("--report " + options.report.string() + ": cannot be written; choose another place", kBadInput);
  const StopOnSignal guard;
  Prepared prepared;
  try {
    if (const int code = prepare(options, prepared); code != kOk) return code;
    if (g_stop_asked.load()) {
      std::fputs("takt: stopped before the run began\n", stderr);
      return kOk;
    }
    const graph::CheckResult check = graph::check(*prepared.graph, prepared.composition->plan);
    if (!check.admitted && !options.unchecked) return refuse(check.text + "(--unchecked runs it all the same)", kNotOk);

    const CpuLatencyHold latency = hold_cpu_dma_latency();
    const std::vector<std::string> lacks = prepare_machine(latency);
    if (options.require_rt && !lacks.empty()) return refuse("--require-rt: " + lacks.front(), kDeviceOrSystem);
    std::vector<std::string> adjusted = prepared.graph->adjusted;
    limit_cores(prepared.composition->plan.cores, adjusted);
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
