// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/plan_ports.hpp"

#include <algorithm>
#include <cmath>

#include "rt/node.hpp"

namespace takt {
namespace {

/// Messages a producer can publish within a span, at most.
uint32_t messages_within(int64_t span_ns, double rate_hz) {
  return static_cast<uint32_t>(std::ceil(static_cast<double>(span_ns) * 1e-9 * rate_hz)) + 1;
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

bool carries_stamp(const TaskPlan& task, const EdgePlan& edge, size_t output) {
  const InputPort& input = *task.node->inputs()[edge.input];
  return &input != task.node->control() && task.node->outputs()[output]->stamped_by(input);
}

/// How old the newest message of that port can be: what its task took was as old as such a message can be, then came a
/// period, a late start and the deadline. `walked`: tasks on the way here; a loop ends where it began.
int64_t oldest_ns(const Plan& plan, size_t port, std::vector<size_t>& walked) {
  const size_t t = producer_of(plan, port);
  const TaskPlan& task = plan.tasks[t];
  const auto output = static_cast<size_t>(std::find(task.ports.begin(), task.ports.end(), port) - task.ports.begin());
  int64_t taken = 0;
  walked.push_back(t);
  for (const EdgePlan& edge : task.edges) {
    if (task.device || !carries_stamp(task, edge, output)) continue;  // a device's stamps are its own
    if (std::find(walked.begin(), walked.end(), producer_of(plan, edge.port)) != walked.end()) continue;
    taken = std::max(taken, oldest_ns(plan, edge.port, walked));
  }
  walked.pop_back();
  const double rate = effective_rate_hz(plan, t);  // 0: it runs when somebody asks, and nobody can say when
  const int64_t period = rate > 0 ? static_cast<int64_t>(1e9 / rate) : 0;
  return taken + std::max(period, task.min_interval_ns) + latest_start_ns(task) + task.deadline_ns;
}

/// The oldest stamp that a partner of this edge in a join may come with; 0 if it is in none.
int64_t partners_oldest_ns(const Plan& plan, const TaskPlan& task, const EdgePlan& edge) {
  int64_t oldest = 0;
  for (const auto& group : task.joins) {
    const auto in_group = [&](const EdgePlan& e) {
      return std::find(group.begin(), group.end(), e.input) != group.end();
    };
    if (!in_group(edge)) continue;
    for (const EdgePlan& partner : task.edges) {
      std::vector<size_t> walked;
      if (partner.input != edge.input && in_group(partner))
        oldest = std::max(oldest, oldest_ns(plan, partner.port, walked));
    }
  }
  return oldest;
}

}  // namespace

double messages_s(const Plan& plan, size_t port) {
  const size_t t = producer_of(plan, port);
  const TaskPlan& task = plan.tasks[t];
  const double rate = effective_rate_hz(plan, t);
  return is_state_port(task, port) ? std::min(rate, 1e9 / static_cast<double>(task.state_every_ns)) : rate;
}

void size_ports(Plan& plan, const Observers& observers) {
  const uint32_t readers = observers.taps + observers.followers;
  for (size_t p = 0; p < plan.ports.size(); ++p) {
    PortPlan& port = plan.ports[p];
    port.held += readers;
    port.readers += readers;
    if (observers.followers > 0) port.history = messages_within(observers.kept_ns, messages_s(plan, p));
  }
  for (const TaskPlan& task : plan.tasks) {
    for (const EdgePlan& edge : task.edges) {
      PortPlan& port = plan.ports[edge.port];
      const size_t producer = producer_of(plan, edge.port);
      const double rate = effective_rate_hz(plan, producer);
      const int64_t not_yet_visible = plan.tasks[producer].deadline_ns;
      uint32_t history =
          edge.depth + messages_within(latest_start_ns(task), rate) + messages_within(not_yet_visible, rate);
      // A join looks for equal stamps: what has one that a partner may still come with is kept.
      if (const int64_t oldest = partners_oldest_ns(plan, task, edge); oldest > 0)
        history += messages_within(oldest, rate);
      port.history = std::max(port.history, history);
      port.held += edge.depth;
      ++port.readers;
    }
  }
}

}  // namespace takt
