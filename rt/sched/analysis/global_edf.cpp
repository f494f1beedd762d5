// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/global_edf.hpp"

#include <algorithm>
#include <numeric>

#include "rt/sched/analysis/integers.hpp"

namespace takt::analysis {
namespace {

/// A task with jitter and blocking charged, all that the tests look at.
struct Sporadic {
  Ticks period, deadline, budget;
};

std::vector<Sporadic> charged(const TaskSet& set) {
  std::vector<Sporadic> tasks;
  for (const TimedTask& t : set.tasks)
    tasks.push_back({t.period - t.jitter, std::min(t.deadline, t.period) - t.jitter, t.budget + t.blocking});
  return tasks;
}

/// A job alone fits into its deadline.
bool each_fits(const std::vector<Sporadic>& tasks) {
  return std::all_of(tasks.begin(), tasks.end(), [](const Sporadic& t) { return t.budget <= t.deadline; });
}

/// Least common multiple of the deadlines, 0 if it is too large to multiply budgets with.
Ticks common_deadline(const std::vector<Sporadic>& tasks) {
  constexpr Ticks kLargest = Ticks{1} << 61;
  Wide multiple = 1;
  for (const Sporadic& t : tasks) {
    multiple = multiple / std::gcd(static_cast<Ticks>(multiple), t.deadline) * t.deadline;
    if (multiple > kLargest) return 0;
  }
  return static_cast<Ticks>(multiple);
}

/// What task i can run at most in a window of that length: its first job as late as `response` allows, the others as
/// early as they can (Bertogna and Cirinei 2007, Eq. 4).
Ticks workload(const Sporadic& i, Ticks response, Ticks length) {
  const Ticks reach = length + response - i.budget;
  if (reach < 0) return 0;
  const Ticks whole = reach / i.period;
  return whole * i.budget + std::min(i.budget, reach - whole * i.period);
}

/// What task i can run at most in the window of a job with relative deadline `window`, by jobs whose deadlines are not
/// behind that of the job (the same paper, Eq. 8): only those come before it.
Ticks urgent_workload(const Sporadic& i, Ticks response, Ticks window) {
  const Ticks whole = window / i.period;
  const Ticks slack = i.deadline - response;
  return whole * i.budget + std::min(i.budget, std::max<Ticks>(0, window - whole * i.period - slack));
}

/// The largest time for which the interfering tasks can keep all m cores busy at once: the x with
/// sum(min(I_i, x)) = m * x, in whole ticks. Sorts `interference`.
Ticks all_cores_busy(std::vector<Ticks>& interference, Ticks m) {
  std::sort(interference.begin(), interference.end(), std::greater<>());
  Wide rest = std::accumulate(interference.begin(), interference.end(), Wide{0});
  Wide busy = rest / m;
  for (Ticks alone = 1; alone < m && alone <= static_cast<Ticks>(interference.size()); ++alone) {
    rest -= interference[static_cast<size_t>(alone - 1)];
    busy = std::min(busy, rest / (m - alone));
  }
  return static_cast<Ticks>(std::min(busy, Wide{kLongest}));
}

/// Response bound of task k given those of the others; -1 beyond its deadline.
Ticks bounded_response(const std::vector<Sporadic>& tasks, size_t k, const std::vector<Ticks>& responses, Ticks m) {
  std::vector<Ticks> urgent(tasks.size()), interference;
  for (size_t i = 0; i < tasks.size(); ++i) urgent[i] = urgent_workload(tasks[i], responses[i], tasks[k].deadline);
  for (Ticks response = tasks[k].budget;;) {
    interference.clear();
    for (size_t i = 0; i < tasks.size(); ++i)
      if (i != k) interference.push_back(std::min(workload(tasks[i], responses[i], response), urgent[i]));
    const Ticks next = tasks[k].budget + all_cores_busy(interference, m);
    if (next > tasks[k].deadline) return -1;
    if (next <= response) return response;
    // Any response that is not exceeded bounds; steps of at least this size keep tiny budgets from creeping up on it.
    response = std::max(next, std::min(response + tasks[k].deadline / 4096, tasks[k].deadline));
  }
}

/// What task i can run in a window of that length: by jobs that arrive and are due in it, and with one more that was
/// released before it.
struct Demand {
  Ticks without, with;
};

Demand demand(const Sporadic& i, Ticks length) {
  const Ticks whole = length / i.period, rest = length - whole * i.period;
  return {(whole + (rest < i.deadline ? 0 : 1)) * i.budget, whole * i.budget + std::min(i.budget, rest)};
}

/// BAR of one task: the window starts `extra` before the release of the job that would miss.
class CarryIn {
 public:
  CarryIn(const std::vector<Sporadic>& tasks, size_t k, Ticks m) : tasks_(tasks), job_(tasks[k]), k_(k), m_(m) {}

