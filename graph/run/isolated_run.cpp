// SPDX-License-Identifier: Apache-2.0
#include "graph/run/isolated_run.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <thread>

#include "graph/attach/server.hpp"
#include "graph/compose/spares.hpp"
#include "graph/run/expectations.hpp"
#include "graph/run/iceoryx_daemon.hpp"
#include "graph/run/live_table.hpp"
#include "graph/run/member_process.hpp"
#include "graph/run/outages.hpp"
#include "graph/run/outputs.hpp"
#include "graph/run/prepare.hpp"
#include "graph/run/report.hpp"
#include "graph/run/rights.hpp"
#include "graph/run/strikes.hpp"
#include "graph/run/support.hpp"
#include "graph/run/trace.hpp"
#include "graph/run/watchdog.hpp"
#include "graph/run/web_beside.hpp"
#include "rt/capability.hpp"
#include "rt/machine/limits.hpp"
#include "rt/memory/sanitized.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/watchdog.hpp"
#include "rt/shm/iceoryx_preflight.hpp"
#include "rt/shm/local_transport.hpp"
#include "rt/supervise/group_keeper.hpp"
#include "rt/supervise/process_group.hpp"
#include "rt/supervise/supervisor.hpp"

namespace takt::command {
namespace {

constexpr int64_t kStartDelayNs = 100'000'000;  // devices start between the agreement and the epoch
// Without memory the kernel ends processes of low nodes first, then the others, the supervisor last.
constexpr int kGoesFirst = 500, kGoesLate = 200;
constexpr int64_t kPatienceNs = kSlowdown * 3'000'000'000LL;  // for the processes to end after the stop
constexpr int64_t kSavingNs = kSlowdown * 60'000'000'000LL;   // ... while nodes save maps, maybe to a slow disk

/// Ends the run with an exit code before it began.
struct Refused {
  int code;
};

std::vector<size_t> process_of_tasks(const Plan& plan, const graph::Partition& partition) {
  std::vector<size_t> process;
  for (const TaskPlan& task : plan.tasks) process.push_back(partition.process_of.at(task.name));
  return process;
}

/// By process, the tasks that it runs.
std::vector<std::vector<size_t>> tasks_of(const Plan& plan, const graph::Partition& partition) {
  std::vector<std::vector<size_t>> tasks(partition.names.size());
  const std::vector<size_t> process = process_of_tasks(plan, partition);
  for (size_t t = 0; t < process.size(); ++t) tasks[process[t]].push_back(t);
  return tasks;
}

class IsolatedRun {
 public:
  IsolatedRun(const Registry& registry, const RunOptions& options, const graph::GraphSpec& graph, RunFaults& faults,
              std::vector<std::string> adjusted)
      : registry_(registry),
        options_(options),
        graph_(graph),
        faults_(faults),
        expectations_(options, graph),
        adjusted_(std::move(adjusted)),
        plan_source_(graph::outline(graph, registry, clock_)),
        plan_(plan_source_.plan),
        partition_(graph::partition(graph, adjusted_)),
        spares_(graph::spares(graph, partition_, adjusted_)),
        board_(plan_, partition_.names.size(), process_of_tasks(plan_, partition_)),
        stoppable_(board_),
        pools_(static_cast<uint32_t>(partition_.names.size()) + 1),
        record_(registry, options, plan_),
        trace_(options, plan_, partition_.names.size()) {}

  ~IsolatedRun() { take_down(); }
  IsolatedRun(const IsolatedRun&) = delete;
  IsolatedRun& operator=(const IsolatedRun&) = delete;

