// SPDX-License-Identifier: Apache-2.0
#include "graph/check/ages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "rt/node.hpp"
#include "rt/sched/analysis/chain_age.hpp"
#include "rt/sched/analysis/integers.hpp"
#include "rt/sched/lane.hpp"

namespace takt::graph {
namespace {

using analysis::ChainTask;
using analysis::Ticks;
using analysis::Wide;

/// One step of a path: a task, and the edge by which the data came to it (kNone at the device).
struct Step {
  size_t task = kNone, edge = kNone;
};
using Path = std::vector<Step>;

/// Where an age is asked for: where a job of the task has taken its message of `edge`, else where its output `port` is
/// visible.
struct Place {
  size_t task = kNone, edge = kNone, port = kNone;
  bool is_input() const { return edge != kNone; }
};

class Ages {
 public:
  Ages(const Plan& plan, const std::vector<NodeAdmission>& nodes) : plan_(plan), nodes_(nodes), producers_(plan) {
    ticks_ = ticks_per_ns();
  }

  /// Worst over the paths from a device to that place that pass `through` (kNone: any port).
  void judge(const Place& place, size_t through, AgeBound& bound) {
    std::vector<Path> paths;
    Path walk;
    collect(place, through, through == kNone, walk, paths);
    bound.reached = !paths.empty();
    if (!bound.reached) bound.why = "no path from a device leads there";
    if (paths.size() >= kMostPaths) bound.why = "too many paths lead there";
    bound.bound_ns = bound.oldest_ns = 0;
    for (const Path& path : paths) add(path, place.is_input(), bound);
    if (!bound.why.empty()) bound.bound_ns = bound.oldest_ns = std::nullopt;
  }

 private:
  static constexpr size_t kMostPaths = 10'000;

  /// As many as make every period whole; 1 where that is too fine.
  int64_t ticks_per_ns() const {
    constexpr int64_t kFinest = 1'000'000;
    int64_t ticks = 1, longest_ns = 0;
    for (const auto& lane : lane_members(plan_)) {
      const Rate& rate = *plan_.tasks[lane.front()].rate;
      ticks = std::lcm(ticks, rate.numerator);
      if (ticks > kFinest) return 1;
      longest_ns = std::max(longest_ns, rate.period_ns());
    }
    return Wide{longest_ns} * ticks > analysis::kLongest ? 1 : ticks;
  }

  /// Whether stamps of what comes by that edge go out again by `port` (kNone: by any).
  static bool carries_stamp(const TaskPlan& task, size_t edge, size_t port) {
    if (task.node == nullptr) return true;
    const InputPort& input = *task.node->inputs()[task.edges[edge].input];
    if (&input == task.node->control()) return false;
    const auto made = std::find(task.ports.begin(), task.ports.end(), port);
    return made == task.ports.end() ||
           task.node->outputs()[static_cast<size_t>(made - task.ports.begin())]->stamped_by(input);
  }

  /// Backwards from a place to devices; no node twice.
  void collect(const Place& place, size_t through, bool passed, Path& walk, std::vector<Path>& paths) const {
    if (paths.size() >= kMostPaths) return;
    const size_t t = place.task;
    const TaskPlan& task = plan_.tasks[t];
    const auto again = [&](size_t producer) {
      return std::any_of(walk.begin(), walk.end(), [&](const Step& s) { return s.task == producer; });
    };
    const bool device_output = task.device && !place.is_input();
    if (device_output || task.edges.empty()) {  // a device's stamps are its own, whatever it reads
      if (!passed) return;
      walk.push_back({t, kNone});
      paths.emplace_back(walk.rbegin(), walk.rend());
      walk.pop_back();
      return;
    }
    for (size_t e = 0; e < task.edges.size(); ++e) {
      if (place.is_input() ? e != place.edge : !carries_stamp(task, e, place.port)) continue;
      const size_t port = task.edges[e].port, producer = producers_.find(port);
      if (producer == kNone) continue;
      // A device that is both ends of a loop, as of what it is to do for what it saw, ends the path where it begins.
      if (!plan_.tasks[producer].device && (producer == t || again(producer))) continue;
      walk.push_back({t, e});
      collect({producer, kNone, port}, through, passed || port == through, walk, paths);
      walk.pop_back();
    }
  }

