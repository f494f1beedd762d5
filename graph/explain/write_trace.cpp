// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <map>
#include <set>

#include "graph/explain/file_format.hpp"
#include "graph/explain/trace_file.hpp"
#include "rt/sched/lane.hpp"

namespace takt::explain {
namespace {

using trace::JobSpan;
using trace::Slice;

constexpr int kNodes = 1, kCpus = 2;  // the two groups of tracks ("processes" of the format)

/// A name that the kernel cut within a letter costs that letter, not the trace.
std::string json_text(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }
std::string quoted(const std::string& text) { return json_text(text); }

const char* to_string(Slice::End end) {
  return end == Slice::End::preempted ? "preempted" : end == Slice::End::asleep ? "asleep" : "open";
}

class Writer {
 public:
  Writer(std::ostream& out, const trace::Trace& trace) : out_(out), trace_(trace) {}

  void write(const Json& head) {
    fmt::print(out_, "{{\"displayTimeUnit\":\"ms\",\"otherData\":{},\n\"traceEvents\":[\n", json_text(facts(head)));
    name_tracks();
    for (const JobSpan& job : trace_.jobs) write_job(job);
    write_messages();
    for (const trace::Mark& mark : trace_.marks) write_mark(mark);
    for (const Slice& slice : trace_.slices) write_slice(slice);
    fmt::print(out_, "\n]}}\n");
  }

 private:
  /// The format counts in us; with three decimals nothing is lost.
  std::string us(int64_t ns) const { return fmt::format("{:.3f}", static_cast<double>(ns - trace_.epoch_ns) / 1e3); }
  std::string us_long(int64_t ns) const { return fmt::format("{:.3f}", static_cast<double>(ns) / 1e3); }

  Json facts(Json head) const {
    head["format"] = kTraceFormat;
    head["source_of_preemption"] = trace::to_string(trace_.source);
    head["source_note"] = trace_.source_note;
    head["lost"] = {{"events", trace_.losses.events},
                    {"switches", trace_.losses.switches},
                    {"forgotten", trace_.losses.forgotten},
                    {"threads", trace_.losses.threads}};
    head["policy_granted"] = trace_.policy;
    head["epoch_ns"] = trace_.epoch_ns;
    head["end_ns"] = trace_.end_ns;
    head["first_ns"] = trace_.first_ns;
    Json tasks = Json::array();
    for (const trace::TaskFacts& task : trace_.tasks) {
      Json edges = Json::array();
      for (const trace::EdgeFacts& edge : task.edges) edges.push_back({{"input", edge.input}, {"port", edge.port}});
      tasks.push_back({{"name", task.name},
                       {"lane", task.lane},
                       {"deadline_ns", task.deadline_ns},
                       {"budget_ns", task.budget_ns},
                       {"high", task.high},
                       {"edges", edges},
                       {"ports", task.ports}});
    }
    Json threads = Json::array(), steals = Json::array();
    for (const trace::ThreadFacts& thread : trace_.threads) threads.push_back({thread.id, thread.name});
    for (const trace::Steal& steal : trace_.steals)
      steals.push_back({steal.from_ns, steal.to_ns, steal.stolen_ns, steal.cpu});
    head["tasks"] = std::move(tasks);
    head["ports"] = trace_.ports;
    head["threads"] = std::move(threads);
    head["steals"] = std::move(steals);
    return head;
  }

  template <class... Args>
  void event(fmt::format_string<Args...> format, Args&&... args) {
    if (!first_) out_ << ",\n";
    first_ = false;
    fmt::print(out_, format, std::forward<Args>(args)...);
  }

  void name_track(const char* what, int process, int64_t track, const std::string& name) {
    event(R"({{"ph":"M","name":"{}","pid":{},"tid":{},"args":{{"name":{}}}}})", what, process, track, quoted(name));
  }

  void name_tracks() {
    name_track("process_name", kNodes, 0, "nodes");
    name_track("process_name", kCpus, 0, "CPUs");
    for (size_t t = 0; t < trace_.tasks.size(); ++t)
      name_track("thread_name", kNodes, static_cast<int64_t>(t) + 1, trace_.tasks[t].name);
    std::set<int> cpus;
    for (const Slice& slice : trace_.slices) cpus.insert(slice.cpu);
    for (const int cpu : cpus) name_track("thread_name", kCpus, cpu + 1, fmt::format("CPU {}", cpu));
  }