  /// Runs the graph with this process as supervisor, which has no thread yet. `run`: the process that stands for it.
  int run(pid_t run) {
    if (const int code = expectations_.bind({}); code != kOk) throw Refused{code};
    if (options_.transport == "iceoryx") claim_ = find_room_for_daemon(adjusted_);
    choose_cores(plan_.cores, adjusted_);
    const graph::CheckMachine machine = this_machine();
    plan_.overheads = machine.overheads;
    if (again()) forget_processes();
    for (size_t p = 0; p < partition_.names.size(); ++p) {
      const auto body = [this, p, run, supervisor = getpid()](bool spare) -> int {
        machine::go_first_without_memory(is_high(p) ? kGoesLate : kGoesFirst);
        try {
          return run_member({registry_, options_, graph_, partition_, plan_.overheads, p, spare, supervisor, run,
                             board_, pools_, trace_.rings(), faults_, left_out_, machines_});
        } catch (const std::exception& problem) {  // as in a run in one process: no memory, no daemon, no thread
          return refuse(fmt::format("process {}: {}", partition_.names[p], machine::explain(problem)), kDeviceOrSystem);
        }
      };
      group_.start(
          partition_.names[p], [body] { return body(false); }, [body] { return body(true); });
    }
    group_.prepare_restarts(plan_.policy != Policy::cooperative);
    wait_for_all(ProcessRecord::composed);
    BoardExchange exchange(board_);
    graph::complete(plan_, exchange, observers(options_, graph_));
    faults_.make_room(plan_);
    if (!again()) {
      auto proofs = admit(options_, graph_, plan_, machine, adjusted_);
      if (!proofs) throw Refused{proofs.error()};
      proofs_ = std::move(*proofs);
      tell_bounds(graph_, plan_, proofs_, board_);
      if (const auto shown = begin_web(options_); !shown) throw Refused{refuse(shown.error(), kDeviceOrSystem)};
    } else {
      proofs_.policy = plan_.policy;
      proofs_.why = "all processes were lost, with what was admitted";
    }
    const CpuLatencyHold latency = hold_cpu_dma_latency();
    tell_lacks(latency);
    bring_up_transport();
    std::optional<DaemonProbe> probe;  // from here on somebody waits for the daemon: members that join
    if (options_.transport == "iceoryx") probe.emplace(*transport_, board_.group(), clock_);
    agree_on_policy();
    faults_.disturb_disk(record_, clock_, board_);
    if (!again()) record_.begin(graph_, plan_, board_, *transport_, "subsystem", partition_.names);
    else if (record_.listens()) adjusted_.push_back("the record ends where the group of processes was lost");
    trace_.collect(plan_, record_);
    wait_for_all(ProcessRecord::running);
    const int64_t steal_before_ms = ProcessReading::now().steal_ms, cpu_before_ns = ProcessReading::now().cpu_ns;
    // Now, with everything in place and locked: at the end they leave one after the other.
    memory_mb_ = proportional_memory_mb(getpid());
    for (size_t p = 0; p < group_.size(); ++p) memory_mb_ += proportional_memory_mb(group_.pid(p));
    for (const pid_t nursery : group_.nurseries()) memory_mb_ += proportional_memory_mb(nursery);
    const auto watch_of_stalls = watch_stalls(proofs_, plan_, clock_, board_);
    start();
    {
      const attach::Server server({registry_, graph_, plan_, board_, *transport_, run,
                                   [this] { return record_.frozen(); }, partition_.names,
                                   process_of_tasks(plan_, partition_), record_.frozen_folder()});
      tell_attach(server, adjusted_);
      const LiveTable live(plan_, board_,
                           fmt::format("takt run {} ({}, policy {}, {} processes)", graph_.name, graph_.profile,
                                       to_string(plan_.policy), group_.size()));
      watchdog_.emplace(options_, plan_, board_);
      RunRights rights(board_, processes(run));
      const RunFaults::Active faulty(faults_, plan_, clock_, board_);
      const RunExpectations::Active expecting(expectations_, plan_, clock_, board_, *transport_);
      watch();
      rights_ = rights.told();
    }
    if (watch_of_stalls) stalls_ = watch_of_stalls->end();
    probe.reset();
    watchdog_->start();  // whoever waits for feeds does so until the end: reports and traces take their time
    count_chunks();
    MachineUse use = use_of_all();
    use.steal_ms -= steal_before_ms;
    use.cpu_ns -= cpu_before_ns;
    return report(use);
  }

