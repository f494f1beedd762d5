// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "rt/memory/memory_use.hpp"
#include "rt/sched/latch.hpp"
#include "rt/time/clock.hpp"

namespace takt {

/// What the jobs of one task did. Written by the thread that runs the task; the atomics may be read at any time.
struct TaskStatistics {
  std::atomic<uint64_t> released{0};  ///< of `on` tasks only; a rate's releases are computed outside the executor
  std::atomic<uint64_t> completed{0}, skipped{0}, reused{0}, deadline_misses{0}, budget_overruns{0}, stale_inputs{0};
  std::atomic<uint64_t> new_inputs{0};  ///< jobs whose first input was new: distinct input stamps
  std::atomic<uint64_t> no_result{0};
  std::atomic<int64_t> last_exec_ns{0}, last_response_ns{0};
  uint64_t allocations = 0, page_faults = 0;
  int64_t cpu_ns = 0, preempted_ns = 0;
  Histogram lateness, exec, response, publish;
  std::vector<Histogram> output_age;  ///< per output: stamp of a message to its publication

  /// Drift of the release grid: least lateness of the last 100 jobs minus that of the first 100, us. Zero if releases
  /// stay on the planned instants, however long the run.
  double drift_us() const;
  void add_lateness(int64_t ns);

 private:
  static constexpr size_t kWindow = 100;
  std::array<int64_t, kWindow> first_{}, last_{};
};

/// How a job ended.
struct JobEnd {
  bool end_of_data = false;
  bool late = false;
  int64_t visible_at_ns = 0;  ///< of what it published
  int64_t finished_ns = 0;
};

/// One node with its edges: latches, runs, publishes, counts. One thread at a time.
class Task {
 public:
  Task(const TaskPlan& plan, Transport& transport, const Clock& clock, std::string mode);
  ~Task();

  /// Runs job `index` released at `release_ns`. With modelled_ns >= 0 (virtual time) the job is taken to finish that
  /// long after its release; otherwise the clock is read.
  JobEnd run(uint64_t index, int64_t release_ns, int64_t modelled_ns = -1);
  /// Takes the jobs released at or after the end of the run out of the counts: a stop, or the end of recorded data, is
  /// told by one job while others released at that very instant may be under way. After the run.
  void forget_from(int64_t end_ns);
  /// True if the last job published (or repeated) this port.
  bool published(size_t port) const;

  const TaskPlan& plan() const { return plan_; }
  TaskStatistics& statistics() { return statistics_; }
  const TaskStatistics& statistics() const { return statistics_; }
  const Latch& latch() const { return latch_; }
  const Writer& writer(size_t output) const { return *writers_[output]; }

 private:
  /// How one of the last jobs was counted.
  struct Outcome {
    int64_t release_ns = 0;
    std::atomic<uint64_t>* counter = nullptr;
    bool late = false;
  };

  void publish(JobEnd& end, int64_t deadline_ns, bool modelled);
  void settle_output(size_t output, bool late, int64_t now_ns, int64_t visible_at_ns);

  const TaskPlan plan_;
  const Clock& clock_;
  const std::string mode_;
  Latch latch_;
  std::vector<std::unique_ptr<Writer>> writers_;
  std::vector<bool> published_;
  TaskStatistics statistics_;
  std::array<Outcome, 16> outcomes_;  ///< ring of the last jobs; far more than fit into the moment of a stop
  size_t outcome_count_ = 0;
};

}  // namespace takt
