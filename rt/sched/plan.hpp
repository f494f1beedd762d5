// SPDX-License-Identifier: Apache-2.0
// What the executor is given: tasks with their times, ports with their pools. Plain data, made by the composition.
#pragma once
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rt/sched/analysis/overheads.hpp"
#include "rt/sched/mode_rules.hpp"
#include "rt/shm/transport.hpp"
#include "rt/time/rate.hpp"

namespace takt {

class Job;
class Node;

/// What may come between the runtime and the jobs of one node when faults are injected (rt/faults). Called by the
/// thread that runs the job: it keeps the rules of a job, but for the time it takes.
class Disturbance {
 public:
  virtual ~Disturbance() = default;
  /// False: the job released then does not take place, as if its process were gone: released, never completed.
  virtual bool admits(int64_t release_ns) = 0;
  /// Right before Node::run; what it takes is part of the job.
  virtual void before_run(const Job& job) = 0;
};

enum class Policy : uint8_t { deadline, fixed, cooperative };
enum class Criticality : uint8_t { low, high };
/// Budget used up, job still running. Words: continue | degrade | safe_stop.
enum class OnOverrun : uint8_t { proceed, degrade, safe_stop };
/// Deadline passed. Words: continue | skip | reuse_last | safe_stop.
enum class OnMiss : uint8_t { proceed, skip, reuse_last, safe_stop };
/// When a message becomes visible: at its publish instant, or at the job's planned deadline.
enum class PublishAt : uint8_t { asap, let };

std::string_view to_string(Policy policy);
std::string_view to_string(Criticality criticality);
std::string_view to_string(OnOverrun verb);
std::string_view to_string(OnMiss verb);

inline constexpr int64_t kDefaultAnticipate_ns = 200'000, kLongestAnticipate_ns = 1'000'000;
inline constexpr int64_t kDefaultMemory = 256'000'000;
inline constexpr size_t kNone = std::numeric_limits<size_t>::max();

struct EdgePlan {
  size_t input = 0;  ///< index into Node::inputs()
  size_t port = 0;   ///< index into Plan::ports
  uint32_t depth = 1;
  int64_t max_age_ns = 0;  ///< 0: no bound
};

/// What is known in advance of when a hardware node's data come about (its driver tells it: hal's StampLaw).
struct SourcePlan {
  int64_t lag_ns = 0;    ///< a stamp lies at most so long before the release of the job that sends it
  int64_t wait_ns = 0;   ///< so long after its release the job may sleep until its data have come
  std::string unknown;   ///< why there is no bound; empty: these are
  uint32_t faults = 0;   ///< bits of what can be made to go wrong with it while it runs; hal gives them their names
  bool answers = false;  ///< people answer it from a screen in another process
};

struct TaskPlan {
  std::string name;
  Node* node = nullptr;
  bool device = false;  ///< a hardware node; its CPU time is accounted apart
  SourcePlan source;    ///< of a hardware node
  std::optional<Rate> rate;
  size_t on_task = kNone;  ///< producer whose publication releases this task
  size_t on_port = kNone;  ///< ... of this port
  int every = 1;
  int64_t min_interval_ns = 0;
  int64_t offset_ns = 0;
  int64_t deadline_ns = 0;  ///< relative to the release, > 0
  int64_t budget_ns = 0;    ///< 0: not stated, nothing enforced
  Criticality criticality = Criticality::low;
  OnOverrun on_overrun = OnOverrun::proceed;
  OnMiss on_miss = OnMiss::proceed;
  PublishAt publish = PublishAt::asap;
  int core = -1;  ///< under `fixed`: the CPU of the lane that this task heads; -1: chosen (lane_tasks.hpp)
  int64_t memory_bytes = kDefaultMemory;  ///< what its jobs may take from the heap beyond what they give back
  std::vector<EdgePlan> edges;
  std::vector<std::vector<size_t>> joins;  ///< groups of indexes into Node::inputs()
  std::vector<size_t> ports;               ///< per output of the node: index into Plan::ports
  Disturbance* disturbance = nullptr;      ///< null: none
  bool rings = false;                      ///< its messages ring the board's doorbell: other machines wait for them
  int64_t state_every_ns = 0;              ///< its last output, `state`, has one message in so much time; 0: none
};

/// A mode that the run can change to: the tasks it leaves out are paused and keep what they have reserved.
struct ModePlan {
  std::string name;
  std::vector<char> runs;  ///< by task
};

struct Plan {
  Policy policy = Policy::cooperative;
  std::vector<int> cores;
  analysis::Overheads overheads = {};  ///< of the machine; under `fixed` lanes are put on cores so that these fit, too
  /// A worker may be woken this long before a release to be there in time (Anticipation); 0: none is.
  int64_t anticipate_ns = 0;
  /// Processes that the run has with the finest isolation, each with a watchdog: the same for every isolation, so that
  /// what is proven does not depend on it.
  int64_t processes = 1;
  std::vector<TaskPlan> tasks;
  std::vector<PortPlan> ports;
  std::string mode = "full";    ///< of the start
  std::vector<ModePlan> modes;  ///< [0] is that of the start, with all tasks; empty: there is no other
  size_t safe_stop = kNone;     ///< index into modes
  ModeRules mode_rules = {};    ///< which mode the loss of sources leads to; without rules it leads to none
};

/// Which task makes what a port carries.
class PortProducers {
 public:
  explicit PortProducers(const Plan& plan);
  /// kNone: nobody.
  size_t find(size_t port) const { return port < by_port_.size() ? by_port_[port] : kNone; }

 private:
  std::vector<size_t> by_port_;
};

/// Rate at which a task runs: its own, or that of the producer whose output releases it (divided by `every`); 0 if
/// none.
double effective_rate_hz(const Plan& plan, size_t task);

}  // namespace takt