  RunBoard& board() { return board_; }
  /// Ends whatever still lives of the run.
  void take_down() {
    ending_ = true;
    group_.kill_all();
    wait_until([&] { return collect_ends(), group_.alive() == 0; });
    record_.let_go();
    transport_.reset();
  }

 private:
  /// An earlier supervisor was lost with all processes; board and epoch are still what they were.
  bool again() const { return board_.group().losses.load() > 0; }
  void forget_processes() {
    board_.carrier().store(RunBoard::no_carrier);
    board_.dismissed().store(false);
    for (size_t p = 0; p < board_.process_count(); ++p) {
      ProcessRecord& record = board_.process(p);
      record.state.store(ProcessRecord::starting);
      record.life.heartbeat_ns.store(0);
      record.life.hanging.store(0);
      record.restarts.fetch_add(1);
    }
  }
  /// Waits until every process has come that far. A process that ended instead has said why: exits with its code.
  void wait_for_all(uint32_t state) {
    const bool come = wait_until(
        [&] {
          for (size_t p = 0; p < group_.size(); ++p)
            if (board_.process(p).state.load() < state) return false;
          return true;
        },
        [&] { return StopOnSignal::asked() || collect_ends(); });
    if (come) return;
    if (StopOnSignal::asked()) {
      std::fputs("takt: stopped before the run began\n", stderr);
      throw Refused{kOk};
    }
    // The others may have something to say, too.
    const int64_t until = clock_.now_ns() + 300'000'000;
    wait_until([&] { return clock_.now_ns() > until || (collect_ends(), group_.alive() == 0); });
    size_t problems = 0;
    for (size_t p = 0; p < group_.size(); ++p) problems += board_.process(p).problems.load();
    if (problems > 0) tell_problems(problems);
    throw Refused{code_};
  }

  bool is_high(size_t process) const {
    return std::any_of(plan_.tasks.begin(), plan_.tasks.end(), [&](const TaskPlan& task) {
      return task.criticality == Criticality::high && partition_.process_of.at(task.name) == process;
    });
  }

  /// Notes how processes ended; true if one ended that should not have.
  bool collect_ends() {
    while (const auto end = group_.reap()) {
      if (end->code == 0) continue;
      if (end->signal != 0) remove_iceoryx_leftovers(IceoryxPlaces::of_this_machine(), end->pid);
      if (ending_) continue;
      code_ = std::max(code_, end->signal != 0 ? static_cast<int>(kDeviceOrSystem) : end->code);
      if (end->signal != 0)
        problems_.push_back(fmt::format("process {} was ended by signal {} ({}){}", group_.name(end->process),
                                        end->signal, strsignal(end->signal), memory_note()));
      else if (board_.process(end->process).problems.load() == 0)
        problems_.push_back(fmt::format("process {} ended with code {}", group_.name(end->process), end->code));
      for (; told_ < problems_.size(); ++told_) std::fprintf(stderr, "takt: error: %s\n", problems_[told_].c_str());
    }
    return code_ != 0;
  }

  /// Where the kernel killed since the control group has no more memory.
  std::string memory_note() const {
    if (machine::memory_kills() <= memory_kills_before_) return "";
    return fmt::format(": no more memory ({})", machine::limit_on(machine::Scarce::memory));
  }

  void bring_up_transport() {
    if (claim_) {
      without_rights([&] { transport_ = make_iceoryx_transport(plan_.ports); });  // its daemon's threads have none
      claim_.reset();
    } else {
      transport_ = make_local_transport(plan_.ports, pools_, static_cast<uint32_t>(group_.size()) + 1);
    }
    board_.carrier().store(options_.transport == "iceoryx" ? RunBoard::iceoryx : RunBoard::local);
  }