  /// The task as the analysis of chains sees it, without the edge it reads. Which of its producer's messages an
  /// `every`-th one is depends on the first that was made: at the `last` task of a chain any may be it.
  ChainTask model(size_t t, bool last) const {
    size_t head = t;
    Wide every = 1;
    int64_t apart = 0;
    for (; plan_.tasks[head].on_task != kNone && !plan_.tasks[head].rate; head = plan_.tasks[head].on_task) {
      every *= plan_.tasks[head].every;
      apart = std::max(apart, plan_.tasks[head].min_interval_ns);
    }
    if (last) {
      every = 1;
      apart = 0;
    }
    const Rate& rate = *plan_.tasks[head].rate;
    ChainTask model;
    const Wide period = Wide{rate.denominator} * 1'000'000'000 * ticks_ / rate.numerator * every;
    model.period = static_cast<Ticks>(std::min<Wide>(period, analysis::kLongest));
    model.offset = plan_.tasks[head].offset_ns * ticks_;
    model.phased = every == 1 && apart == 0;
    if (apart > 0) {
      model.period += (apart * ticks_ + model.period - 1) / model.period * model.period;
    }
    model.visible = visible_ns(t).value_or(0) * ticks_;
    return model;
  }

  /// With `let` the output waits for the deadline, which the lane counts from the release of this very task. Nothing if
  /// a response that it depends on has no bound.
  std::optional<int64_t> visible_ns(size_t t) const {
    const TaskPlan& task = plan_.tasks[t];
    const std::optional<int64_t>& finish_ns = nodes_[t].finish_ns;
    if (!finish_ns || task.publish == PublishAt::asap) return finish_ns;
    const auto released = task.on_task == kNone ? std::optional<int64_t>(0) : visible_ns(task.on_task);
    return released ? std::optional(std::max(*finish_ns, *released + task.deadline_ns)) : std::nullopt;
  }

  void add(const Path& path, bool as_input, AgeBound& bound) {
    std::vector<ChainTask> chain;
    for (size_t i = 0; i < path.size(); ++i) {
      const TaskPlan& task = plan_.tasks[path[i].task];
      ChainTask m = model(path[i].task, i + 1 == path.size());
      if (!visible_ns(path[i].task)) bound.why = fmt::format("no response of {} is bounded", task.name);
      if (i > 0) {
        const EdgePlan& edge = task.edges[path[i].edge];
        m.follows = task.on_task == path[i - 1].task && task.on_port == edge.port;
        m.depth = as_input && i + 1 == path.size() ? 1 : edge.depth;  // an edge's max_age asks for the newest
        check_join(task, path[i], bound);
      }
      if (as_input && i + 1 == path.size() && nodes_[path[i].task].start_ns)
        m.visible = *nodes_[path[i].task].start_ns * ticks_;
      chain.push_back(m);
    }
    const TaskPlan& device = plan_.tasks[path.front().task];
    if (!device.source.unknown.empty())
      bound.why = fmt::format("how old what {} gives can be is not known: {}", device.name, device.source.unknown);
    const int64_t lag = device.source.lag_ns;
    const analysis::ChainAge age = analysis::chain_age(chain);
    bound.least_ns = std::max(bound.least_ns, lag + analysis::least_chain_age(chain) / ticks_);
    if (!bound.bound_ns) return;
    bound.bound_ns = std::max(*bound.bound_ns, lag + (age.newest + ticks_ - 1) / ticks_);
    bound.oldest_ns = std::max(*bound.oldest_ns, lag + (age.oldest + ticks_ - 1) / ticks_);
  }

