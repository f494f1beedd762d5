// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/quality.hpp"

#include <algorithm>

namespace takt {

QualityControl::QualityControl(std::span<const QualityLevel> levels, int64_t budget_ns, int64_t deadline_ns)
    : count_(std::clamp<size_t>(levels.size(), 1, kMaxLevels)),
      capacity_ns_(budget_ns > 0 ? std::min(budget_ns, deadline_ns) : deadline_ns),
      deadline_ns_(deadline_ns) {
  cost_.fill(1.0);
  for (size_t l = 0; l < std::min(count_, levels.size()); ++l) cost_[l] = levels[l].cost;
  barred_until_ns_.fill(kNever);
}

int QualityControl::observe(const JobCost& job) {
  if (count_ == 1) return 0;
  if (quiet_since_ns_ == kNever) quiet_since_ns_ = job.release_ns;
  const bool overran = job.exec_ns > capacity_ns_, missed = job.response_ns > deadline_ns_;
  if (job.no_result && !overran && !missed) return level();

  foreign_misses_ = missed && !overran ? foreign_misses_ + 1 : 0;
  ++quiet_jobs_;
  note_fits(job);
  note_fall(job);
  const int64_t next_ns = forecast(job.exec_ns);
  if (next_ns > capacity_ns_ || foreign_misses_ >= 2) fail(job.release_ns, next_ns);
  else consider_raise(job.release_ns);
  return level();
}

int64_t QualityControl::forecast(int64_t exec_ns) {
  int64_t growth_ns = 0;
  if (earlier_ == earlier_ns_.size())
    growth_ns = std::max<int64_t>(0, std::min(exec_ns - earlier_ns_[0], earlier_ns_[0] - earlier_ns_[1]));
  earlier_ns_[1] = earlier_ns_[0];
  earlier_ns_[0] = exec_ns;
  earlier_ = std::min(earlier_ + 1, earlier_ns_.size());
  return exec_ns + growth_ns;
}

double QualityControl::predicted_ns(size_t level, int64_t exec_ns) const {
  return static_cast<double>(exec_ns) * cost_[level] / cost_[level_];
}

void QualityControl::fail(int64_t now_ns, int64_t forecast_ns) {
  quiet_since_ns_ = now_ns;
  quiet_jobs_ = 0;
  foreign_misses_ = 0;
  if (level_ + 1 == count_) return;
  const bool again = now_ns - raised_ns_ < kSettled;
  bar_ns_ = again ? std::min(2 * bar_ns_, kLongestBar) : kFirstBar;
  for (size_t l = 0; l <= level_; ++l) barred_until_ns_[l] = std::max(barred_until_ns_[l], now_ns + bar_ns_);
  size_t next = level_ + 1;
  while (next + 1 < count_ && predicted_ns(next, forecast_ns) > kRaiseAt * static_cast<double>(capacity_ns_)) ++next;
  change_to(next, now_ns);
}

void QualityControl::note_fits(const JobCost& job) {
  for (size_t l = 0; l < level_; ++l) {
    const double exec_ns = predicted_ns(l, job.exec_ns);
    const double response_ns = static_cast<double>(job.response_ns - job.exec_ns) + exec_ns;
    const bool fits =
        exec_ns <= kRaiseAt * static_cast<double>(capacity_ns_) && response_ns <= static_cast<double>(deadline_ns_);
    if (!fits) fits_[l] = {};
    else if (fits_[l].jobs++ == 0) fits_[l].since_ns = job.release_ns;
  }
}

void QualityControl::note_fall(const JobCost& job) {
  if (windows_.jobs++ == 0) windows_.since_ns = job.release_ns;
  windows_.sum_ns += job.exec_ns;
  if (windows_.jobs < kHoldJobs || job.release_ns - windows_.since_ns < kHold) return;
  const int64_t mean_ns = windows_.sum_ns / windows_.jobs;
  windows_.fallen = static_cast<double>(mean_ns) <= kFall * static_cast<double>(windows_.largest_mean_ns);
  windows_.largest_mean_ns = std::max(windows_.largest_mean_ns, mean_ns);
  windows_.jobs = 0;
  windows_.sum_ns = 0;
}

void QualityControl::consider_raise(int64_t now_ns) {
  size_t next = level_;
  for (size_t l = level_; l-- > 0;) {
    if (now_ns < barred_until_ns_[l]) break;  // and so are all better ones
    const bool fits = fits_[l].jobs >= kHoldJobs && now_ns - fits_[l].since_ns >= kHold;
    if (fits || (windows_.fallen && l + 1 == level_)) next = l;
  }
  if (next == level_ && level_ > 0 && quiet_jobs_ >= kBlindJobs && now_ns - quiet_since_ns_ >= kBlind)
    next = level_ - 1;
  if (next == level_) return;
  raised_ns_ = now_ns;
  change_to(next, now_ns);
}

void QualityControl::change_to(size_t level, int64_t now_ns) {
  level_ = level;
  earlier_ = 0;
  fits_.fill({});
  windows_ = {};
  quiet_since_ns_ = now_ns;
  quiet_jobs_ = 0;
}

}  // namespace takt
