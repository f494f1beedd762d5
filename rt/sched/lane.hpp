// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "rt/sched/stop_signal.hpp"
#include "rt/sched/task.hpp"

namespace takt {

/// Tasks that follow one another: a head with a rate, and the tasks released by what it (or a follower) publishes. They
/// run back to back on one worker, without a wake-up between them. One thread at a time.
class Lane {
 public:
  /// `members`: head first, every follower after its producer; indexes into `tasks`.
  Lane(std::vector<size_t> members, const std::vector<std::unique_ptr<Task>>& tasks);

  void set_epoch(int64_t epoch_ns) {
    origin_ns_ = epoch_ns + head().plan().offset_ns;
    go_to(0);
  }
  /// Instead, if others began at that epoch long ago: with the first release after `now_ns`.
  void join(int64_t epoch_ns, int64_t now_ns);
  /// Planned instant of the next release.
  int64_t next_release_ns() const { return next_release_ns_; }
  /// Instant by which the whole pass is due (lane_span_ns).
  int64_t next_deadline_ns() const { return next_release_ns_ + span_ns_; }

  /// Runs the next job of the head and the jobs it releases; afterwards moves on to the next release still wanted.
  /// Raises `stop` at the head's release if a device's recorded data ended.
  void run_next(const Clock& clock, StopSignal& stop);
  /// Has at hand what the next pass will need: a job comes to caches that others have filled since the last one. Only
  /// reads, and only while no job of the lane runs.
  void rehearse() const;
  /// Where there is no time for that: asks for what the head will touch first, and waits for none of it. Any thread.
  void fetch_ahead() const { head().fetch_ahead(); }
  /// In virtual time, job by job: the member to run, and its release.
  struct Activation {
    size_t member = 0;
    int64_t release_ns = 0;
  };
  /// Latches and works; the time that the job is taken to need, `duration_ns` being that at full quality.
  int64_t begin(const Activation& job, int64_t duration_ns);
  /// Publishes and counts; adds the followers that this releases.
  JobEnd finish(const Activation& job, int core, std::vector<Activation>& released);
  /// After the last job of a pass: moves on to the next release still wanted.
  void go_on(int64_t now_ns, int64_t end_ns);
  /// Number of the job that this member begins next.
  uint64_t index(size_t member) const { return member == 0 ? static_cast<uint64_t>(next_) : followers_[member].index; }

  /// What the watchdog sees of the worker that runs this lane.
  JobWatch& watch() { return *watch_; }

  Task& head() const { return *tasks_.front(); }
  const std::vector<size_t>& members() const { return members_; }
  const Rate& rate() const { return *head().plan().rate; }

 private:
  struct Follower {
    size_t producer = 0;  ///< member index
    int64_t publications = 0, last_release_ns = 0;
    uint64_t index = 0;
  };

  /// The instant is worked out here, after a job, so that nothing need be divided between a release and its job.
  void go_to(int64_t index) {
    next_ = index;
    next_release_ns_ = rate().release_ns(origin_ns_, index);
    watch_->expect(next_release_ns_);
  }
  bool activates(size_t member, int64_t visible_at_ns);
  void skip_passed(int64_t now_ns, int64_t end_ns);

  std::vector<size_t> members_;
  std::unique_ptr<JobWatch> watch_ = std::make_unique<JobWatch>();
  std::vector<Task*> tasks_;
  std::vector<Follower> followers_;  ///< by member index; [0] unused
  std::vector<int64_t> visible_;     ///< of the pass under way: when each member's output became visible
  std::vector<char> ran_;
  int64_t origin_ns_ = 0, span_ns_ = 0;
  int64_t next_ = 0, next_release_ns_ = 0;
};

/// Groups tasks into lanes: each task with a rate heads one, each `on` task joins its producer's. Indexes into the
/// plan's tasks, heads first, followers after their producers.
std::vector<std::vector<size_t>> lane_members(const Plan& plan);
/// Low-criticality tasks that a high one of the same lane waits for though it needs nothing of them: {low, high}. One
/// that does not return would stop the high one as well.
std::vector<std::pair<size_t, size_t>> low_before_high(const Plan& plan);
/// CPU time that one pass of a lane may use.
int64_t lane_budget_ns(const Plan& plan, const std::vector<size_t>& members);
/// Bound of the time before a release at which a worker of that lane may be woken (Plan::anticipate_ns): no more than a
/// twentieth of what the pass has.
int64_t longest_lead_ns(const Plan& plan, const std::vector<size_t>& members);
/// So long after its release a worker of that lane may sleep for what its head, a hardware node, has asked for.
int64_t lane_wait_ns(const Plan& plan, const std::vector<size_t>& members);
/// Longest time from the head's release to the last follower's deadline.
int64_t lane_span_ns(const Plan& plan, const std::vector<size_t>& members);

}  // namespace takt
