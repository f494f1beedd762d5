// SPDX-License-Identifier: Apache-2.0
#include "graph/run/member_process.hpp"

#include <linux/futex.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "graph/language/part_of_machine.hpp"
#include "graph/run/machine.hpp"
#include "graph/run/machine_link.hpp"
#include "graph/run/prepare.hpp"
#include "graph/run/record.hpp"
#include "graph/run/support.hpp"
#include "rt/capability.hpp"
#include "rt/sched/executor.hpp"
#include "rt/shm/iceoryx_transport.hpp"

namespace takt::command {
namespace {

class BoardGate final : public StartGate {
 public:
  BoardGate(RunBoard& board, size_t process, const Clock& clock)
      : board_(board), record_(board.process(process)), clock_(clock) {}
  bool all_granted(bool mine) override {
    // After a restart the others will not wait: whoever looks after us tries again.
    if (record_.restarts.load() > 0 && !mine && board_.decision().load() == RunBoard::as_asked)
      throw std::runtime_error("the kernel refused a policy that it had granted before the restart");
    record_.refused.store(!mine);
    record_.reach(ProcessRecord::agreed, clock_.now_ns());
    wait_until([&] { return board_.decision().load() != RunBoard::undecided; });
    const bool as_asked = board_.decision().load() == RunBoard::as_asked;
    // It only waits from here on, until the end of the run. When the process is killed, ordinary load must not keep
    // this thread from ending: its place is not free before.
    if (as_asked) lift_thread(0, kLowestPriority);
    else demote_thread(0);
    return as_asked;
  }
  int64_t epoch_ns() override {
    record_.reach(ProcessRecord::running, clock_.now_ns());
    wait_until([&] { return board_.epoch_ns().load() != 0; });
    return board_.epoch_ns().load();
  }

 private:
  RunBoard& board_;
  ProcessRecord& record_;
  const Clock& clock_;
};

/// What a spare composes was told by the process whose place it will take.
class ToldAlready final : public graph::FactExchange {
 public:
  explicit ToldAlready(RunBoard& board) : board_(board) {}
  void tell(size_t, const std::optional<Capacity>&) override {}
  std::optional<Capacity> wait_for(size_t port) override { return board_.wait_for(port); }
  void tell_source(size_t, const SourcePlan&) override {}
  SourcePlan wait_for_source(size_t task) override { return board_.wait_for_source(task); }