  bool fits(size_t max_points) {
    const Ticks last = longest_extra();
    std::vector<Ticks> points{0};
    for (const Sporadic& i : tasks_)
      if (!add_points(i, last, max_points, points)) return false;
    // Downwards, as QPA goes (Zhang and Burns 2009): what the others take grows with the window, so a shorter one fits
    // as well, down to where a miss needs no more than that. It leaves out all but a few of the points.
    for (Ticks extra = last; extra >= 0;) {
      const Wide taken = taken_at(extra);
      if (taken >= Wide{m_} * busy_at(extra)) return false;
      extra = last_up_to(static_cast<Ticks>(taken / m_) - busy_at(0), points);
    }
    return true;
  }

 private:
  /// Beyond this the demand bound alone fits (the paper, Eq. 12), rounded up.
  Ticks longest_extra() const {
    double utilisation = 0, late = 0;
    std::vector<Ticks> budgets;
    for (const Sporadic& i : tasks_) {
      const double u = static_cast<double>(i.budget) / static_cast<double>(i.period);
      utilisation += u;
      late += static_cast<double>(i.period - i.deadline) * u;
      budgets.push_back(i.budget);
    }
    std::sort(budgets.begin(), budgets.end(), std::greater<>());
    for (size_t i = 0; i + 1 < static_cast<size_t>(m_) && i < budgets.size(); ++i)
      late += static_cast<double>(budgets[i]);
    const double free = static_cast<double>(m_) - utilisation;
    if (free <= 1e-9) return -1;
    const double extra =
        (late + static_cast<double>(m_) * static_cast<double>(job_.budget)) / free - static_cast<double>(job_.deadline);
    return extra < 0 ? 0 : static_cast<Ticks>(std::min(extra * (1 + 1e-6) + 1, 4e18));
  }

  /// Between these lengths both sides change monotonically against each other: steps of the demand, both ends of the
  /// ramps of the carry-in, and where a term stops being cut off by the window.
  bool add_points(const Sporadic& i, Ticks last, size_t max_points, std::vector<Ticks>& points) const {
    if (last < 0) return false;
    const auto add = [&](Ticks extra) {
      for (const Ticks e : {extra - 1, extra})
        if (e >= 0 && e <= last) points.push_back(e);
    };
    const Ticks end = last + job_.deadline;
    for (Ticks whole = 0, at = 0; at <= end; ++whole, at += i.period) {
      if (points.size() > max_points) return false;
      add(at + i.deadline - job_.deadline);
      add(at - job_.deadline);
      add(at + i.budget - job_.deadline);
      const Ticks work = (whole + 1) * i.budget;
      add(work - (job_.deadline - job_.budget));
      add(work - job_.budget);
    }
    points.push_back(last);
    return true;
  }

  /// The largest of the points that are not above `most`; -1 if there is none.
  static Ticks last_up_to(Ticks most, const std::vector<Ticks>& points) {
    Ticks last = -1;
    for (const Ticks point : points)
      if (point <= most) last = std::max(last, point);
    return last;
  }

  /// A miss needs all cores busy with others for longer than the job can spare, so in whole ticks for one more.
  Ticks busy_at(Ticks extra) const { return extra + job_.deadline - job_.budget + 1; }

  /// What the others can run in that at most on all cores, m - 1 of them with work carried in. Terms cut at what the
  /// job can spare would let a single task on one core never fail.
  Wide taken_at(Ticks extra) {
    Wide sum = 0;
    more_.clear();
    for (size_t i = 0; i < tasks_.size(); ++i) {
      const Ticks own = i == k_ ? job_.budget : 0, most = i == k_ ? extra : busy_at(extra);
      const Demand all = demand(tasks_[i], extra + job_.deadline);
      const Ticks without = std::min(all.without - own, most);
      sum += without;
      more_.push_back(std::max<Ticks>(0, std::min(all.with - own, most) - without));
    }
    const auto carried = more_.begin() + std::min(static_cast<ptrdiff_t>(m_) - 1, std::ssize(more_));
    std::partial_sort(more_.begin(), carried, more_.end(), std::greater<>());
    return std::accumulate(more_.begin(), carried, sum);
  }

