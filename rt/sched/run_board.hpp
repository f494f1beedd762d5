// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "rt/hot.hpp"
#include "rt/sched/fault_log.hpp"
#include "rt/sched/grant.hpp"
#include "rt/sched/mark_log.hpp"
#include "rt/sched/modes.hpp"
#include "rt/sched/node_log.hpp"
#include "rt/sched/outage_log.hpp"
#include "rt/sched/plan.hpp"
#include "rt/sched/proof_log.hpp"
#include "rt/sched/source_record.hpp"
#include "rt/sched/statistics.hpp"
#include "rt/sched/stop_signal.hpp"
#include "rt/shm/commit_ring.hpp"
#include "rt/shm/doorbell.hpp"
#include "rt/shm/kill_order.hpp"

namespace takt {

/// A parameter value as plain data.
struct PlainParam {
  enum Kind : uint8_t { flag, integer, number, text };
  Kind kind = number;
  uint32_t by_user = 0;  ///< uid of the user who gave it
  int64_t whole = 0;
  double real = 0;
  BoundedText<128> words;
};

/// A parameter value on its way to a running node. One at a time per task.
struct alignas(kCacheLine) ParamMail : PlainParam {
  enum State : uint32_t { empty, posted, taken, refused };
  std::atomic<uint32_t> state{empty};
  uint32_t param = 0;  ///< index into Node::params()
  BoundedText<256> refusal;
};

/// The newest value that a parameter was given while the graph runs. It outlives the process of its node: the next one
/// takes it up before its first job. Written by the thread that runs the task, in the place that is not the newest, and
/// `count` makes it the newest: a kill at any step leaves the value before or this one.
struct alignas(kCacheLine) KeptParam {
  struct Value : PlainParam {
    int64_t at_ns = 0;  ///< when the node accepted it
  };
  std::atomic<uint32_t> count{0};     ///< values accepted so far
  std::atomic<uint32_t> taken_up{0};  ///< how often a restarted process took one up
  std::array<Value, 2> places;
  /// Null if there is none. Stays whole until two more values have come.
  const Value* newest() const {
    const uint32_t n = count.load(std::memory_order_acquire);
    return n > 0 ? &places[n % 2] : nullptr;
  }
};

/// What a process shows of itself to whoever looks after it.
struct LifeSigns {
  std::atomic<int64_t> heartbeat_ns{0};      ///< when its watchdog last looked; 0: not yet
  std::atomic<int64_t> hanging_since_ns{0};  ///< release of that job
  std::atomic<uint32_t> hanging{0};          ///< 1 + index of a task with a job that does not return; 0: none
};

/// How far one process of a run has come, and what it used. A restarted one goes on with the record of the one before.
struct alignas(kCacheLine) ProcessRecord {
  enum State : uint32_t { starting, composed, joined, agreed, running, saving, finished };
  static constexpr size_t kStates = 7;
  std::atomic<uint32_t> state{starting};
  std::array<std::atomic<int64_t>, kStates> reached_ns{};  ///< by state: when it was reached last
  std::atomic<uint32_t> problems{0};                       ///< why it could not be composed: how many, told on stderr
  std::atomic<bool> refused{false};                        ///< a policy was refused to one of its lanes
  std::atomic<int32_t> pid{0};
  std::atomic<uint32_t> restarts{0};  ///< it is not the first of its name
  LifeSigns life;
  KillOrder kill;
  int64_t cpu_ns = 0, simulator_cpu_ns = 0, simulator_in_jobs_ns = 0;

  void reach(State now, int64_t at_ns) {
    reached_ns[now].store(at_ns);
    state.store(now);
  }
};

/// What the spare of a process says of itself, in the pages of that process.
struct alignas(kCacheLine) SpareSign {
  std::atomic<int32_t> ready{0};  ///< number of the process that waits, with its part composed; 0: none yet
};

/// What the supervisor tells the spares of a process. No member can write it.
struct alignas(kCacheLine) SpareOrder {
  std::atomic<int32_t> takes_over{0};  ///< number of the process that does; a futex
};

/// How large the messages of an output can become, once its node is set up.
struct alignas(kCacheLine) CapacityRecord {
  static constexpr uint32_t kTold = 1, kNeverTold = 2;  ///< the latter: its node could not be set up
  std::atomic<uint32_t> known{0};
  Capacity capacity;
  ArrayCounts counts{};
};

/// What is known in advance of a hardware node's data; see SourcePlan.
struct alignas(kCacheLine) SourceFacts {
  static constexpr size_t kLongest = 200;
  std::atomic<bool> known{false};
  int64_t lag_ns = 0, wait_ns = 0;
  BoundedText<kLongest> unknown;
  uint32_t faults = 0;
  bool answers = false;
};

/// What the processes of one run share: statistics, the end of the run, agreement before the start, parameters on their
/// way. One anonymous shared mapping, made before the processes are; it is gone when the last of them is. No two
/// records share a cache line, and what only one process writes lies in pages of its own:
///
///   RunBoard board(plan, 3, process_of_task);
///   if (fork() == 0) board.keep_to(1);  // from here on, a stray store of process 1 into 0's or 2's records ends it
///
/// Common to all are the logs of what was seen, and the commit words. A stop and a mode are asked for in the words of
/// the process that asks, which all others read.
class RunBoard {
 public:
  enum Decision : uint32_t { undecided, as_asked, cooperative };
  enum Carrier : uint32_t { no_carrier, iceoryx, local };

