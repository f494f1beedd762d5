// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "rt/trace/blame.hpp"

namespace takt::trace {
namespace {

/// The first element whose end lies after `at`; elements are sorted and do not overlap.
template <class T, class End>
auto first_ending_after(const std::vector<T>& sorted, int64_t at, End end) {
  return std::partition_point(sorted.begin(), sorted.end(), [&](const T& element) { return end(element) <= at; });
}

int64_t slice_end(const Slice* slice) { return slice->to_ns; }
int64_t job_end(const JobSpan* job) { return job->published_ns; }

}  // namespace

Evidence::Evidence(const Trace& trace) : trace_(trace) {
  for (const Slice& slice : trace.slices) {
    by_thread_[slice.thread].push_back(&slice);
    by_cpu_[slice.cpu].push_back(&slice);
  }
  for (const JobSpan& job : trace.jobs) {
    jobs_of_[job.thread].push_back(&job);
    jobs_of_lane_[trace.tasks[job.task].lane].push_back(&job);
  }
  for (const ThreadFacts& thread : trace.threads) names_[thread.id] = thread.name;
  const auto sort = [](auto& groups, auto start) {
    for (auto& [key, group] : groups)
      std::stable_sort(group.begin(), group.end(), [&](auto* a, auto* b) { return start(a) < start(b); });
  };
  const auto slice_start = [](const Slice* slice) { return slice->from_ns; };
  const auto job_start = [](const JobSpan* job) { return job->start_ns; };
  sort(by_thread_, slice_start), sort(by_cpu_, slice_start), sort(jobs_of_, job_start), sort(jobs_of_lane_, job_start);
}

std::vector<Piece> Evidence::occupants(int cpu, int64_t from_ns, int64_t to_ns) const {
  std::vector<Piece> pieces;
  const auto slices = by_cpu_.find(cpu);
  if (slices == by_cpu_.end()) return pieces;
  const auto add = [&](int64_t from, int64_t to, const std::string& who) {
    from = std::max(from, pieces.empty() ? from_ns : pieces.back().to_ns);
    to = std::min(to, to_ns);
    if (from < to) pieces.push_back({from, to, Cause::preempted, who, cpu});
  };
  for (auto it = first_ending_after(slices->second, from_ns, slice_end);
       it != slices->second.end() && (*it)->from_ns < to_ns; ++it) {
    const Slice& slice = **it;
    const auto name = names_.find(slice.thread);
    const std::string& who = name != names_.end() ? name->second : trace_.names[slice.name];
    // One of our threads runs the jobs of several nodes, one after the other.
    if (const auto jobs = jobs_of_.find(slice.thread); jobs != jobs_of_.end()) {
      for (auto job = first_ending_after(jobs->second, slice.from_ns, job_end);
           job != jobs->second.end() && (*job)->start_ns < slice.to_ns; ++job) {
        add(slice.from_ns, std::min(slice.to_ns, (*job)->start_ns), who);
        add(slice.from_ns, std::min(slice.to_ns, (*job)->published_ns), trace_.tasks[(*job)->task].name);
      }
    }
    add(slice.from_ns, slice.to_ns, who);
  }
  return pieces;
}

std::vector<const JobSpan*> Evidence::ahead_of(const JobSpan& job, int64_t from_ns, int64_t to_ns) const {
  std::vector<const JobSpan*> ahead;
  const auto look = [&](const std::vector<const JobSpan*>& jobs) {
    for (auto it = first_ending_after(jobs, from_ns, job_end); it != jobs.end() && (*it)->start_ns < to_ns; ++it)
      if (*it != &job && std::find(ahead.begin(), ahead.end(), *it) == ahead.end()) ahead.push_back(*it);
  };
  look(jobs_of_.at(job.thread));
  look(jobs_of_lane_.at(trace_.tasks[job.task].lane));
  std::stable_sort(ahead.begin(), ahead.end(),
                   [](const JobSpan* a, const JobSpan* b) { return a->start_ns < b->start_ns; });
  return ahead;
}

const std::vector<const Slice*>* Evidence::slices_of(int32_t thread) const {
  const auto found = by_thread_.find(thread);
  return found != by_thread_.end() ? &found->second : nullptr;
}

int64_t Evidence::stolen_ns(int cpu, int64_t from_ns, int64_t to_ns) const {
  int64_t sum = 0;
  for (const Steal& steal : trace_.steals)
    if (steal.cpu == cpu && steal.from_ns - kStealTickNs < to_ns && steal.to_ns > from_ns) sum += steal.stolen_ns;
  return sum;
}

bool Evidence::left_to_others(int cpu, int64_t at_ns) const {
  const auto slices = by_cpu_.find(cpu);
  if (slices == by_cpu_.end()) return false;
  const auto slice = first_ending_after(slices->second, at_ns, slice_end);
  const bool nobody = slice == slices->second.end() || (*slice)->from_ns > at_ns;
  return nobody || (*slice)->priority >= 0;
}

}  // namespace takt::trace