  const std::vector<Sporadic>& tasks_;
  const Sporadic& job_;
  const size_t k_;
  const Ticks m_;
  std::vector<Ticks> more_;  ///< by task, in the window at hand: what carrying work in adds
};

}  // namespace

std::string_view to_string(GlobalTest test) {
  switch (test) {
    case GlobalTest::none: return "none";
    case GlobalTest::density: return "density (GFB)";
    case GlobalTest::interference: return "interference (BCL)";
    case GlobalTest::response_time: return "response time";
    case GlobalTest::carry_in: return "carry-in (BAR)";
  }
  return "";
}

bool density_test(const TaskSet& set) {
  const std::vector<Sporadic> tasks = charged(set);
  if (!each_fits(tasks)) return false;
  const Ticks common = common_deadline(tasks);
  const Wide unit = common > 0 ? common : Wide{1} << 61;
  Wide sum = 0, largest = 0;
  for (const Sporadic& t : tasks) {
    const Wide density = (t.budget * unit + t.deadline - 1) / t.deadline;
    sum += density;
    largest = std::max(largest, density);
  }
  return sum <= set.cores * unit - (set.cores - 1) * largest;
}

bool interference_test(const TaskSet& set) {
  const std::vector<Sporadic> tasks = charged(set);
  if (!each_fits(tasks)) return false;
  for (size_t k = 0; k < tasks.size(); ++k) {
    std::vector<Ticks> interference;
    for (size_t i = 0; i < tasks.size(); ++i)
      if (i != k) interference.push_back(urgent_workload(tasks[i], tasks[i].deadline, tasks[k].deadline));
    if (tasks[k].budget + all_cores_busy(interference, set.cores) > tasks[k].deadline) return false;
  }
  return true;
}

bool carry_in_test(const TaskSet& set, size_t max_points) {
  const std::vector<Sporadic> tasks = charged(set);
  if (!each_fits(tasks)) return false;
  for (size_t k = 0; k < tasks.size(); ++k)
    if (!CarryIn(tasks, k, set.cores).fits(max_points)) return false;
  return true;
}

std::vector<Ticks> global_response_times(const TaskSet& set) {
  const std::vector<Sporadic> tasks = charged(set);
  std::vector<Ticks> responses, found(tasks.size(), -1);
  for (const Sporadic& t : tasks) responses.push_back(t.deadline);
  if (!each_fits(tasks)) return found;
  // A response below the deadline is slack, which shortens what others may have to wait for. Every round is sound; late
  // ones gain little.
  constexpr int kRounds = 64;
  bool improved = true;
  for (int round = 0; improved && round < kRounds; ++round) {
    improved = false;
    for (size_t k = 0; k < tasks.size(); ++k) {
      const Ticks response = bounded_response(tasks, k, responses, set.cores);
      if (response < 0 || (found[k] >= 0 && response >= found[k])) continue;
      improved = improved || found[k] < 0 || found[k] - response > tasks[k].deadline / 1024;
      found[k] = response;
      responses[k] = response;
    }
  }
  for (size_t k = 0; k < tasks.size(); ++k)
    if (found[k] >= 0) found[k] += set.tasks[k].jitter;
  return found;
}

Ticks global_response_of_part(const TaskSet& set, size_t k, Ticks budget, const std::vector<Ticks>& responses) {
  std::vector<Sporadic> tasks = charged(set);
  tasks[k].budget = budget + set.tasks[k].blocking;
  if (tasks[k].budget > tasks[k].deadline) return -1;
  std::vector<Ticks> ready_to_end = responses;
  for (size_t i = 0; i < tasks.size(); ++i) ready_to_end[i] -= set.tasks[i].jitter;
  return bounded_response(tasks, k, ready_to_end, set.cores);
}

GlobalEdfResult global_edf(const TaskSet& set, bool responses) {
  GlobalEdfResult result;
  if (density_test(set)) result.proven_by = GlobalTest::density;
  else if (interference_test(set)) result.proven_by = GlobalTest::interference;
  if (responses || !result.schedulable()) result.response = global_response_times(set);
  else result.response.assign(set.tasks.size(), -1);
  const bool converged =
      std::all_of(result.response.begin(), result.response.end(), [](Ticks response) { return response >= 0; });
  if (!result.schedulable() && converged) result.proven_by = GlobalTest::response_time;
  if (!result.schedulable() && carry_in_test(set)) result.proven_by = GlobalTest::carry_in;
  for (size_t k = 0; k < result.response.size(); ++k) {
    if (!result.schedulable()) result.response[k] = -1;
    else if (result.response[k] < 0) result.response[k] = set.tasks[k].deadline;
  }
  return result;
}

}  // namespace takt::analysis