  /// Only the shape of the plan is used: tasks, edges, ports, parameters, and its modes with their rules. `process_of`:
  /// by task; by default all are of process 0. Throws std::runtime_error if there is no memory.
  explicit RunBoard(const Plan& plan, size_t processes = 1, std::span<const size_t> process_of = {});
  ~RunBoard();
  RunBoard(const RunBoard&) = delete;
  RunBoard& operator=(const RunBoard&) = delete;

  /// In a process of the run, once, before it has a second thread: the records of all others, and of the supervisor,
  /// are read-only from here on. Throws std::runtime_error.
  void keep_to(size_t process);

  TaskStatistics& task(size_t t) { return *tasks_[t]; }
  const TaskStatistics& task(size_t t) const { return *tasks_[t]; }
  EdgeStatistics& edge(size_t t, size_t e) { return *edges_[first_edge_[t] + e]; }
  const EdgeStatistics& edge(size_t t, size_t e) const { return *edges_[first_edge_[t] + e]; }
  PortStatistics& port(size_t p) { return *ports_[p]; }
  const PortStatistics& port(size_t p) const { return *ports_[p]; }
  void set_grant(size_t t, const Grant& grant);
  Grant grant(size_t t) const;
  /// Of the jobs of a task.
  CommitRing& commits(size_t t) { return *commits_[t]; }
  /// Of the jobs that make what a port carries; null: nobody makes it.
  CommitRing* commits_of_port(size_t p) { return producers_.find(p) == kNone ? nullptr : commits_[producers_.find(p)]; }
  ParamMail& mail(size_t t) { return *mail_[t]; }
  /// What the node of a task says.
  NodeLog& log(size_t t) { return *logs_[t]; }
  const NodeLog& log(size_t t) const { return *logs_[t]; }
  size_t param_count(size_t t) const { return first_param_[t + 1] - first_param_[t]; }
  /// Parameter `param` (index into Node::params()) of a task.
  KeptParam& kept(size_t t, size_t param) { return *kept_[first_param_[t] + param]; }
  const KeptParam& kept(size_t t, size_t param) const { return *kept_[first_param_[t] + param]; }
  CapacityRecord& capacity(size_t p) { return *capacities_[p]; }
  SourceFacts& source_facts(size_t t) { return *source_facts_[t]; }
  ProcessRecord& process(size_t p) { return *processes_[p]; }
  const ProcessRecord& process(size_t p) const { return *processes_[p]; }
  SpareSign& spare(size_t p) { return *spare_signs_[p]; }
  SpareOrder& spare_order(size_t p) { return *spare_orders_[p]; }
  const SourceRecord& source(size_t t) const { return *sources_[t]; }
  size_t process_count() const { return processes_.size(); }
  /// What all of it takes.
  size_t bytes() const { return bytes_; }

  Modes& modes() { return *modes_; }
  const Modes& modes() const { return *modes_; }
  /// Mode of a job released then, among those of the plan whatever the log holds.
  uint32_t mode_at(int64_t release_ns) const {
    const uint32_t mode = modes().at(release_ns);
    return mode < mode_count_ ? mode : 0;
  }
  /// Asks for the mode `safe_stop`; nothing happens if the run is in it, or the plan has none. Any thread, does not
  /// wait.
  void safe_stop(int64_t from_ns, std::string_view reason);

  /// What job `job` of a task says of its source, at `at_ns`. A loss or a return becomes a fault, and changes the mode
  /// from `from_ns` on as the plan's rules want it. On the thread that runs the task; does not wait.
  void tell_source(size_t t, uint64_t job, const SourceReport& report, int64_t at_ns, int64_t from_ns);
  /// The sources of a process that is dead: what reads from outside among these tasks is lost (`unattended`) until a
  /// job says otherwise. By the supervisor, once nothing of that process runs any more; does not wait.
  void lose_sources(std::span<const size_t> tasks, int64_t at_ns, int64_t from_ns);

