// SPDX-License-Identifier: Apache-2.0
#include "graph/run/run.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <optional>

#include "graph/attach/server.hpp"
#include "graph/check/doctor_text.hpp"
#include "graph/check/network.hpp"
#include "graph/cli/other_program.hpp"
#include "graph/keys/machine_keys.hpp"
#include "graph/run/expectations.hpp"
#include "graph/run/faults.hpp"
#include "graph/run/isolated_run.hpp"
#include "graph/run/job_durations.hpp"
#include "graph/run/live_table.hpp"
#include "graph/run/outputs.hpp"
#include "graph/run/prepare.hpp"
#include "graph/run/report.hpp"
#include "graph/run/rights.hpp"
#include "graph/run/support.hpp"
#include "graph/run/trace.hpp"
#include "graph/run/watchdog.hpp"
#include "graph/run/web_beside.hpp"
#include "graph/run/world_truth.hpp"
#include "rt/capability.hpp"
#include "rt/machine/limits.hpp"
#include "rt/shm/iceoryx_preflight.hpp"
#include "rt/supervise/systemd_sink.hpp"

namespace takt::command {
namespace {

std::unique_ptr<Transport> make_transport(const std::string& name, const Plan& plan) {
  if (name != "iceoryx") return make_local_transport(plan.ports);
  const DaemonClaim claim(IceoryxPlaces::of_this_machine());
  std::unique_ptr<Transport> transport;
  without_rights([&] { transport = make_iceoryx_transport(plan.ports); });  // its daemon's threads have none
  return transport;
}

/// Runs the composed graph in this process; everything it needs exists and is checked.
int execute(const RunOptions& options, Prepared& prepared, RunFaults& faults, RunExpectations& expectations,
            const graph::Proofs& proofs, std::vector<std::string> adjusted) {
  const graph::GraphSpec& graph = *prepared.graph;
  graph::Composition& composition = *prepared.composition;
  const auto durations = job_durations(options.durations, composition.plan, options.seed);
  if (!durations) return refuse(durations.error(), kBadInput);
  RunBoard board(composition.plan);
  tell_bounds(graph, composition.plan, proofs, board);
  const auto transport =
      faults.inject(make_transport(options.transport, composition.plan), composition.plan, *prepared.clock, board);
  RunRecord record(prepared.registry, options, composition.plan);  // reads from the transport
  faults.disturb_disk(record, *prepared.clock, board);
  RunTrace trace(options, composition.plan, 1);  // ends first: it speaks to the record
  Executor::Options run;
  run.duration_ns = static_cast<int64_t>(options.duration_s * 1e9);
  run.require_policy = options.policy_required();
  run.board = &board;
  run.stolen_ns = stolen_ns;
  run.trace = trace.rings();
  run.gives_up_rights = true;
  if (prepared.clock->is_virtual()) {
    run.after_step = [&] {
      trace.drain();
      record.capture();
      faults.look();
      expectations.look();
      if (options.witness != nullptr) options.witness->look();
    };
    run.job_duration_ns = faults.durations(*durations, composition.plan);
    run.ran = [&](const trace::Slice& slice) { trace.ran(slice); };
  }
  Executor executor(composition.plan, *transport, *prepared.clock, run);
  const ProcessReading before = ProcessReading::now();
  RunWatchdog watchdog(options, composition.plan, board);
  RunResult result;
  StallLog stalls;
  nlohmann::ordered_json held;
  {
    const Stoppable stoppable(board);
    record.begin(graph, composition.plan, board, *transport, "none");
    std::optional<attach::Server> server;  // virtual time passes too fast to speak to
    if (!prepared.clock->is_virtual())
      server.emplace(attach::Subject{prepared.registry,
                                     graph,
                                     composition.plan,
                                     board,
                                     *transport,
                                     getpid(),
                                     [&record] { return record.frozen(); },
                                     {},
                                     {},
                                     record.frozen_folder()});
    if (server) tell_attach(*server, adjusted);
    std::optional<LiveTable> live;
    if (options.witness == nullptr)
      live.emplace(
          composition.plan, board,
          fmt::format("takt run {} ({}, policy {})", graph.name, graph.profile, to_string(graph.schedule.policy)));
    if (options.witness != nullptr) options.witness->begin(composition.plan, *transport);
    trace.collect(composition.plan, record);
    watchdog.start();
    std::optional<RunRights> rights;
    if (!prepared.clock->is_virtual()) rights.emplace(board, std::vector<RunRights::Process>{{"all", getpid()}});
    {
      const RunFaults::Active faulty(faults, composition.plan, *prepared.clock, board);
      const RunExpectations::Active expecting(expectations, composition.plan, *prepared.clock, board, *transport);
      const auto watch = watch_stalls(proofs, composition.plan, *prepared.clock, board);
      result = executor.run();
      if (watch) stalls = watch->end();
    }
    if (rights) held = rights->told();
  }
  const ProcessReading after = ProcessReading::now();
  trace.write(graph, composition.plan, board, result);
  record.finish(result, trace.unheard_threads());
  for (size_t t = 0; t < composition.nodes.size(); ++t)
    if (!is_stuck(result, t)) composition.nodes[t]->finish();
  for (const std::string& refused : result.refused)
    adjusted.push_back(fmt::format("policy {} -> cooperative: {}", to_string(graph.schedule.policy), refused));
  const hal::SimulatorUse simulator = prepared.devices.simulator_use();
  const MachineUse use{after.cpu_ns - before.cpu_ns, simulator.cpu_ns, simulator.in_jobs_ns,
                       after.steal_ms - before.steal_ms, after.rss_mb};
  auto report = make_report({prepared.registry,
                             graph,
                             composition.plan,
                             board,
                             result,
                             *transport,
                             use,
                             options.clock,
                             std::string(to_string(graph.schedule.policy)),
                             "none",
                             {},
                             std::move(adjusted),
                             proofs,
                             stalls});
  if (prepared.clock->is_virtual())
    report["simulated"] = {{"policy", to_string(composition.plan.policy)},
                           {"cores", composition.plan.cores.size()},
                           {"durations", options.durations}};
  report["rights"] = std::move(held);
  report["left_out"] = composition.left_out;
  record.tell(report);
  faults.judge(result, board, run_exit(board, result.policy_granted, report), {}, report);
  expectations.judge(report);
  int code = tell_faults(prepared.registry, options, graph, board, result.policy_granted, report);
  code = expectations.exit_code(faults.exit_code(code, report), report);
  code = std::max(code, options.outputs->code);
  if (options.witness != nullptr) options.witness->end(report);
  if (result.stuck.empty()) watchdog.end();
  // A job that never returns still uses what would now be taken down.
  if (!result.stuck.empty()) end_process(code, options.transport);
  return code;
}

int run_in_one_process(const RunOptions& options, Prepared& prepared, RunFaults& faults,
                       std::vector<std::string> adjusted) {
  graph::ComposeOptions how;
  how.output = options.output;
  how.seed = options.seed;
  how.observers = observers(options, *prepared.graph);
  if (const int code = compose(options, how, prepared); code != kOk) {
    tell_problems(prepared.problems.size());
    return code;
  }
  if (StopOnSignal::asked()) {
    std::fputs("takt: stopped before the run began\n", stderr);
    return kOk;
  }
  faults.make_room(prepared.composition->plan);
  RunExpectations expectations(options, *prepared.graph);
  if (const int code = expectations.bind(world_truth(prepared.devices.simulated())); code != kOk) return code;
  // In virtual time the cores of the schedule need not be there.
  std::vector<int>& cores = prepared.composition->plan.cores;
  if (!prepared.clock->is_virtual() || cores.empty()) choose_cores(cores, adjusted);
  const graph::CheckMachine machine = this_machine();
  prepared.composition->plan.overheads = machine.overheads;
  const auto proofs = admit(options, *prepared.graph, prepared.composition->plan, machine, adjusted);
  if (!proofs) return proofs.error();
  const CpuLatencyHold latency = hold_cpu_dma_latency();
  std::vector<std::string> lacks = prepare_process(prepared.registry);
  const bool locked = lacks.empty();
  if (!latency.granted()) lacks.push_back(latency.lacks());
  if (options.require_rt && (!locked || latency.refused()))
    return refuse("--require-rt: " + lacks.front(), kDeviceOrSystem);
  adjusted.insert(adjusted.end(), lacks.begin(), lacks.end());
  if (options.witness == nullptr)
    for (const std::string& line : adjusted) std::fprintf(stderr, "takt: adjusted: %s\n", line.c_str());
  if (const auto shown = begin_web(options); !shown) return refuse(shown.error(), kDeviceOrSystem);
  return execute(options, prepared, faults, expectations, *proofs, std::move(adjusted));
}

/// Of a machine among several: its keys, looked at before anything starts; without them others may listen and talk.
int take_keys(const std::filesystem::path& folder, graph::GraphSpec& graph) {
  graph.network.keys = folder;
  for (const std::string& line : graph::open_addresses(graph))
    std::fprintf(stderr, "takt: warning: %s\n", line.c_str());
  if (folder.empty()) return kOk;
  const keys::KeyCheck found = keys::check_keys(folder, graph, std::time(nullptr));
  if (!found.problem.empty()) return refuse("--keys: " + found.problem, kBadInput);
  if (!found.warning.empty()) std::fprintf(stderr, "takt: warning: %s\n", found.warning.c_str());
  return kOk;
}

/// One process, or one per subsystem: as the command line says, else the graph.
int run_as_asked(const Registry& registry, RunOptions options) {
  Prepared prepared(registry);
  if (const int code = load(options, prepared); code != kOk) {
    tell_problems(prepared.problems.size());
    return code;
  }
  if (const int code = take_keys(options.keys, *prepared.graph); code != kOk) return code;
  if (options.load.state.empty()) tell_ignored_overlay(prepared.graph->name, "this run reads no kept values");
  options.keep_ring = keeps_ring(options, *prepared.graph);
  prepared.graph->record.recorded = options.keep_ring || !options.record.empty();
  if (prepared.graph->expect && !options.duration_asked)
    options.duration_s = static_cast<double>(prepared.graph->expect->within_ns) * 1e-9;
  std::vector<std::string> adjusted = prepared.graph->adjusted;
  const std::string wanted = options.isolate.empty() ? prepared.graph->isolation : options.isolate;
  if (options.require_rt) {
    const std::string lacks = graph::lacks_text(prepared.graph->schedule.policy, options.transport == "iceoryx");
    if (!lacks.empty())
      return refuse("--require-rt: this machine lacks (see `takt doctor`)\n" + lacks, kDeviceOrSystem);
    if (const std::string note = this_machine().not_preemptible; !note.empty())
      std::fprintf(stderr, "takt: note: %s\n", note.c_str());
  }
  if (options.web) {
    const auto program = web_program();
    if (!program) return refuse(program.error(), kDeviceOrSystem);
    options.shown = std::make_shared<WebBeside>(web_arguments(*program, prepared.graph->web));
  }
  const bool processes = wanted == "subsystem" && options.clock != "virtual";
  RunFaults faults(registry, options);
  // They keep references to the graph and the clock that they are loaded with.
  const auto load_faults = [&](Prepared& of) { return faults.load(*of.graph, *of.clock, processes); };
  if (!processes) {
    Prepared whole(of_jobs(registry));
    whole.graph = std::move(prepared.graph);
    whole.clock = std::move(prepared.clock);
    const int code = load_faults(whole);
    return code == kOk ? run_in_one_process(options, whole, faults, adjusted) : code;
  }
  if (const int code = load_faults(prepared); code != kOk) return code;
  const KeptPlace record(options.record);
  return run_isolated(registry, options, *prepared.graph, faults, std::move(adjusted));
}

}  // namespace

int run_graph(const Registry& registry, const RunOptions& options) {
  if (options.durations != "budgets" && options.clock != "virtual")
    return refuse("--durations: only jobs in virtual time take what they are told; add --clock virtual", kBadInput);
  if (!options.watchdog.empty() && options.clock == "virtual")
    return refuse("--watchdog: a run in virtual time keeps no deadline that a watchdog could guard; leave one out",
                  kBadInput);
  if (options.web && options.clock == "virtual")
    return refuse("--web: virtual time passes too fast to be shown; leave --web or --clock virtual out", kBadInput);
  // Two that reset one machine for different reasons, and only one process can have the device.
  if (const auto systemd = systemd_sink(); !options.watchdog.empty() && systemd && systemd->timeout_ns() > 0)
    return refuse(
        "--watchdog " + options.watchdog.string() +
            ": systemd watches this run (WatchdogSec=); leave --watchdog out, and let systemd feed the device "
            "(RuntimeWatchdogSec= in system.conf)",
        kBadInput);
  RunOptions claimed = options;
  if (const int code = claim_outputs(claimed); code != kOk) return code;
  const StopOnSignal guard;
  try {
    return run_as_asked(registry, claimed);
  } catch (const std::invalid_argument& problem) {  // more ports or edges than the transport carries
    return refuse(problem.what(), kBadInput);
  } catch (const std::exception& problem) {  // PolicyRefused, TransportError, no memory
    return refuse(machine::explain(problem), kDeviceOrSystem);
  }
}

}  // namespace takt::command