  void tell_lacks(const CpuLatencyHold& latency) {
    std::vector<std::string> lacks = prepare_process(registry_);
    const bool locked = lacks.empty();
    if (!latency.granted()) lacks.push_back(latency.lacks());
    if (options_.require_rt && (!locked || latency.refused()))
      throw Refused{refuse("--require-rt: " + lacks.front(), kDeviceOrSystem)};
    adjusted_.insert(adjusted_.end(), lacks.begin(), lacks.end());
    for (const std::string& line : adjusted_) std::fprintf(stderr, "takt: adjusted: %s\n", line.c_str());
  }

  void agree_on_policy() {
    if (plan_.policy == Policy::cooperative) return;
    if (again()) {
      granted_ = board_.decision().load() == RunBoard::as_asked ? plan_.policy : Policy::cooperative;
      return;
    }
    wait_for_all(ProcessRecord::agreed);
    bool refused = false;
    for (size_t p = 0; p < group_.size(); ++p) refused = refused || board_.process(p).refused.load();
    if (!refused) {
      granted_ = plan_.policy;
    } else {
      const std::vector<std::string> lines = refusals(plan_, board_);
      if (options_.policy_required()) throw Refused{refuse(lines.front(), kDeviceOrSystem)};
      for (const std::string& line : lines)
        adjusted_.push_back(fmt::format("policy {} -> cooperative: {}", to_string(plan_.policy), line));
    }
    board_.decision().store(refused ? RunBoard::cooperative : RunBoard::as_asked);
  }

  /// All of the run, for which the process `run` stands; this one comes last.
  std::vector<RunRights::Process> processes(pid_t run) const {
    std::vector<RunRights::Process> all;
    for (size_t p = 0; p < group_.size(); ++p) all.push_back({group_.name(p), group_.pid(p)});
    for (const pid_t nursery : group_.nurseries()) all.push_back({"nursery", nursery});
    if (run != getpid()) all.push_back({"keeper", run});
    all.push_back({"supervisor", getpid()});
    return all;
  }

  void start() {
    if (board_.epoch_ns().load() != 0) return;
    const int64_t epoch = clock_.now_ns() + kStartDelayNs;
    if (options_.duration_s > 0) board_.stop().set_planned_end(epoch + static_cast<int64_t>(options_.duration_s * 1e9));
    board_.epoch_ns().store(epoch);
  }

  /// Until all processes have ended. One that dies is started again beside the others, until the end of the run.
  void watch() {
    Supervisor::Options how;
    how.silence_ns = Watchdog::patience_ns(granted_);
    board_.group().ordinary.store(granted_ == Policy::cooperative);
    how.clean_up = [](pid_t pid) { remove_iceoryx_leftovers(IceoryxPlaces::of_this_machine(), pid); };
    how.say = [](const std::string& what) { std::fprintf(stderr, "takt: %s\n", what.c_str()); };
    how.memory_mb = proportional_memory_mb;
    // Over iceoryx a process is known to the daemon, and there is one of each name.
    for (const graph::SpareChoice& choice : spares_)
      how.spares.push_back(choice.wanted && options_.transport != "iceoryx");
    supervisor_.emplace(plan_, board_, group_, *transport_, clock_, tasks_of(plan_, partition_), how);
    if (again()) supervisor_->all_were_lost(board_.group().newest_loss);
    int64_t give_up_ns = INT64_MAX;
    const auto ended = [&] {
      supervisor_->look();
      const int64_t now = clock_.now_ns(), end = board_.stop().end_ns();
      if (now < end) strikes_.strike(now);
      watchdog_->tick(now);
      if (give_up_ns == INT64_MAX && now > end) {
        supervisor_->let_end();
        give_up_ns = now + kPatienceNs;
      }
      const bool saves = all_have(ProcessRecord::saving) && !all_have(ProcessRecord::finished);
      if (saves && now > give_up_ns && give_up_ns < end + kSavingNs) {
        std::fprintf(stderr, "takt: nodes write their files; it may take 60 s\n");
        give_up_ns = end + kSavingNs;
      }
      if (!board_.dismissed().load() && (all_have(ProcessRecord::finished) || now > give_up_ns)) {
        record_.take_rest();
        board_.dismissed().store(true);
        give_up_ns = now + kPatienceNs;
      }
      if (now <= give_up_ns || group_.alive() == 0) return group_.alive() == 0;
      for (size_t p = 0; p < group_.size(); ++p)
        if (group_.pid(p) != 0)
          problems_.push_back(fmt::format("process {} did not end and was killed", group_.name(p)));
      group_.kill_all();
      give_up_ns = now + kPatienceNs;
      return false;
    };
    const bool real_time = granted_ != Policy::cooperative && lift_thread(0, kSupervisorPriority);
    wait_until(ended, {}, std::chrono::milliseconds(5));
    if (real_time) demote_thread(0);
  }

