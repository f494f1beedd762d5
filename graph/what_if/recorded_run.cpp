// SPDX-License-Identifier: Apache-2.0
#include "graph/what_if/recorded_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <tuple>

#include "graph/log/cut_log.hpp"
#include "graph/log/log_content.hpp"
#include "graph/run/job_durations.hpp"
#include "graph/what_if/habits.hpp"
#include "rt/msg/requests.hpp"
#include "rt/node.hpp"

namespace takt::what_if {
namespace {

using record::LogFile;
using record::RecordedJob;

/// A record that begins later than this after its epoch has not the beginning of its run.
constexpr int64_t kWhole_ns = 1'000'000'000;
/// No job takes longer, whatever a damaged record says.
constexpr int64_t kLongest_ns = 86'400'000'000'000;

class Reading {
 public:
  Reading(LogFile& log, const Plan& plan) : log_(log), plan_(plan), last_(plan.tasks.size()) {
    run_.tasks.resize(plan_.tasks.size());
    for (const TaskPlan& task : plan_.tasks) {
      RecordedFigures& figures = run_.figures.emplace_back();
      figures.edge_age.resize(task.edges.size());
      figures.output_age.resize(task.ports.size());
      last_[run_.figures.size() - 1].resize(task.ports.size());
    }
  }

  RecordedRun read() {
    find_window();
    const std::vector<const RecordedJob*> jobs = jobs_by_release();
    const Habits habits(log_, plan_, jobs);
    habits.for_each_job([&](const RecordedJob& job, const Seen& seen) { take(job, seen, habits); });
    for (const record::RecordedEvent& event : log_.events())
      if (const auto* change = std::get_if<record::ModeChange>(&event.what);
          change != nullptr && !caused_by_schedule(*change))
        run_.modes.push_back(event);
    std::stable_sort(run_.modes.begin(), run_.modes.end(),
                     [](const auto& a, const auto& b) { return a.at_ns < b.at_ns; });
    return std::move(run_);
  }

 private:
  /// False if a damaged record names what the plan does not have.
  bool known(const RecordedJob& job) const {
    if (job.task >= plan_.tasks.size()) return false;
    const TaskPlan& task = plan_.tasks[job.task];
    const bool inputs = std::all_of(job.inputs.begin(), job.inputs.end(), [&](const RecordedJob::Input& input) {
      return input.edge < task.edges.size() &&
             std::all_of(input.held.begin(), input.held.end(),
                         [](const RecordedJob::Run& run) { return run.count <= InputPort::kMaxDepth; });
    });
    return inputs && std::all_of(job.outputs.begin(), job.outputs.end(),
                                 [&](const auto& output) { return output.output < task.ports.size(); });
  }

  std::vector<const RecordedJob*> jobs_by_release() {
    std::vector<const RecordedJob*> jobs;
    for (const RecordedJob& job : log_.jobs()) {
      if (!known(job) || job.release_ns < run_.from_ns) continue;
      if (plan_.tasks[job.task].rate && job.release_ns >= run_.end_ns) continue;
      if (job.cut_off) ++run_.cut_off;
      else jobs.push_back(&job);
    }
    std::stable_sort(jobs.begin(), jobs.end(),
                     [](const RecordedJob* a, const RecordedJob* b) { return a->release_ns < b->release_ns; });
    return jobs;
  }

  void find_window() {
    int64_t first = INT64_MAX, last = INT64_MIN;
    for (const RecordedJob& job : log_.jobs()) {
      first = std::min(first, job.release_ns);
      last = std::max(last, job.release_ns);
    }
    run_.epoch_ns = log::fact(log_.end(), "epoch_ns").empty() ? epoch_by_devices() : log::epoch_ns(log_);
    if (first > last) first = last = run_.epoch_ns;
    run_.from_ns = first - run_.epoch_ns > kWhole_ns ? first : run_.epoch_ns;
    const int64_t stated = std::atoll(log::fact(log_.end(), "end_ns").c_str());
    run_.end_ns = stated > run_.from_ns && stated - last <= kWhole_ns ? stated : last + 1;
    // A cut has jobs of before as well, whose messages it needs.
    double from_s = 0, to_s = 0;
    const std::string cut = log::fact(log_.facts(), "cut");
    if (std::sscanf(cut.c_str(), "%lf s to %lf s", &from_s, &to_s) != 2) return;
    const auto instant = [&](double s) { return run_.epoch_ns + static_cast<int64_t>(std::llround(s * 1e9)); };
    run_.from_ns = std::max(run_.epoch_ns, instant(from_s));
    run_.end_ns = std::min(instant(to_s), last + kWhole_ns);
    if (stated > run_.from_ns) run_.end_ns = std::min(run_.end_ns, stated);
  }

  /// Of a record without an end, which may begin late: devices count their releases from the epoch on, and one of them
  /// at least has no offset.
  int64_t epoch_by_devices() const {
    struct Span {
      const RecordedJob *first = nullptr, *last = nullptr;
    };
    std::vector<Span> spans(plan_.tasks.size());
    for (const RecordedJob& job : log_.jobs()) {
      if (job.task >= spans.size() || !plan_.tasks[job.task].device || !plan_.tasks[job.task].rate) continue;
      Span& span = spans[job.task];
      if (span.first == nullptr || job.index < span.first->index) span.first = &job;
      if (span.last == nullptr || job.index > span.last->index) span.last = &job;
    }
    int64_t epoch_ns = INT64_MAX;
    for (const auto& [first, last] : spans) {
      if (first == last) continue;
      const double period_ns = static_cast<double>(last->release_ns - first->release_ns) / (last->index - first->index);
      epoch_ns = std::min<int64_t>(epoch_ns, first->release_ns - std::llround(period_ns * first->index));
    }
    return epoch_ns == INT64_MAX ? log::epoch_ns(log_) : epoch_ns;
  }