  /// Of a join of equal stamps the slowest input decides, if the others only wait for it: if what they read lies on
  /// the way of the slowest. Its path is then among those judged.
  void check_join(const TaskPlan& task, const Step& step, AgeBound& bound) const {
    for (const auto& group : task.joins) {
      const auto joined = [&](size_t input) { return std::find(group.begin(), group.end(), input) != group.end(); };
      if (!joined(task.edges[step.edge].input)) continue;
      const size_t own = producers_.find(task.edges[step.edge].port);
      for (const EdgePlan& other : task.edges) {
        if (!joined(other.input)) continue;
        const size_t producer = producers_.find(other.port);
        if (producer == own || upstream(own, producer) || upstream(producer, own)) continue;
        bound.why = fmt::format("{} joins outputs of {} and {}, and how often their stamps meet is not known",
                                task.name, plan_.tasks[own].name, plan_.tasks[producer].name);
      }
    }
  }

  /// True if data of `above` reaches `below`, not through a device.
  bool upstream(size_t above, size_t below) const {
    if (below == kNone) return false;
    std::vector<size_t> todo{below};
    std::vector<char> seen(plan_.tasks.size(), 0);
    while (!todo.empty()) {
      const size_t t = todo.back();
      todo.pop_back();
      if (t == above) return true;
      if (seen[t] || plan_.tasks[t].device) continue;
      seen[t] = 1;
      for (const EdgePlan& edge : plan_.tasks[t].edges)
        if (const size_t producer = producers_.find(edge.port); producer != kNone) todo.push_back(producer);
    }
    return false;
  }

  const Plan& plan_;
  const std::vector<NodeAdmission>& nodes_;
  const PortProducers producers_;
  int64_t ticks_ = 1;
};

size_t port_of(const Plan& plan, const PortName& name) {
  for (size_t p = 0; p < plan.ports.size(); ++p)
    if (plan.ports[p].node == name.node && plan.ports[p].port == name.port) return p;
  return kNone;
}

size_t task_of(const Plan& plan, const std::string& name) {
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    if (plan.tasks[t].name == name) return t;
  return kNone;
}

size_t edge_of(const TaskPlan& task, const std::string& input) {
  for (size_t e = 0; e < task.edges.size(); ++e)
    if (task.node != nullptr && task.node->inputs()[task.edges[e].input]->name() == input) return e;
  return kNone;
}

}  // namespace

std::vector<AgeBound> age_bounds(const GraphSpec& graph, const Plan& plan, const std::vector<NodeAdmission>& nodes) {
  std::vector<AgeBound> result;
  Ages ages(plan, nodes);
  const bool reduced = plan.tasks.size() < graph.devices.size() + graph.nodes.size();
  const auto note = [&](AgeBound bound) {
    if (bound.reached || !reduced) result.push_back(std::move(bound));
  };
  for (const ChainSpec& chain : graph.chains) {
    const size_t to = task_of(plan, chain.to.node), from = task_of(plan, chain.from.node);
    if (to == kNone || from == kNone) continue;  // left out by the mode
    const size_t edge = edge_of(plan.tasks[to], chain.to.port);
    AgeBound bound{chain.name, false, chain.max_age_ns, {}, {}, 0, {}, true};
    ages.judge({to, edge, port_of(plan, chain.to)}, port_of(plan, chain.from), bound);
    note(std::move(bound));
  }
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const TaskPlan& task = plan.tasks[t];
    for (size_t e = 0; e < task.edges.size(); ++e) {
      if (task.edges[e].max_age_ns == 0) continue;
      const PortPlan& port = plan.ports[task.edges[e].port];
      const std::string input =
          task.node != nullptr ? "." + std::string(task.node->inputs()[task.edges[e].input]->name()) : "";
      AgeBound bound{
          port.node + "." + port.port + " -> " + task.name + input, true, task.edges[e].max_age_ns, {}, {}, 0, {}, true};
      ages.judge({t, e}, kNone, bound);
      note(std::move(bound));
    }
  }
  return result;
}

}  // namespace takt::graph
