// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/plan.hpp"

namespace takt {

std::string_view to_string(Policy policy) {
  switch (policy) {
    case Policy::deadline: return "deadline";
    case Policy::fixed: return "fixed";
    case Policy::cooperative: return "cooperative";
  }
  return "";
}

std::string_view to_string(Criticality criticality) { return criticality == Criticality::high ? "high" : "low"; }

std::string_view to_string(OnOverrun verb) {
  switch (verb) {
    case OnOverrun::proceed: return "continue";
    case OnOverrun::degrade: return "degrade";
    case OnOverrun::safe_stop: return "safe_stop";
  }
  return "";
}

std::string_view to_string(OnMiss verb) {
  switch (verb) {
    case OnMiss::proceed: return "continue";
    case OnMiss::skip: return "skip";
    case OnMiss::reuse_last: return "reuse_last";
    case OnMiss::safe_stop: return "safe_stop";
  }
  return "";
}

PortProducers::PortProducers(const Plan& plan) : by_port_(plan.ports.size(), kNone) {
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    for (const size_t port : plan.tasks[t].ports) {
      if (port >= by_port_.size()) by_port_.resize(port + 1, kNone);
      by_port_[port] = t;
    }
  }
}

double effective_rate_hz(const Plan& plan, size_t task) {
  double divisor = 1;
  for (size_t hops = 0; hops <= plan.tasks.size() && task != kNone; ++hops) {
    const TaskPlan& t = plan.tasks[task];
    if (t.rate) return t.rate->hz() / divisor;
    divisor *= t.every;
    task = t.on_task;
  }
  return 0;
}

}  // namespace takt
