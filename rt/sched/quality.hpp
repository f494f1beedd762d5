// SPDX-License-Identifier: Apache-2.0
// Which quality level the next job of a node gets (on_overrun: degrade). A pure function of what earlier jobs cost: no
// clock, no thread, no memory taken; instants are planned releases.
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "rt/level.hpp"

namespace takt {

/// What one job cost.
struct JobCost {
  int64_t release_ns = 0;   ///< planned; never falls from one job to the next
  int64_t exec_ns = 0;      ///< CPU time
  int64_t response_ns = 0;  ///< planned release to publication
  bool no_result = false;   ///< the job found nothing to do: its cost says nothing about the next one's
};

/// Feedback control with a model: a level's declared cost relative to the others predicts what a job would take there.
///
///  - capacity: the budget, or the deadline where that is shorter or no budget is stated.
///  - forecast: execution time of the last job, plus the smaller of its last two increases if both were ones.
///  - lower: after a job that overran its capacity or whose forecast does, or after the second job in a row that missed
///    its deadline without overrunning. To the best level at which the forecast takes at most kRaiseAt of the capacity,
///    else to the last one.
///  - raise: to the best level that is not barred, whose prediction took at most kRaiseAt of the capacity and whose
///    predicted response met the deadline in kHoldJobs jobs in a row over kHold.
///  - fall: one level up is also tried, whatever is predicted, once the mean execution time of a window (kHoldJobs jobs
///    and kHold) is at most kFall of the largest such mean at this level: the cause has let go, and by how much,
///    declared costs cannot always tell.
///  - bar: a level that fails is barred for kFirstBar, with all better ones; twice as long each time it fails within
///    kSettled after a raise, at most kLongestBar.
///  - blind raise: one level up after kBlind and kBlindJobs jobs without failure, whatever is predicted.
///
/// What follows (P is the period; rt/README.md has the reasons):
///  - A load whose largest execution time plus half of its range stays within the capacity never lowers level 0:
///    of three values that rise within a range r, the smaller step is at most r / 2.
///  - A load that grows by equal steps is lowered before it overruns, from its third job on.
///  - A constant load with any noise of up to +-5 % never takes a level back only to leave it again, but after a blind
///    raise: (1 - a) / kRaiseAt >= 1 + 2 a up to a = 0.055. With more noise the bar limits it to once in kLongestBar.
///  - After a cause's end level 0 is back within max(kLongestBar, kHold + P, kHoldJobs P) + 2 P, if it takes at most
///    kRaiseAt of the capacity and its declared cost is right: 4.2 s at 15 Hz, 5 s at 2 Hz, 6 s at 1 Hz. If that cost
///    is wrong, but the execution time at the lower level falls by 30 %, within max(kLongestBar, 2 (kHold + P), 2
///    kHoldJobs P) + 2 P for one level: 4.2 s at 15 Hz, 5 s at 2 Hz, 8 s at 1 Hz. Else within max(kBlind, kBlindJobs P)
///    + 2 P for each level.
///  - While a cause lasts that the lower level shows, only blind raises overrun: one job in max(kBlind, kBlindJobs P).
///    Where it does not show (a stage that only the better level has), one job in kLongestBar: without trying nobody
///    can know.
class QualityControl {
 public:
  static constexpr int64_t kSecond = 1'000'000'000;
  static constexpr double kRaiseAt = 0.85;
  static constexpr int kHoldJobs = 3;
  static constexpr int64_t kHold = kSecond * 3 / 4;
  static constexpr double kFall = 0.7;
  static constexpr int64_t kFirstBar = kSecond, kLongestBar = 4 * kSecond;
  static constexpr int64_t kSettled = 10 * kSecond;
  static constexpr int64_t kBlind = 30 * kSecond;
  static constexpr int kBlindJobs = 300;

  /// `levels`: as a node declares them, best first; with one level nothing ever changes. `budget_ns` 0: not stated.
  QualityControl(std::span<const QualityLevel> levels, int64_t budget_ns, int64_t deadline_ns);

  /// Level of the next job.
  int level() const { return static_cast<int>(level_); }
  /// After each job, in order; returns the level of the next one. Constant time.
  int observe(const JobCost& job);

 private:
  /// Since when, and for how many jobs in a row, a better level would have done.
  struct Fit {
    int jobs = 0;
    int64_t since_ns = 0;
  };
  /// Mean execution times of windows at the present level.
  struct Windows {
    int jobs = 0;
    int64_t since_ns = 0, sum_ns = 0;  ///< of the window under way
    int64_t largest_mean_ns = 0;
    bool fallen = false;  ///< the last whole one
  };
  static constexpr int64_t kNever = INT64_MIN / 2;

  int64_t forecast(int64_t exec_ns);
  double predicted_ns(size_t level, int64_t exec_ns) const;
  void fail(int64_t now_ns, int64_t forecast_ns);
  void note_fits(const JobCost& job);
  void note_fall(const JobCost& job);
  void consider_raise(int64_t now_ns);
  void change_to(size_t level, int64_t now_ns);

  size_t count_;
  int64_t capacity_ns_, deadline_ns_;
  std::array<double, kMaxLevels> cost_{};
  size_t level_ = 0;

  std::array<int64_t, 2> earlier_ns_{};  ///< execution times of the last jobs at this level, newest first
  size_t earlier_ = 0;
  int foreign_misses_ = 0;  ///< in a row
  std::array<Fit, kMaxLevels> fits_{};
  Windows windows_;
  std::array<int64_t, kMaxLevels> barred_until_ns_{};
  int64_t bar_ns_ = kFirstBar;       ///< length of the last bar
  int64_t raised_ns_ = kNever;       ///< last raise
  int64_t quiet_since_ns_ = kNever;  ///< last change or failure
  int quiet_jobs_ = 0;
};

}  // namespace takt
