// SPDX-License-Identifier: Apache-2.0
#include "graph/compose/plan_ports.hpp"

#include <algorithm>
#include <cmath>

namespace takt::graph {
namespace {

/// Messages a producer can publish within a span, at most.
uint32_t messages_within(int64_t span_ns, double rate_hz) {
  return static_cast<uint32_t>(std::ceil(static_cast<double>(span_ns) * 1e-9 * rate_hz)) + 1;
}

bool joined(const TaskPlan& task, const EdgePlan& edge) {
  return std::any_of(task.joins.begin(), task.joins.end(), [&](const auto& group) {
    return std::find(group.begin(), group.end(), edge.input) != group.end();
  });
}

/// How long after its release a job of this task may still latch: a late job keeps the next release pending for up to a
/// period, unless passed releases are dropped.
int64_t latest_start_ns(const TaskPlan& task) {
  const bool pends = task.rate && task.on_miss != OnMiss::skip;
  return pends ? std::max(task.rate->period_ns(), task.deadline_ns) : task.deadline_ns;
}

size_t producer_of(const Plan& plan, size_t port) {
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const auto& ports = plan.tasks[t].ports;
    if (std::find(ports.begin(), ports.end(), port) != ports.end()) return t;
  }
  return kNone;
}

}  // namespace

void size_ports(Plan& plan, const Observers& observers) {
  const uint32_t readers = observers.taps + observers.followers;
  for (size_t p = 0; p < plan.ports.size(); ++p) {
    PortPlan& port = plan.ports[p];
    port.held += readers;
    port.readers += readers;
    if (observers.followers > 0)
      port.history = messages_within(observers.kept_ns, effective_rate_hz(plan, producer_of(plan, p)));
  }
  // A join looks for equal stamps among outputs of different latency: keep as many messages as the slowest of them may
  // lag behind the fastest, here the longest deadline of any task.
  int64_t longest_deadline = 0;
  for (const TaskPlan& task : plan.tasks) longest_deadline = std::max(longest_deadline, task.deadline_ns);
  for (const TaskPlan& task : plan.tasks) {
    for (const EdgePlan& edge : task.edges) {
      PortPlan& port = plan.ports[edge.port];
      const size_t producer = producer_of(plan, edge.port);
      const double rate = effective_rate_hz(plan, producer);
      const int64_t not_yet_visible = plan.tasks[producer].deadline_ns;
      uint32_t history =
          edge.depth + messages_within(latest_start_ns(task), rate) + messages_within(not_yet_visible, rate);
      if (joined(task, edge)) history += messages_within(std::min<int64_t>(longest_deadline, 500'000'000), rate);
      port.history = std::max(port.history, history);
      port.held += edge.depth;
      ++port.readers;
    }
  }
}

}  // namespace takt::graph