  /// Nobody is there any more: what is taken now, beyond what outputs keep in memory of our own, stays taken. Over
  /// iceoryx nothing should be, once its daemon has noticed who is gone.
  void count_chunks() {
    constexpr int64_t kNoticed_ns = 3'000'000'000;  // it does so within 1.5 s
    const int64_t until = clock_.now_ns() + (options_.transport == "iceoryx" ? kNoticed_ns : 0);
    wait_until([&] { return (chunks_at_end_ = transport_->chunks_in_use()) == 0 || clock_.now_ns() >= until; });
  }

  /// Those that live have come so far.
  bool all_have(ProcessRecord::State reached) const {
    for (size_t p = 0; p < group_.size(); ++p)
      if (group_.pid(p) != 0 && board_.process(p).state.load() < reached) return false;
    return true;
  }

  MachineUse use_of_all() const {
    const ProcessReading own = ProcessReading::now();
    MachineUse use{own.cpu_ns + supervisor_->lost_cpu_ns(), 0, 0, own.steal_ms, memory_mb_};
    for (size_t p = 0; p < board_.process_count(); ++p) {
      use.cpu_ns += board_.process(p).cpu_ns;
      use.simulator_cpu_ns += board_.process(p).simulator_cpu_ns;
      use.simulator_in_jobs_ns += board_.process(p).simulator_in_jobs_ns;
    }
    return use;
  }

  int report(const MachineUse& use) {
    board_.modes().gather();  // what a process asked for last
    RunResult result;
    result.epoch_ns = board_.epoch_ns().load();
    result.end_ns = board_.stop().end_ns();
    result.policy_granted = granted_;
    result.released = released_jobs(plan_, board_, result.epoch_ns, result.end_ns);
    trace_.write(graph_, plan_, board_, result);
    record_.finish(result, trace_.unheard_threads());
    auto report =
        make_report({registry_, graph_, plan_, board_, result, *transport_, use, options_.clock,
                     std::string(to_string(plan_.policy)), "subsystem", partition_.names, adjusted_, proofs_, stalls_});
    report["left_out"] = left_out_.lines();
    for (const std::string& line : machines_.lines()) report["machines"] = nlohmann::ordered_json::parse(line);
    report["memory"]["chunks_at_end"] = chunks_at_end_;
    report["rights"] = rights_;
    if (const size_t lost = group_.lost_nurseries(); lost > 0)
      problems_.push_back(fmt::format("the process that starts others again was lost {} times and replaced", lost));
    for (const std::string& problem : problems_) report["faults"].push_back({{"what", problem}});
    add_spares(partition_.names, spares_, graph::takeover_room(plan_, partition_, plan_.overheads.deadline_bandwidth),
               *supervisor_, report);
    add_outages(board_.outages(), partition_.names, plan_, tasks_of(plan_, partition_), result, report);
    if (!problems_.empty() || board_.outages().size() > 0) report["ok"] = false;
    if (supervisor_->gave_up()) code_ = kDeviceOrSystem;
    record_.tell(report);
    const int exit = code_ != 0 ? code_ : report["ok"].get<bool>() ? kOk : kNotOk;
    faults_.judge(result, board_, exit, partition_.names, report);
    expectations_.judge(report);
    tell(registry_, options_, graph_, report);
    if (code_ == 0) watchdog_->end();  // else nobody says that all is well
    return std::max(expectations_.exit_code(faults_.exit_code(exit, report), report), options_.outputs->code);
  }

