// SPDX-License-Identifier: Apache-2.0
// A scenario at work: its faults bound to one run. One object per process of a run; each binds what it owns.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "graph/faults/scenario.hpp"
#include "rt/faults/faulty_transport.hpp"
#include "rt/faults/load.hpp"
#include "rt/faults/node_faults.hpp"
#include "rt/faults/strike_counts.hpp"
#include "rt/record/faulty_sink.hpp"
#include "rt/time/clock.hpp"

namespace takt::graph {

/// A process is due to be struck.
struct ProcessStrike {
  FaultKind kind = FaultKind::kill;      ///< kill, kill_at_step or stop_process
  std::string process;                   ///< subsystem, or "devices"
  int64_t at_ns = 0;                     ///< since the epoch
  int64_t for_ns = 0;                    ///< stopped, or (in virtual time) gone, for so long
  size_t fault = 0;                      ///< index into Scenario::faults
  MessageStep step = MessageStep::none;  ///< of kill_at_step, with the output
  std::string output = {};
  uint32_t passes = 0;  ///< instants of the step that come before: the strikes of one fault take turns
};

class Injection {
 public:
  /// `ports` of the plan; `processes`: each subsystem is one, so that a node that hangs takes the others of its own
  /// along. Before other processes of the run are forked: they share the counts.
  Injection(Scenario scenario, const GraphSpec& graph, size_t ports, bool processes);
  ~Injection();
  Injection(const Injection&) = delete;
  Injection& operator=(const Injection&) = delete;

  const Scenario& scenario() const { return scenario_; }

  /// Once the ports are sized, before the pools are made: room for what the faults add to them.
  void make_room(Plan& plan);
  /// Puts the faults of jobs into the plan, to be called before the executor copies it. In virtual time so, too, the
  /// absence of killed processes. Clock, epoch (0: not known yet) and this outlive the run.
  void disturb(Plan& plan, const Clock& clock, const std::atomic<int64_t>& epoch_ns);
  /// The transport with the message faults of the plan's outputs. As above.
  std::unique_ptr<Transport> wrap(std::unique_ptr<Transport> transport, const Plan& plan, const Clock& clock,
                                  const std::atomic<int64_t>& epoch_ns);
  /// In virtual time: `inner` (empty: budgets) plus what disturbed jobs need more.
  std::function<int64_t(size_t task, uint64_t job)> durations(std::function<int64_t(size_t, uint64_t)> inner,
                                                              const Plan& plan) const;
  /// The disk of the record; null if nothing is wrong with it.
  std::unique_ptr<mcap::Sink> disk(mcap::Sink& inner, const Clock& clock, const std::atomic<int64_t>& epoch_ns);
  /// Loads on the machine, until end_loads(). `epoch_ns` is of CLOCK_MONOTONIC.
  void begin_loads(const std::atomic<int64_t>& epoch_ns);
  void end_loads() { loads_.reset(); }

  /// The strikes on processes before that instant that were not given yet, in order.
  std::vector<ProcessStrike> due(int64_t until_ns);
  /// All of them.
  const std::vector<ProcessStrike>& process_strikes() const { return strikes_; }

  /// How often each fault struck, by index; what that means is said by its kind. A process that was struck by somebody
  /// else is told here.
  std::vector<uint64_t> struck() const;
  void count_strike(size_t fault) { counts_.faults()[fault].fetch_add(1); }
  /// Messages that nodes handed over and that were neither published nor withheld by a fault, and the other way round.
  uint64_t unaccounted(const std::function<uint64_t(size_t port)>& sent) const;
  /// Nodes whose own jobs the faults strike: nothing is promised for them.
  const std::vector<std::string>& struck_nodes() const { return struck_nodes_; }

 private:
  std::vector<std::string> nodes_of(const FaultSpec& fault) const;
  void add_all_struck_by(const FaultSpec& fault, std::vector<std::string>& nodes) const;
  void add_all_of(const std::string& process, std::vector<std::string>& nodes) const;
  void plan_process_strikes();

  const Scenario scenario_;
  const GraphSpec& graph_;
  const bool processes_;
  std::vector<ProcessStrike> strikes_;
  size_t given_ = 0;
  std::vector<std::string> struck_nodes_;
  std::vector<size_t> message_faults_;  ///< index into Scenario::faults of each
  faults::StrikeCounts counts_;
  std::vector<size_t> ports_;  ///< of each message fault; kNone: the plan does not have it
  std::map<size_t, std::unique_ptr<faults::NodeFaults>> node_faults_;  ///< by task
  std::unique_ptr<faults::Loads> loads_;
};

}  // namespace takt::graph
