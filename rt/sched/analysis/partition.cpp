// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/partition.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "rt/sched/analysis/integers.hpp"

namespace takt::analysis {
namespace {

struct CoreLoad {
  std::vector<size_t> indexes = {};  ///< in the set
  std::vector<TimedTask> tasks = {};
  double work() const {
    double sum = 0;
    for (const TimedTask& task : tasks) sum += static_cast<double>(task.budget) / static_cast<double>(task.period);
    return sum;
  }
};

class PartitionSearch {
 public:
  PartitionSearch(const TaskSet& set, CorePolicy policy)
      : set_(set), policy_(policy), on_core_(static_cast<size_t>(set.cores)) {
    for (size_t i = 0; i < set.tasks.size(); ++i) {
      const TimedTask& task = set.tasks[i];
      if (task.core < 0) {
        free_.push_back(i);
      } else {
        CoreLoad& core = on_core_[static_cast<size_t>(task.core)];
        core.indexes.push_back(i);
        core.tasks.push_back(task);
      }
    }
    std::stable_sort(free_.begin(), free_.end(), [&](size_t a, size_t b) {
      const TimedTask &one = set_.tasks[a], &other = set_.tasks[b];
      return Wide{one.budget} * other.deadline > Wide{other.budget} * one.deadline;
    });
  }

  /// Of the cores as they are given.
  bool given_cores_fit() {
    return std::all_of(on_core_.begin(), on_core_.end(), [&](const CoreLoad& core) { return fits(core); });
  }

  /// Each task on the first core that takes it, the cores as they are numbered or `evenly`: by their work.
  bool first_fit(bool evenly) {
    const auto given = on_core_;
    for (const size_t task : free_) {
      std::vector<size_t> order(on_core_.size());
      std::iota(order.begin(), order.end(), size_t{0});
      if (evenly)
        std::stable_sort(order.begin(), order.end(),
                         [&](size_t a, size_t b) { return on_core_[a].work() < on_core_[b].work(); });
      if (!std::any_of(order.begin(), order.end(), [&](size_t core) { return put(task, on_core_[core]); })) {
        misfit_ = task;
        on_core_ = given;
        return false;
      }
    }
    return true;
  }

  bool all_assignments(size_t next = 0) {
    if (next == free_.size()) return true;
    bool tried_empty = false;
    for (size_t core = 0; core < on_core_.size() && tests_ < kMostTests; ++core) {
      if (on_core_[core].tasks.empty() && std::exchange(tried_empty, true)) continue;
      if (!put(free_[next], on_core_[core])) continue;
      if (all_assignments(next + 1)) return true;
      take_back(on_core_[core]);
    }
    return false;
  }

  size_t free_tasks() const { return free_.size(); }
  bool conclusive() const { return all_exact_ && tests_ < kMostTests; }
  const TimedTask& misfit() const { return set_.tasks[misfit_]; }

  TaskSet assigned() const {
    TaskSet set = set_;
    for (size_t core = 0; core < on_core_.size(); ++core) {
      for (const size_t i : on_core_[core].indexes) set.tasks[i].core = static_cast<int>(core);
    }
    return set;
  }

 private:
  bool put(size_t task, CoreLoad& core) {
    core.indexes.push_back(task);
    core.tasks.push_back(set_.tasks[task]);
    if (fits(core)) return true;
    take_back(core);
    return false;
  }

  static void take_back(CoreLoad& core) {
    core.indexes.pop_back();
    core.tasks.pop_back();
  }

  bool fits(const CoreLoad& core) {
    ++tests_;
    const Verdict verdict = core_verdict(core.tasks, policy_);
    if (verdict == Verdict::not_proven) all_exact_ = false;
    return verdict == Verdict::schedulable;
  }

  const TaskSet& set_;
  CorePolicy policy_;
  std::vector<CoreLoad> on_core_;
  std::vector<size_t> free_ = {};  ///< densest first
  size_t misfit_ = 0;
  int tests_ = 0;
  bool all_exact_ = true;
};

}  // namespace

Partition partition(TaskSet set, int cores, CorePolicy policy) {
  Partition answer;
  set.cores = cores;
  answer.set = set;
  answer.why = defect(set);
  if (!answer.why.empty()) return answer;
  PartitionSearch search(set, policy);
  if (!search.given_cores_fit()) {
    answer.verdict = search.conclusive() ? Verdict::not_schedulable : Verdict::not_proven;
    answer.why = "the tasks with a given core do not fit on it";
  } else if (search.first_fit(true) || search.first_fit(false) ||
             (search.free_tasks() <= kFewTasks && search.all_assignments())) {
    answer.verdict = Verdict::schedulable;
    answer.set = search.assigned();
  } else {
    const bool none = search.free_tasks() <= kFewTasks && search.conclusive();
    answer.verdict = none ? Verdict::not_schedulable : Verdict::not_proven;
    answer.why = "task '" + search.misfit().name + "' fits on no core beside those of higher density";
    if (none) answer.why += ", and no other assignment fits";
  }
  return answer;
}

}  // namespace takt::analysis