  std::unique_ptr<DaemonClaim> claim_;  ///< of iceoryx, until its daemon is there
  const Registry& registry_;
  const RunOptions& options_;
  const graph::GraphSpec& graph_;
  RunFaults& faults_;
  RunExpectations expectations_;
  std::vector<std::string> adjusted_, problems_;
  ToldLines left_out_, machines_;
  graph::Proofs proofs_;
  StallLog stalls_;
  nlohmann::ordered_json rights_;
  MonotonicClock clock_;
  graph::Composition plan_source_;  ///< shells of all nodes; the plan points into them
  Plan& plan_;
  const graph::Partition partition_;
  const std::vector<graph::SpareChoice> spares_;
  RunBoard board_;
  const Stoppable stoppable_;
  const PoolFile pools_;  ///< of the local transport, for the members and this process
  Policy granted_ = Policy::cooperative;
  int code_ = 0;
  int64_t memory_kills_before_ = machine::memory_kills();
  size_t told_ = 0;
  bool ending_ = false;
  double memory_mb_ = 0;
  uint32_t chunks_at_end_ = 0;            ///< see count_chunks
  std::unique_ptr<Transport> transport_;  ///< of iceoryx with the daemon: ends after all members
  RunRecord record_;                      ///< reads from the transport
  RunTrace trace_;                        ///< speaks to the record
  ProcessGroup group_;                    ///< its members end before what they share
  Strikes strikes_{faults_, plan_, partition_, board_, group_};
  std::optional<Supervisor> supervisor_;  ///< of the group
  std::optional<RunWatchdog> watchdog_;
};

/// The process that stands for the run to the service manager is the keeper; the group's is the one that speaks.
void take_over_notifications(pid_t keeper) {
  const char* meant = std::getenv("WATCHDOG_PID");
  if (meant != nullptr && std::to_string(keeper) == meant) setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
}

}  // namespace

int run_isolated(const Registry& registry, const RunOptions& options, const graph::GraphSpec& graph, RunFaults& faults,
                 std::vector<std::string> adjusted) {
  IsolatedRun run(registry, options, graph, faults, std::move(adjusted));
  const auto as_supervisor = [&, keeper = getpid()] {
    try {
      return run.run(keeper);
    } catch (const Refused& refused) {
      return refused.code;
    }
  };
  // Nothing of the runtime's own pools can be left locked: there is nobody to be kept alive but the members.
  if (options.transport != "iceoryx") return as_supervisor();
  GroupKeeper::Options how;
  how.stop_asked = StopOnSignal::asked;
  how.clean_up = [&](pid_t supervisor) {
    const IceoryxPlaces places = IceoryxPlaces::of_this_machine();
    remove_iceoryx_leftovers(places, supervisor);
    for (size_t p = 0; p < run.board().process_count(); ++p) {
      const pid_t member = run.board().process(p).pid.load();
      if (member > 0) remove_iceoryx_leftovers(places, member);
    }
  };
  how.say = [](const std::string& what) { std::fprintf(stderr, "takt: %s\n", what.c_str()); };
  const MonotonicClock clock;
  const auto code = GroupKeeper(run.board().group(), clock, how).keep([&, keeper = getpid()] {
    take_over_notifications(keeper);
    int code = kDeviceOrSystem;
    try {
      code = as_supervisor();
    } catch (const std::exception& problem) {  // as in a run without a keeper
      refuse(problem.what(), kDeviceOrSystem);
    }
    run.take_down();  // this process ends without leaving the scope that owns the run
    return code;
  });
  return code ? *code : refuse("the group of processes was lost too often", kDeviceOrSystem);
}

}  // namespace takt::command