  void write_job(const JobSpan& job) {
    Json latched = Json::array(), published = Json::array();
    for (const trace::Latched& l : job.latched) latched.push_back({l.edge, l.sequence, l.stamp_ns});
    for (const trace::Published& p : job.published) published.push_back({p.output, p.sequence, p.stamp_ns});
    event(R"({{"ph":"X","cat":"job","name":{},"pid":{},"tid":{},"ts":{},"dur":{},"args":{{"job":{},"release_ns":{},)"
          R"("deadline_ns":{},"start_ns":{},"finish_ns":{},"published_ns":{},"cpu_ns":{},"thread":{},"start_cpu":{},)"
          R"("cpu":{},"level":{},"late":{},"latched":{},"published":{}}}}})",
          quoted(fmt::format("{} {}", trace_.tasks[job.task].name, job.job)), kNodes, job.task + 1, us(job.start_ns),
          us_long(job.published_ns - job.start_ns), job.job, job.release_ns, job.deadline_ns, job.start_ns,
          job.finish_ns, job.published_ns, job.cpu_ns, job.thread, job.start_cpu, job.cpu, job.level, job.late,
          latched.dump(), published.dump());
    if (job.late)
      event(R"({{"ph":"i","s":"t","cat":"miss","name":"deadline missed","pid":{},"tid":{},"ts":{},"args":{{}}}})",
            kNodes, job.task + 1, us(job.deadline_ns));
  }

  /// An arrow from the slice that published a message to every slice that latched it.
  void write_messages() {
    std::map<std::pair<size_t, uint64_t>, const JobSpan*> senders;
    for (const JobSpan& job : trace_.jobs)
      for (const trace::Published& p : job.published)
        senders[{trace_.tasks[job.task].ports[p.output], p.sequence}] = &job;
    size_t number = 0;
    for (const JobSpan& job : trace_.jobs) {
      for (const trace::Latched& latched : job.latched) {
        const size_t port = trace_.tasks[job.task].edges[latched.edge].port;
        const auto sender = senders.find({port, latched.sequence});
        if (sender == senders.end()) continue;
        const std::string name = quoted(trace_.ports[port]);
        ++number;
        event(R"({{"ph":"s","cat":"message","name":{},"id":{},"pid":{},"tid":{},"ts":{}}})", name, number, kNodes,
              sender->second->task + 1, us(std::max(sender->second->start_ns, sender->second->published_ns - 1)));
        event(R"({{"ph":"f","bp":"e","cat":"message","name":{},"id":{},"pid":{},"tid":{},"ts":{}}})", name, number,
              kNodes, job.task + 1, us(job.start_ns));
      }
    }
  }

  void write_mark(const trace::Mark& mark) {
    const char* name = mark.kind == trace::Kind::skip      ? "release skipped"
                       : mark.kind == trace::Kind::overrun ? "budget overrun"
                       : mark.kind == trace::Kind::level   ? "level"
                                                           : "mode";
    const bool of_task = mark.task != trace::kNoTask;
    event(
        R"({{"ph":"i","s":"{}","cat":"mark","name":"{}","pid":{},"tid":{},"ts":{},"args":{{"at_ns":{},"job":{},"value":{},"extra":{}}}}})",
        of_task ? 't' : 'g', name, kNodes, of_task ? mark.task + 1 : 0, us(mark.at_ns), mark.at_ns, mark.job,
        mark.value, mark.extra);
  }

  /// perf tells no names, but has slices of our own threads only.
  std::string name_of(const Slice& slice) const {
    if (!trace_.names[slice.name].empty()) return trace_.names[slice.name];
    for (const trace::ThreadFacts& thread : trace_.threads)
      if (thread.id == slice.thread) return thread.name;
    return "";
  }

  void write_slice(const Slice& slice) {
    event(
        R"({{"ph":"X","cat":"cpu","name":{},"pid":{},"tid":{},"ts":{},"dur":{},"args":{{"thread":{},"priority":{},"end":"{}")",
        quoted(name_of(slice)), kCpus, slice.cpu + 1, us(slice.from_ns), us_long(slice.to_ns - slice.from_ns),
        slice.thread, slice.priority, to_string(slice.end));
    if (slice.woken_ns > 0) fmt::print(out_, R"(,"woken_us":{})", us(slice.woken_ns));
    out_ << "}}";
  }

  std::ostream& out_;
  const trace::Trace& trace_;
  bool first_ = true;
};

}  // namespace

void describe(const Plan& plan, trace::Trace& trace) {
  for (const TaskPlan& task : plan.tasks) {
    trace::TaskFacts& facts = trace.tasks.emplace_back();
    facts.name = task.name;
    facts.deadline_ns = task.deadline_ns;
    facts.budget_ns = task.budget_ns;
    facts.high = task.criticality == Criticality::high;
    facts.ports = task.ports;
    for (const EdgePlan& edge : task.edges)
      facts.edges.push_back({std::string(task.node->inputs()[edge.input]->name()), edge.port});
  }
  const auto lanes = lane_members(plan);
  for (size_t lane = 0; lane < lanes.size(); ++lane)
    for (const size_t member : lanes[lane]) trace.tasks[member].lane = lane;
  for (const PortPlan& port : plan.ports) trace.ports.push_back(port.node + "." + port.port);
}

void write_trace(std::ostream& out, const Json& head, const trace::Trace& trace) { Writer(out, trace).write(head); }

}  // namespace takt::explain
