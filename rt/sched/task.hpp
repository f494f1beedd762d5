// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "rt/memory/memory_use.hpp"
#include "rt/node.hpp"
#include "rt/sched/job_watch.hpp"
#include "rt/sched/latch.hpp"
#include "rt/sched/quality.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/time/clock.hpp"
#include "rt/trace/event.hpp"

namespace takt {

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
  /// Task `index` of the plan; counts into `board`, takes parameters from it.
  Task(const Plan& plan, size_t index, Transport& transport, const Clock& clock, RunBoard& board);
  ~Task();

  /// Runs job `index` released at `release_ns`.
  JobEnd run(uint64_t index, int64_t release_ns) {
    begin(index, release_ns);
    return finish();
  }
  /// Asks for what the next job will touch first, without waiting for it: the caches are others' after a sleep, and
  /// line after line a job would wait for its own. Any thread.
  void fetch_ahead() const;
  /// Looks at what the next job will look at first, so that it lies in the caches then. Before that job, on its thread.
  void rehearse(int64_t release_ns) const;
  /// Its first half: latches and works. In virtual time a job is taken to need `duration_ns` at full quality; the time
  /// it needs at its level is the answer.
  int64_t begin(uint64_t index, int64_t release_ns, int64_t duration_ns = 0);
  /// Its second half: publishes, on the CPU that the job is taken to run on (virtual time), and gives back its inputs.
  JobEnd finish(int modelled_cpu = 0);
  /// Tells its jobs to the watchdog, as member `member` of its lane. Before the first job.
  void set_watch(JobWatch& watch, uint32_t member) {
    watch_ = &watch;
    member_ = member;
  }
  /// Counts the job that run() has just ended. Apart from it, so that in a lane no follower waits for the counting of
  /// its producer; `page_faults` are those since the last count on this thread.
  void count(uint64_t page_faults);
  /// Takes the jobs released at or after the end of the run out of the counts: a stop, or the end of recorded data, is
  /// told by one job while others released at that very instant may be under way. After the run.
  void forget_from(int64_t end_ns);
  /// True if the last job published (or repeated) this port.
  bool published(size_t port) const;

  /// Counts releases `first` to `end` - 1 as skipped, apart from those whose mode leaves this task out. Of a task with
  /// a rate. Any number of them takes the same time, unless its thread is traced.
  void skip(int64_t first, int64_t end, int64_t origin_ns);

  const TaskPlan& plan() const { return plan_; }
  TaskStatistics& statistics() { return statistics_; }
  const TaskStatistics& statistics() const { return statistics_; }
  /// Starts the node. In a process that was restarted, with the newest message of each of its outputs and the values
  /// that its parameters were given while the graph runs.
  void start(int64_t epoch_ns, Transport* restarted);
  /// After the run: what the writers counted goes onto the board, and what threads of the node used.
  void settle();
  const Latch& latch() const { return latch_; }
  const Writer& writer(size_t output) const { return *writers_[output]; }

 private:
  /// How one of the last jobs was counted.
  struct Outcome {
    int64_t release_ns = 0;
    std::atomic<uint64_t>* counter = nullptr;
    bool late = false;
  };

  struct Mode {
    std::string name;
    bool runs = true;
  };
  /// The release passes without a job.
  void pass_over(int64_t now_ns, bool count);
  /// Lets the node work, under the eyes of the watchdog.
  void work(Job& job, int64_t release_ns);
  Fault fault_now(Fault::Kind kind, uint64_t job) const;
  void tell_exception(const Job& job, const char* what);
  void tell_notice(const Job& job);
  /// Tells that a job asked for more memory than it may have; once.
  void tell_refused_memory();
  /// False if the requests visible at the release stop this task, or pace it past this job.
  bool wanted(uint64_t index) const;
  void take_mail();
  void publish(JobEnd& end, int64_t deadline_ns);
  /// What a commit is of: the messages that the job made, or the former ones again.
  enum class Offer : uint8_t { made, former };
  CommitRing::Filled commit(const CommitRing::Terms& terms, Offer offer);
  /// Saves what the node remembers, if the time has come for it.
  void save_state();
  bool state_is_due() const { return ended_.release_ns / plan_.state_every_ns != state_slot_; }
  /// False, and told, if the job wrote where it should not.
  bool outputs_intact();
  void announce(size_t output, uint32_t commit, Offer offer);
  void settle_output(size_t output, const CommitRing::Filled& out, Offer offer);
  void pass(MessageStep step) const;
  /// Tells that a commit word was overwritten.
  void tell_spoiled();
  void count_end();
  void trace_param(trace::Kind kind, size_t param, const PlainParam& given) const;
  void trace_start() const;
  void trace_inputs() const;
  void trace_end() const;
  void trace_offer(size_t output, bool repeat) const;
  void trace_restart() const;
  void ask_for_safe_stop(const char* why);
  void count_level(int64_t response_ns);
  void count_age(size_t port, int64_t visible_at_ns, int64_t stamp_ns);

  const TaskPlan plan_;
  const Clock& clock_;
  const bool modelled_;      ///< on virtual time
  std::vector<Mode> modes_;  ///< as Plan::modes
  RunBoard& board_;
  const size_t index_;
  TaskStatistics& statistics_;
  LogWriter log_;
  JobWatch* watch_ = nullptr;
  uint32_t member_ = 0;
  JobCalls calls_;
  uint64_t jobs_run_ = 0, spoiled_told_ = 0;
  std::atomic<uint64_t> begun_{0};  ///< the job that looks at its inputs
  CommitRing& commits_;
  Latch latch_;
  QualityControl quality_;
  std::vector<std::unique_ptr<Writer>> writers_;
  std::vector<bool> published_;
  std::vector<uint64_t> sequences_;  ///< of the newest message of each output
  std::vector<uint64_t> handed_;     ///< by output: the message that the restarted node went on from; 0: none
  bool restarted_ = false;           ///< and no job has begun since
  int64_t state_slot_ = -1;          ///< of TaskPlan::state_every_ns: that of the last state that came out
  /// The job that run() has ended and count() not yet counted.
  struct Ended {
    bool ran = false, paused = false, new_input = false, no_result = false;
    size_t stale = 0;
    uint32_t mode = 0;  ///< index into Plan::modes, as the job sees it
    uint64_t index = 0;
    int64_t release_ns = 0, started_ns = 0, published_ns = 0, publish_took_ns = 0;
    int64_t exec_ns = 0;  ///< what counts against the budget: CPU time, or what the job was taken to need
    int cpu = -1, level = 0;
    JobEnd end;
    ThreadUse used;
    std::optional<SourceReport> source;
    int64_t source_late_ns = 0;
  } ended_;
  std::vector<int64_t> sent_stamps_ns_;  ///< of the same job, per output; kNothingSent
  static constexpr int64_t kNothingSent = INT64_MIN;
  const InputPort* first_input_ = nullptr;  ///< of those connected, `control` apart
  std::array<Outcome, 16> outcomes_;        ///< ring of the last jobs; far more than fit into the moment of a stop
  size_t outcome_count_ = 0;
};

}  // namespace takt
