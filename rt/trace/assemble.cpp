// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "rt/trace/collector.hpp"

namespace takt::trace {
namespace {

/// A job as its events come in.
struct Growing {
  JobSpan span;
  bool started = false, ended = false;
};

void add_to(Growing& job, const ThreadEvent& noted) {
  const Event& event = noted.event;
  switch (event.kind) {
    case Kind::release:
      job.span.release_ns = event.at_ns;
      job.span.deadline_ns = event.value;
      break;
    case Kind::start:
      job.span.start_ns = event.at_ns;
      job.span.start_cpu = static_cast<int>(event.extra);
      job.span.level = event.port;
      job.span.thread = noted.thread;
      job.started = true;
      break;
    case Kind::latch: job.span.latched.push_back({event.port, static_cast<uint64_t>(event.value), event.extra}); break;
    case Kind::finish:
      job.span.finish_ns = event.at_ns;
      job.span.cpu_ns = event.value;
      job.span.cpu = static_cast<int>(event.extra);
      break;
    case Kind::publish:
      job.span.published_ns = event.at_ns;
      job.ended = true;
      if (event.value > 0) job.span.published.push_back({event.port, static_cast<uint64_t>(event.value), event.extra});
      break;
    case Kind::miss: job.span.late = true; break;
    default: break;
  }
}

bool is_mark(Kind kind) {
  return kind == Kind::skip || kind == Kind::overrun || kind == Kind::level || kind == Kind::mode;
}

void assemble_jobs(const Recording& recording, Trace& trace) {
  std::map<std::pair<uint16_t, uint32_t>, Growing> jobs;
  for (const ThreadEvent& noted : recording.events) {
    const Event& event = noted.event;
    if (is_mark(event.kind))
      trace.marks.push_back({event.kind, event.at_ns, event.value, event.extra, event.job, event.task});
    else if (event.task != kNoTask) add_to(jobs[{event.task, event.job}], noted);
  }
  for (auto& [key, job] : jobs) {
    if (!job.started || !job.ended) continue;  // it never ended, or its beginning is lost
    job.span.task = key.first;
    job.span.job = key.second;
    trace.jobs.push_back(std::move(job.span));
  }
  std::stable_sort(trace.jobs.begin(), trace.jobs.end(),
                   [](const JobSpan& a, const JobSpan& b) { return a.start_ns < b.start_ns; });
  std::stable_sort(trace.marks.begin(), trace.marks.end(),
                   [](const Mark& a, const Mark& b) { return a.at_ns < b.at_ns; });
}

/// Wakings are recorded on the CPU of whoever woke the thread, so they meet its slices only here.
void assemble_slices(const Recording& recording, Trace& trace) {
  trace.slices = recording.switches.slices;
  std::stable_sort(trace.slices.begin(), trace.slices.end(),
                   [](const Slice& a, const Slice& b) { return a.from_ns < b.from_ns; });
  std::map<int32_t, std::vector<int64_t>> wakings;
  for (const Waking& waking : recording.switches.wakings) wakings[waking.thread].push_back(waking.at_ns);
  for (auto& [thread, instants] : wakings) std::sort(instants.begin(), instants.end());
  std::map<int32_t, const Slice*> last;
  for (Slice& slice : trace.slices) {
    const Slice*& before = last[slice.thread];
    const auto woken = wakings.find(slice.thread);
    if (woken != wakings.end() && (before == nullptr || before->end == Slice::End::asleep)) {
      const int64_t asleep_since = before != nullptr ? before->to_ns : 0;
      const auto at = std::upper_bound(woken->second.begin(), woken->second.end(), asleep_since);
      if (at != woken->second.end() && *at <= slice.from_ns) slice.woken_ns = *at;
    }
    before = &slice;
  }
}

}  // namespace

const char* to_string(Source source) {
  switch (source) {
    case Source::tracefs: return "tracefs";
    case Source::perf: return "perf";
    case Source::simulation: return "simulation";
    case Source::none: break;
  }
  return "none";
}

Trace assemble(const Recording& recording) {
  Trace trace;
  trace.source = recording.source;
  trace.source_note = recording.source_note;
  trace.first_ns = recording.first_ns;
  trace.end_ns = recording.last_ns;
  trace.threads = recording.threads;
  trace.names = recording.switches.names;
  trace.steals = recording.steals;
  trace.losses = recording.losses;
  assemble_jobs(recording, trace);
  assemble_slices(recording, trace);
  return trace;
}

}  // namespace takt::trace
