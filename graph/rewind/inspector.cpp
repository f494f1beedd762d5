// SPDX-License-Identifier: Apache-2.0
#include "graph/rewind/inspector.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <utility>

#include "graph/attach/message_text.hpp"
#include "graph/language/share.hpp"
#include "graph/language/words.hpp"
#include "graph/rewind/seen_condition.hpp"
#include "graph/run/support.hpp"
#include "rt/sched/port_access.hpp"

namespace takt::rewind {
namespace {

constexpr const char* kHelp =
    "first | next [NODE] | back [NODE] | go NODE JOB | at SECONDS [NODE]: another job, with all of it\n"
    "in | out | params | state: that part of this job\n"
    "quit\n";

double ms(int64_t ns) { return static_cast<double>(ns) / 1e6; }

}  // namespace

Inspector::Inspector(RecordedRun& run) : run_(run) {
  const std::vector<TaskPlan>& tasks = run.plan().tasks;
  const auto part = run.parts().front().how;
  for (const record::RecordedJob& job : run.log().jobs())
    if (job.task < tasks.size() && !tasks[job.task].device && !job.cut_off && job.release_ns >= part.from_ns &&
        job.release_ns < part.end_ns && (part.run.empty() || part.run[job.task] != 0))
      jobs_.push_back(&job);
  std::stable_sort(jobs_.begin(), jobs_.end(), [](const auto* a, const auto* b) { return a->start_ns < b->start_ns; });
  if (jobs_.empty()) throw Refused{"there is no job of a node in this part of the record"};
}

record::ReplayResult Inspector::run(int64_t begin_ns, const decltype(record::Replayer::Options::visit)& visit) {
  if (std::exchange(used_, true)) run_.compose_again();
  record::Replayer::Options how = run_.parts().front().how;
  how.pace = {};
  how.begin_ns = begin_ns;
  how.visit = visit;
  return run_.run(std::move(how));
}

Inspector::Answer Inspector::go(size_t position) {
  const record::RecordedJob& wanted = *jobs_[position];
  bool there = false;
  run(wanted.start_ns, [&](const record::Replayer& replayer, const record::RecordedJob& job) {
    there = job.task == wanted.task && job.index == wanted.index;
    if (there) shown_ = show(replayer, job);
    return !there;
  });
  const std::string name = fmt::format("job {} of {}", wanted.index, run_.plan().tasks[wanted.task].name);
  position_ = position;
  if (!there) return {false, name + " could not be run: the record lacks what it was given\n"};
  return {true, shown_.head + shown_.in + shown_.out + shown_.params + shown_.state};
}

Inspector::Answer Inspector::go_to(const graph::ConditionSpec& spec) {
  const SeenCondition condition(spec, run_);
  const record::RecordedJob& from = *jobs_[position_];
  std::optional<std::pair<uint16_t, uint32_t>> found;
  std::string value;
  run(from.start_ns, [&](const record::Replayer& replayer, const record::RecordedJob& job) {
    if (job.start_ns < from.start_ns || command::StopOnSignal::asked()) return !command::StopOnSignal::asked();
    const auto seen = condition.behind(replayer, job);
    if (!seen || !seen->passes) return true;
    found.emplace(job.task, job.index);
    value = seen->value;
    shown_ = show(replayer, job);
    return false;
  });
  if (!found) return {false, fmt::format("no job made a message with {}\n", condition.text())};
  for (size_t i = 0; i < jobs_.size(); ++i)
    if (jobs_[i]->task == found->first && jobs_[i]->index == found->second) position_ = i;
  return {true, fmt::format("{}: {}\n", condition.text(), value) + shown_.head + shown_.in + shown_.out};
}

size_t Inspector::task_of(const std::string& node) const {
  std::vector<std::string> names;
  for (size_t t = 0; t < run_.plan().tasks.size(); ++t) {
    const TaskPlan& task = run_.plan().tasks[t];
    if (task.name == node && !task.device) return t;
    if (!task.device) names.push_back(task.name);
  }
  throw Refused{fmt::format("there is no node {}{}", graph::ticked(node),
                            graph::alternatives(node, names, "nodes of the graph"))};
}

Inspector::Answer Inspector::step(int direction, const std::string& node) {
  const size_t task = node.empty() ? kNone : task_of(node);
  for (size_t i = position_; direction > 0 ? i + 1 < jobs_.size() : i > 0;) {
    i = direction > 0 ? i + 1 : i - 1;
    if (task == kNone || jobs_[i]->task == task) return go(i);
  }
  return {false, direction > 0 ? "that was the last job\n" : "that was the first job\n"};
}

Inspector::Answer Inspector::at(double s, const std::string& node) {
  const size_t task = node.empty() ? kNone : task_of(node);
  for (size_t i = 0; i < jobs_.size(); ++i)
    if (jobs_[i]->start_ns >= run_.at(s) && (task == kNone || jobs_[i]->task == task)) return go(i);
  return {false, fmt::format("no job starts {} s into the run or later\n", s)};
}

Inspector::Answer Inspector::answer(const std::string& line) try {
  std::istringstream words(line);
  std::string what, node;
  words >> what;
  if (what.empty() || what == "next" || what == "n") return words >> node, step(1, node);
  if (what == "back" || what == "b") return words >> node, step(-1, node);
  if (what == "first") return go(0);
  if (what == "in") return {true, shown_.in};
  if (what == "out") return {true, shown_.out};
  if (what == "params") return {true, shown_.params};
  if (what == "state") return {true, shown_.state};
  if (what == "help") return {true, kHelp};
  if (double s = 0; what == "at" && words >> s) return words >> node, at(s, node);
  if (uint32_t job = 0; what == "go" && words >> node >> job) {
    const size_t task = task_of(node);
    for (size_t i = 0; i < jobs_.size(); ++i)
      if (jobs_[i]->task == task && jobs_[i]->index == job) return go(i);
    return {false, fmt::format("{} has no job {} in this part of the record\n", node, job)};
  }
  return {false, fmt::format("{} is none of\n{}", graph::ticked(line), kHelp)};
} catch (const Refused& refused) {
  return {false, refused.why + "\n"};
}

Inspector::Shown Inspector::show(const record::Replayer& replayer, const record::RecordedJob& job) const {
  const TaskPlan& task = run_.plan().tasks[job.task];
  const auto& modes = run_.plan().modes;
  Shown shown;
  shown.head = fmt::format(
      "{} job {}: released {:.6f} s, started {:.3f} ms later, finished {:.3f} ms after its release, deadline {:.3f} "
      "ms, "
      "CPU {:.3f} ms, level {}, mode {}{}\n",
      task.name, job.index, static_cast<double>(job.release_ns - run_.epoch_ns()) / 1e9,
      ms(job.start_ns - job.release_ns), ms(job.finish_ns - job.release_ns), ms(job.deadline_ns - job.release_ns),
      ms(job.cpu_ns), job.level, job.mode < modes.size() ? modes[job.mode].name : run_.plan().mode,
      job.late ? ", late" : "");
  shown.in = inputs(task);
  shown.out = outputs(replayer, job);
  for (const ParamBase* param : task.node->params())
    shown.params += fmt::format("  param {} = {}\n", param->name(), graph::recorded_text(*param));
  if (!task.node->declares_state()) shown.state = "  its type does not say what it remembers\n";
  StateArchive told = StateArchive::telling([&](const std::string& name, const std::string& value) {
    shown.state += fmt::format("  state {} = {}\n", name, value);
  });
  if (task.node->declares_state()) task.node->remember(told);
  return shown;
}

std::string Inspector::inputs(const TaskPlan& task) const {
  std::string text;
  for (const EdgePlan& edge : task.edges) {
    InputPort& input = *task.node->inputs()[edge.input];
    const PortPlan& port = run_.plan().ports[edge.port];
    if (input.empty()) text += fmt::format("  in {} ({}.{}): nothing\n", input.name(), port.node, port.port);
    for (size_t i = 0; i < input.size(); ++i)
      text +=
          fmt::format("  in {} ({}.{} {}, {:.6f} s{}): {}\n", input.name(), port.node, port.port,
                      PortAccess::held(input)[i].sequence,
                      static_cast<double>(input.stamp_ns(i) - run_.epoch_ns()) / 1e9, input.is_new(i) ? ", new" : "",
                      attach::message_json(input.type(), PortAccess::held(input)[i].message()).dump());
  }
  return text;
}

std::string Inspector::outputs(const record::Replayer& replayer, const record::RecordedJob& job) const {
  const TaskPlan& task = run_.plan().tasks[job.task];
  std::string text;
  for (const record::RecordedJob::Output& output : job.outputs) {
    if (output.output >= task.ports.size() || task.node->outputs()[output.output] == task.node->state()) continue;
    const PortPlan& port = run_.plan().ports[task.ports[output.output]];
    const MessageHeader* const message = replayer.newest(task.ports[output.output]);
    if (message == nullptr || message->sequence != output.sequence) continue;
    text += fmt::format("  out {} {}, {:.6f} s: {}\n", port.port, output.sequence,
                        static_cast<double>(message->stamp_ns - run_.epoch_ns()) / 1e9,
                        attach::message_json(*port.type, message + 1).dump());
  }
  return text.empty() ? "  out: nothing\n" : text;
}

}  // namespace takt::rewind
