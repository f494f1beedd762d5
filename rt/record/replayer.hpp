// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rt/record/beginnings.hpp"
#include "rt/record/log_file.hpp"
#include "rt/sched/plan.hpp"
#include "rt/time/clock.hpp"

namespace takt::record {

/// Where a replay parts from its record.
struct Divergence {
  std::string node, port;  ///< port empty: the job as such
  uint32_t job = 0;
  int64_t release_ns = 0;
  std::string what;  ///< "points[17].x (byte 212) is 0.25 instead of 0.5"
};

struct ReplayResult {
  uint64_t jobs = 0, messages = 0;  ///< run, and made by them
  uint64_t compared = 0;            ///< messages that were in the record, whole or as hash
  uint64_t whole = 0;               ///< of them, field by field
  uint64_t different = 0;           ///< messages, or jobs that sent something else than in the record
  uint64_t lacking = 0;             ///< jobs without all that they were given: lost or damaged in the record; not run
  std::string first_lacking;        ///< "stereo job 81: head_camera.pair 122"
  uint64_t restarts = 0;            ///< of tasks, done again
  uint64_t uncommitted = 0;         ///< jobs whose process died before anything of them came out; not run
  uint64_t begun = 0;               ///< tasks that went on from a snapshot
  uint64_t begun_afresh = 0;        ///< of tasks in the middle of the run: without what their nodes remember
  std::string stateless;            ///< one of those, and why
  uint64_t unmade = 0;              ///< messages recorded by their hash only that no recorded job made: not compared
  std::optional<Divergence> first;  ///< of the differences
  std::map<std::string, uint64_t> different_of;  ///< by node
  int64_t recorded_ns = 0;                       ///< from the first release to the last publication
};

/// Runs the jobs of a record again, one after the other, in the order in which they started: each with the inputs and
/// the answers that it had; a job that asks something else is told its start, and the time from there to its deadline.
/// Messages of devices, and of jobs that the record does not have or that cannot be run, come from the record, others
/// from the jobs that are run. One thread.
///
/// Where a task was restarted its node is replaced by a fresh one, which goes on from the messages that the restarted
/// one was handed over. What its process had not published when it died stays away.
class Replayer {
 public:
  struct Options {
    /// By task: its jobs are run; empty: those of all nodes. What the others made comes from the record.
    std::vector<char> run = {};
    /// By task: counts and differences are of these; empty: of all that run.
    std::vector<char> told = {};
    int64_t from_ns = INT64_MIN;  ///< differences of earlier jobs are not told; they run, for what they leave behind
    /// Jobs from here on are run, and those before them that it takes, from the last snapshots on. In a record that
    /// lacks its first jobs nothing before its first snapshots is.
    int64_t begin_ns = INT64_MIN;
    int64_t end_ns = INT64_MAX;  ///< released until then
    /// Called before each job with its planned release: where a replay at the recorded pace waits. May be empty.
    std::function<void(int64_t)> pace = {};
    int64_t epoch_ns = 0;  ///< of the run: what Node::start() of a restarted node is given
    /// Puts a fresh node, set up as before the run, in the place that the plan has for that task. May throw. Empty:
    /// jobs of a restarted task count as lacking.
    std::function<void(size_t)> renew = {};
    /// Called behind each job that was run, while its inputs are still there; false: the replay ends.
    std::function<bool(const Replayer&, const RecordedJob&)> visit = {};
  };
  /// `plan` is that of the record, with nodes set up (devices: shells); both must live as long as this.
  Replayer(const Plan& plan, LogFile& log, const Options& options);
  ~Replayer();
  Replayer(const Replayer&) = delete;
  Replayer& operator=(const Replayer&) = delete;

  /// Once. Stops early if `stop` answers true.
  ReplayResult run(const std::function<bool()>& stop = {});
  /// The newest message that a job made for that port; null: none yet. In visit().
  const MessageHeader* newest(size_t port) const;

 private:
  struct Port;
  class Answers;
  class PortWriter;
  struct Stored;

  bool runs(size_t task) const;
  bool counts(size_t task) const { return options_.told.empty() || options_.told[task] != 0; }
  /// False if a damaged record names what the plan does not have.
  bool fits(const RecordedJob& job) const;
  void note_restarts();
  void begin_tasks();
  bool begin_at(const RecordedEvent& snapshot);
  bool applies(const RecordedEvent& event) const;
  void select_jobs();
  void count_uses();
  template <class Each>
  void for_each_handed_over(const RecordedEvent& event, const Each& each) const;
  const Restart* next_restart(const RecordedJob& job) const;
  void keep_committed(const RecordedJob& job);
  void attach_writers(size_t task);
  void restart_before(const RecordedJob& job);
  bool restart(const RecordedEvent& event);
  bool is_state(size_t task, size_t output) const;
  void use(size_t port, uint64_t sequence);
  void count_unmade();
  /// False: visit() has seen enough.
  bool run_job(const RecordedJob& record);
  bool fill_inputs(const RecordedJob& record);
  Stored* stored(size_t port, uint64_t sequence);
  Stored* load(size_t port, uint64_t sequence);
  std::shared_ptr<Stored> buffer(size_t port);
  void let_go(const RecordedJob& record);
  void settle(const RecordedJob& record);
  void settle_output(const RecordedJob& record, const RecordedJob::Output* told, size_t output);
  void compare(const RecordedJob& record, size_t port, const Stored& made, uint64_t sequence);
  void tell(const RecordedJob& record, size_t port, std::string what);

  const Plan& plan_;
  LogFile& log_;
  const Options options_;
  VirtualClock clock_;
  const std::unique_ptr<Answers> answers_;
  std::vector<Port> ports_;
  std::vector<std::vector<uint64_t>> last_seen_;  ///< by task and edge
  /// By task, in their order, and how many are done.
  struct Restarts {
    std::vector<const RecordedEvent*> events;
    size_t done = 0;
    bool failed = false;  ///< the last one: no job can be run until the next
  };
  std::vector<Restarts> restarts_;
  std::vector<Beginning> beginnings_;  ///< by task
  std::vector<const RecordedJob*> order_;
  std::deque<RecordedJob> committed_;  ///< of those that were cut off: with what came out
  ReplayResult result_;
};

}  // namespace takt::record