 private:
  BoardExchange board_;
};

/// Until the supervisor lets the spare take the place of its process. At a real-time priority behind all lanes, so that
/// ordinary load keeps it from nothing then; it has no reservation.
void wait_for_turn(RunBoard& board, size_t process, Policy policy) {
  if (policy != Policy::cooperative) apply(fixed_reservation(kLowestPriority));
  std::atomic<int32_t>& takes_over = board.spare_order(process).takes_over;
  board.spare(process).ready.store(getpid());
  for (int32_t told; (told = takes_over.load()) != getpid();)
    syscall(SYS_futex, &takes_over, FUTEX_WAIT, told, nullptr, nullptr, 0);
}

std::vector<bool> owned(const Plan& plan, const graph::Partition& partition, size_t process) {
  std::vector<bool> own;
  for (const TaskPlan& task : plan.tasks) own.push_back(partition.process_of.at(task.name) == process);
  return own;
}

}  // namespace

void BoardExchange::tell(size_t port, const std::optional<Capacity>& capacity) {
  CapacityRecord& record = board_.capacity(port);
  record.capacity = capacity.value_or(Capacity{});
  record.known.store(capacity ? CapacityRecord::kTold : CapacityRecord::kNeverTold, std::memory_order_release);
}

std::optional<Capacity> BoardExchange::wait_for(size_t port) {
  const CapacityRecord& record = board_.capacity(port);
  wait_until([&] { return record.known.load(std::memory_order_acquire) != 0; });
  return record.known.load() == CapacityRecord::kTold ? std::optional(record.capacity) : std::nullopt;
}

void BoardExchange::tell_source(size_t task, const SourcePlan& source) {
  SourceFacts& facts = board_.source_facts(task);
  facts.lag_ns = source.lag_ns;
  facts.wait_ns = source.wait_ns;
  facts.unknown = BoundedText<SourceFacts::kLongest>(source.unknown);
  facts.faults = source.faults;
  facts.answers = source.answers;
  facts.known.store(true, std::memory_order_release);
}

SourcePlan BoardExchange::wait_for_source(size_t task) {
  const SourceFacts& facts = board_.source_facts(task);
  wait_until([&] { return facts.known.load(std::memory_order_acquire); });
  return {facts.lag_ns, facts.wait_ns, std::string(facts.unknown.text()), facts.faults, facts.answers};
}

bool wait_until(const std::function<bool()>& done, const std::function<bool()>& broken,
                std::chrono::milliseconds between_looks) {
  while (!done()) {
    if (broken && broken()) return false;
    std::this_thread::sleep_for(between_looks);
  }
  return true;
}

int run_member(const MemberPart& part) {
  const RunOptions& options = part.options;
  RunBoard& board = part.board;
  board.keep_to(part.process);
  ProcessRecord& record = board.process(part.process);
  const auto take_place = [&] {
    record.pid.store(getpid());
    obey_orders(&record.kill);
  };
  if (!part.spare) take_place();
  const Registry& registry = of_jobs(part.registry);
  Prepared prepared(registry);
  prepared.graph = part.graph;
  prepared.clock = std::make_unique<MonotonicClock>();
  BoardExchange exchange(board);
  ToldAlready told_already(board);
  graph::ComposeOptions how;
  how.output = options.output;
  how.seed = options.seed;
  how.observers = observers(options, part.graph);
  how.owns = [&](const std::string& id) { return part.partition.process_of.at(id) == part.process; };
  how.exchange = &exchange;
  if (part.spare) how.exchange = &told_already;
  how.quiet = part.spare;
  std::unique_ptr<machines::Link> link;  // its nodes go first, as all that this process has of them
  if (part.partition.names[part.process] == graph::kLinkProcess && !part.graph.machine.empty()) {
    without_rights([&] { link = make_link(part.graph, registry, options.load.set, board, part.run, *prepared.clock); });
    if (part.graph.schedule.policy != Policy::cooperative) lift_other_threads();
    prepared.remote_source = [&link](const graph::DeviceSpec& device, const auto& ports) {
      return link->source(device.remote->machine, device.id, ports, graph::remote_law(*device.remote));
    };
  }
  if (const int code = compose(options, how, prepared); code != kOk) {
    if (!part.spare) record.problems.store(static_cast<uint32_t>(prepared.problems.size()));
    return code;
  }
  part.left_out.tell(part.spare ? std::vector<std::string>{} : prepared.composition->left_out);
  Plan& plan = prepared.composition->plan;
  part.faults.make_room(plan);
  std::vector<std::string> told;  // the supervisor says it
  choose_cores(plan.cores, told);
  plan.overheads = part.overheads;
  if (!part.spare) record.reach(ProcessRecord::composed, prepared.clock->now_ns());
  wait_until([&] { return board.carrier().load() != RunBoard::no_carrier; });
  prepare_process(registry);
  std::unique_ptr<Transport> joined;
  without_rights([&] {
    joined = board.carrier().load() == RunBoard::local
                 ? join_local_transport(plan.ports, part.pools, static_cast<uint32_t>(part.process) + 1)
                 : join_iceoryx_transport(plan.ports, iceoryx_domain(part.supervisor));
  });
  if (part.spare) {
    wait_for_turn(board, part.process, plan.policy);
    prctl(PR_SET_NAME, part.partition.names[part.process].substr(0, 15).c_str());
    take_place();
    record.reach(ProcessRecord::composed, prepared.clock->now_ns());
  }
  const auto transport = part.faults.inject(std::move(joined), plan, *prepared.clock, board);
  std::optional<Courier> courier;
  if (link) begin(*link, part.graph, plan, *transport), courier.emplace(*link, part.run);
  const std::shared_ptr<void> before_transport(nullptr, [&](void*) {  // whose messages it reads
    courier.reset();
    if (link) part.machines.tell({link->report().dump()});
    link.reset();
  });
  BoardGate gate(board, part.process, *prepared.clock);
  Executor::Options run;
  run.duration_ns = static_cast<int64_t>(options.duration_s * 1e9);
  run.board = &board;
  run.stolen_ns = stolen_ns;
  run.trace = part.rings;
  run.gate = &gate;
  run.rejoin = record.restarts.load() > 0;
  run.gives_up_rights = true;
  run.life = &record.life;
  run.own = owned(plan, part.partition, part.process);
  Executor executor(plan, *transport, *prepared.clock, run);
  record.reach(ProcessRecord::joined, prepared.clock->now_ns());
  const ProcessReading before = ProcessReading::now();
  if (plan.policy == Policy::cooperative) demote_thread(0);  // one on its way back had a real-time priority
  const RunResult result = executor.run();
  demote_thread(0);
  record.cpu_ns = ProcessReading::now().cpu_ns - before.cpu_ns;
  record.simulator_cpu_ns += prepared.devices.simulator_use().cpu_ns;
  record.simulator_in_jobs_ns += prepared.devices.simulator_use().in_jobs_ns;
  record.reach(ProcessRecord::saving, prepared.clock->now_ns());
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    if (run.own[t] && !is_stuck(result, t)) prepared.composition->nodes[t]->finish();
  record.reach(ProcessRecord::finished, prepared.clock->now_ns());
  // A job of another process may still be about to hold what was published here, and the recorder to copy it.
  wait_until([&] { return board.dismissed().load(); });
  // A job that never returns still uses what would now be taken down.
  if (!result.stuck.empty()) end_process(kOk, "iceoryx");
  return kOk;
}

}  // namespace takt::command