  FaultLog& faults() { return shared_->faults; }
  const FaultLog& faults() const { return shared_->faults; }

  /// What was seen above its proof (ProofBound); jobs that used more than their budgets, sources that were late.
  ExcessLog& excesses() { return shared_->excesses; }
  const ExcessLog& excesses() const { return shared_->excesses; }
  OverrunLog& overruns() { return shared_->overruns; }
  const OverrunLog& overruns() const { return shared_->overruns; }
  LateSourceLog& late_sources() { return shared_->late_sources; }
  const LateSourceLog& late_sources() const { return shared_->late_sources; }

  /// Rung by tasks whose messages somebody waits for (TaskPlan::rings).
  Doorbell& published() { return shared_->published; }

  /// Set by the process that answers those who attach.
  MarkLog& marks() { return supervised_->marks; }
  const MarkLog& marks() const { return supervised_->marks; }

  OutageLog& outages() { return supervised_->outages; }
  const OutageLog& outages() const { return supervised_->outages; }
  GroupSigns& group() { return supervised_->group; }
  const GroupSigns& group() const { return supervised_->group; }

  StopSignal& stop() { return *stop_; }
  std::atomic<int64_t>& epoch_ns() { return supervised_->epoch_ns; }  ///< 0: not fixed yet
  int64_t epoch_ns() const { return supervised_->epoch_ns.load(); }
  std::atomic<uint32_t>& decision() { return supervised_->decision; }
  std::atomic<uint32_t>& carrier() { return supervised_->carrier; }  ///< the transport that is up and can be joined
  /// All processes have finished: nobody reads any more what one of them takes along when it leaves.
  std::atomic<bool>& dismissed() { return supervised_->dismissed; }

 private:
  /// What every process writes.
  struct alignas(kCacheLine) Shared {
    FaultLog faults;
    alignas(kCacheLine) ExcessLog excesses;
    alignas(kCacheLine) OverrunLog overruns;
    alignas(kCacheLine) LateSourceLog late_sources;
    Doorbell published;
  };
  /// What the supervisor writes, and a run without one.
  struct alignas(kCacheLine) Supervised {
    StopWord stop;
    ModeLog modes;
    alignas(kCacheLine) OutageLog outages;
    alignas(kCacheLine) MarkLog marks;
    alignas(kCacheLine) GroupSigns group;
    alignas(kCacheLine) std::atomic<int64_t> epoch_ns{0};
    std::atomic<uint32_t> decision{undecided};
    std::atomic<uint32_t> carrier{no_carrier};
    std::atomic<bool> dismissed{false};
  };
  class Placer;
  /// Makes all records in `memory`; null: only counts. The bytes that they take.
  size_t lay_out(const Plan& plan, std::span<const size_t> process_of, std::byte* memory);
  void note_source(size_t t, uint64_t job, SourceState state, int64_t at_ns);
  SourceSet lost_sources() const;
  void follow_mode_rules(bool newly_lost, int64_t from_ns, const char* reason);

  std::byte* memory_ = nullptr;
  size_t bytes_ = 0, mode_count_ = 1, safe_stop_mode_ = kNone;
  std::vector<size_t> first_edge_, first_param_;
  std::vector<std::string> task_names_;
  std::vector<char> has_source_;  ///< by task: a hardware node
  ModeRules mode_rules_;
  PortProducers producers_;
  Shared* shared_ = nullptr;
  Supervised* supervised_ = nullptr;
  std::vector<TaskStatistics*> tasks_;
  std::vector<EdgeStatistics*> edges_;
  std::vector<PortStatistics*> ports_;
  std::vector<GrantRecord*> grants_;
  std::vector<CommitRing*> commits_;
  std::vector<ParamMail*> mail_;
  std::vector<NodeLog*> logs_;
  std::vector<CapacityRecord*> capacities_;
  std::vector<ProcessRecord*> processes_;
  std::vector<SpareSign*> spare_signs_;
  std::vector<SpareOrder*> spare_orders_;
  std::vector<SourceRecord*> sources_;
  std::vector<SourceFacts*> source_facts_;
  std::vector<KeptParam*> kept_;
  std::vector<StopWord*> stop_words_;  ///< of the supervisor, then by process
  std::vector<ModeRequests*> mode_requests_;
  std::vector<EnteredRequests*> entered_requests_;
  std::unique_ptr<StopSignal> stop_;
  std::unique_ptr<Modes> modes_;
  std::vector<size_t> areas_;  ///< where that of the supervisor begins, of each process, and the end
};

}  // namespace takt
