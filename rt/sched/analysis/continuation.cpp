// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/continuation.hpp"

#include <limits>

#include "rt/sched/analysis/busy_start.hpp"

namespace takt::analysis {
namespace {

class Search {
 public:
  Search(const std::vector<TimedTask>& tasks, CorePolicy policy, const Continuation& piece)
      : own_(tasks[piece.task]), edf_(policy == CorePolicy::edf), piece_(piece) {
    for (size_t i = 0; i < tasks.size(); ++i)
      if (i != piece.task && (edf_ || tasks[i].deferrable || tasks[i].priority >= own_.priority)) add(tasks[i]);
  }

  std::optional<Ticks> longest() {
    std::vector<TimedTask> all = others_;
    all.push_back(own_);
    const std::vector<TimedTask> planned = tasks_with_offsets(all);
    const std::optional<Ticks> common = common_period(planned);
    if (!common || *common > kLongest / 4) return std::nullopt;
    longest_ = piece_.work;
    if (!own_.sporadic) {
      for (Ticks release = floor_mod(own_.offset, own_.period); release < *common; release += own_.period)
        if (!try_release(release)) return std::nullopt;
      return longest_;
    }
    const auto starts = busy_starts(all);  // it may be released together with anything
    if (!starts) return std::nullopt;
    for (const Candidate& start : *starts)
      if (!try_instant(start.at, start.at, kLongest)) return std::nullopt;
    return longest_;
  }

 private:
  /// A share that is deferred may come at once or at the end of its period.
  void add(TimedTask other) {
    if (other.deferrable && !edf_) other.jitter += other.period - other.budget;
    others_.push_back(std::move(other));
  }

  bool try_release(Ticks release) {
    const Ticks first = release - piece_.slack, last = release + piece_.ready_by + piece_.slack;
    std::vector<Ticks> instants{last};
    for (const TimedTask& other : others_) {
      if (other.sporadic) continue;
      const Ticks phase = other.offset + other.jitter;
      for (Ticks at = first + floor_mod(phase - first, other.period); at < last; at += other.period) {
        if (!effort_.spend(1)) return false;
        const Ticks ahead = edf_ ? release + own_.deadline + piece_.slack - (at - other.jitter + other.deadline) : 1;
        if (ahead < 0) break;  // due later, as all that follow
        // What is ready at the release and goes before the job has been served before this one did anything; of two
        // that are due together one goes first until it is done.
        if (at != release || piece_.slack > 0) instants.push_back(at);
      }
    }
    std::sort(instants.begin(), instants.end());
    Ticks earliest = release;  // that moves to the next of them
    for (const Ticks at : instants) {
      if (!try_instant(release, at, piece_.done_by + piece_.slack - (earliest - release))) return false;
      earliest = std::max(earliest, at - piece_.slack);
    }
    return true;
  }

  /// `left`: the response is no longer than that in any case.
  bool try_instant(Ticks release, Ticks at, Ticks left) {
    const BusyStart busy(others_, at);
    const auto work = [&](Ticks length) {
      Wide sum = own_.blocking + Wide{piece_.work};
      for (size_t i = 0; i < others_.size(); ++i)
        sum += Wide{others_[i].budget} * std::min(busy.jobs(others_[i], i, at + length - 1), in_time(busy, i, release));
      return sum;
    };
    const std::optional<Ticks> response = fixed_point(1, others_.size() + 1, effort_, work);
    if (!response) return false;
    longest_ = std::max(longest_, std::min(*response, left));
    return true;
  }

  /// How many of the jobs of another task from there on are due before the own one may be.
  int64_t in_time(const BusyStart& busy, size_t i, Ticks release) const {
    if (!edf_) return std::numeric_limits<int64_t>::max();
    const TimedTask& other = others_[i];
    const Ticks due = release + own_.deadline + piece_.slack - other.deadline;  // the last such release
    if (!other.sporadic) return busy.jobs(other, i, due);
    const Ticks first = release - other.jitter - piece_.slack;
    return due < first ? 0 : (due - first) / other.period + 1;
  }

  const TimedTask own_;
  const bool edf_;
  const Continuation piece_;
  std::vector<TimedTask> others_;
  Ticks longest_ = 0;
  Effort effort_;
};

}  // namespace

std::optional<Ticks> continuation_response(const std::vector<TimedTask>& tasks, CorePolicy policy,
                                           const Continuation& piece) {
  if (policy == CorePolicy::non_preemptive_edf) return piece.work;
  return Search(tasks, policy, piece).longest();
}

}  // namespace takt::analysis