  /// The other schedule decides by itself whether that happens.
  bool caused_by_schedule(const record::ModeChange& change) const {
    return change.mode == plan_.safe_stop &&
           (change.reason.ends_with(": deadline missed") || change.reason.ends_with(": budget exceeded"));
  }

  void take(const RecordedJob& job, const Seen& seen, const Habits& habits) {
    RecordedTask& task = run_.tasks[job.task];
    const auto& levels = plan_.tasks[job.task].node->levels();
    const auto level = static_cast<size_t>(std::max(job.level, 0));
    const double cost = level < levels.size() ? levels[level].cost : 1.0;
    PastJob past;
    past.release_ns = job.release_ns;
    past.visible_ns = job.visible_at_ns != 0 ? job.visible_at_ns : job.published_ns;  // format 1 has none
    past.full_ns = command::at_full_quality_ns(std::clamp<int64_t>(job.cpu_ns, 0, kLongest_ns), cost);
    past.first = static_cast<uint32_t>(task.published.size());
    note(job, past.visible_ns, habits);
    for (size_t o = 0; o < last_[job.task].size(); ++o) {
      std::optional<Publication>& last = last_[job.task][o];
      if (const RecordedJob::Output* output = made(job, o))
        task.published.push_back(*(last = publication(job, *output, habits)));
      else if (last && habits.if_new(job.task, o) && habits.only_old(job, seen, o))
        task.published.push_back(*last);  // should there be something new in another run
    }
    past.count = static_cast<uint32_t>(task.published.size()) - past.first;
    // What was held back is not in the record: what the job before it published stands for it.
    if (habits.withheld(job) && !task.jobs.empty())
      std::tie(past.first, past.count) = std::pair(task.jobs.back().first, task.jobs.back().count);
    task.jobs.push_back(past);
  }

  /// The figures that a run would have counted.
  void note(const RecordedJob& job, int64_t visible_ns, const Habits& habits) {
    RecordedFigures& figures = run_.figures[job.task];
    const TaskPlan& task = plan_.tasks[job.task];
    ++figures.jobs;
    figures.deadline_misses += job.late;
    figures.lateness.add(job.start_ns - job.release_ns);
    figures.exec.add(job.cpu_ns);
    figures.response.add(job.published_ns - job.release_ns);
    for_each_held(job, [&](uint16_t edge, uint16_t back, uint64_t sequence) {
      if (const auto stamp_ns = habits.stamps(task.edges[edge].port).of(sequence); back == 0 && stamp_ns)
        figures.edge_age[edge].add(job.start_ns - *stamp_ns);
    });
    for (const RecordedJob::Output& output : job.outputs)
      if (const auto stamp_ns = habits.stamps(task.ports[output.output]).of(output.sequence);
          stamp_ns && !output.repeated)
        figures.output_age[output.output].add(visible_ns - *stamp_ns);
  }

  Publication publication(const RecordedJob& job, const RecordedJob::Output& output, const Habits& habits) {
    const size_t port = plan_.tasks[job.task].ports[output.output];
    const auto stamp_ns = habits.stamps(port).of(output.sequence);
    run_.unknown_stamps += !stamp_ns;
    Publication made;
    made.output = output.output;
    made.stamp = stamp_ns ? habits.origin(job, output.output, *stamp_ns) : habits.newest_input(job, output.output);
    made.if_new = habits.if_new(job.task, output.output);
    if (plan_.ports[port].type->name != Requests::type_name) return made;
    made.content = content(port, output.sequence);
    run_.unknown_requests += made.content == nullptr;
    return made;
  }

  /// Once for equal messages: requests change seldom.
  std::shared_ptr<const std::vector<std::byte>> content(size_t port, uint64_t sequence) {
    const uint16_t channel = log_.channel(plan_.ports[port].node + "." + plan_.ports[port].port);
    const auto& messages = log_.messages(channel);
    const auto known = messages.find(sequence);
    if (known == messages.end() || !known->second.whole) return nullptr;
    auto& bytes = contents_[known->second.hash];
    if (bytes) return bytes;
    if (const auto message = log_.message(channel, sequence))
      bytes = std::make_shared<const std::vector<std::byte>>(message->data.begin(), message->data.end());
    return bytes;
  }

  LogFile& log_;
  const Plan& plan_;
  std::vector<std::vector<std::optional<Publication>>> last_;                   ///< by task and output
  std::map<uint64_t, std::shared_ptr<const std::vector<std::byte>>> contents_;  ///< by hash
  RecordedRun run_;
};

}  // namespace

const PastJob* RecordedTask::nearest(int64_t release_ns) const {
  if (jobs.empty()) return nullptr;
  const auto after = std::lower_bound(jobs.begin(), jobs.end(), release_ns,
                                      [](const PastJob& past, int64_t ns) { return past.release_ns < ns; });
  if (after == jobs.begin()) return &*after;
  const auto before = after - 1;
  if (after == jobs.end() || release_ns - before->release_ns <= after->release_ns - release_ns) return &*before;
  return &*after;
}

RecordedRun read_recorded_run(LogFile& log, const Plan& plan) { return Reading(log, plan).read(); }

}  // namespace takt::what_if
