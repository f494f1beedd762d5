// SPDX-License-Identifier: Apache-2.0
#include "rt/assembly.hpp"

#include <algorithm>
#include <atomic>
#include <map>
#include <stdexcept>
#include <vector>

#include "rt/sched/executor.hpp"
#include "rt/sched/plan.hpp"
#include "rt/sched/plan_ports.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/shm/transport.hpp"

namespace takt {
namespace {

constexpr int64_t kUsualDeadline_ns = 100'000'000, kStartDelay_ns = 2'000'000;

std::string id(const std::string& node, std::string_view port) { return node + "." + std::string(port); }

}  // namespace

struct Assembly::Inside {
  Plan plan;
  std::vector<std::unique_ptr<Node>> nodes;
  std::vector<std::filesystem::path> directories;
  std::map<const OutputPort*, size_t> ports;
  std::map<const InputPort*, std::pair<size_t, size_t>> inputs;  ///< task, and which of its inputs
  bool ran = false;
  std::unique_ptr<Clock> clock;
  std::unique_ptr<Transport> transport;
  std::unique_ptr<Executor> executor;
  std::atomic<Executor*> running{nullptr};

  const OutputPort& output(size_t port) const {
    return *std::find_if(ports.begin(), ports.end(), [&](const auto& entry) { return entry.second == port; })->first;
  }

  /// Producers before consumers, as far as links allow: a node learns in setup how large its inputs can become.
  std::vector<size_t> in_order(const PortProducers& producers) const {
    std::vector<size_t> order;
    std::vector<char> seen(plan.tasks.size());
    const auto visit = [&](const auto& self, size_t task) -> void {
      if (std::exchange(seen[task], 1) != 0) return;
      for (const EdgePlan& edge : plan.tasks[task].edges) self(self, producers.find(edge.port));
      order.push_back(task);
    };
    for (size_t task = 0; task < plan.tasks.size(); ++task) visit(visit, task);
    return order;
  }

  void set_up(size_t t, const Clock& clock) {
    TaskPlan& task = plan.tasks[t];
    if (!task.rate && task.on_task == kNone)
      throw std::invalid_argument(task.name + " has no rate, and no input of it triggers; give one of both");
    for (const EdgePlan& edge : task.edges)
      PortAccess::connect(*task.node->inputs()[edge.input], output(edge.port).capacity());
    for (const InputPort* input : task.node->inputs())
      if (input->need() == Need::required && !input->connected())
        throw std::invalid_argument(id(task.name, input->name()) + " must be connected");
    Setup setup{clock, directories[t], std::filesystem::current_path(), t, task.rate, task.offset_ns};
    try {
      task.node->setup(setup);
      task.node->end_setup();
    } catch (const SetupError& problem) {
      throw SetupError(task.name + ": " + problem.what());
    }
    for (size_t o = 0; o < task.ports.size(); ++o)
      plan.ports[task.ports[o]].capacity = task.node->outputs()[o]->capacity();
  }
};

Assembly::Assembly() : inside_(std::make_unique<Inside>()) {}
Assembly::~Assembly() = default;

void Assembly::insert(const std::string& name, const Pace& pace, std::unique_ptr<Node> node) {
  Plan& plan = inside_->plan;
  for (const TaskPlan& other : plan.tasks)
    if (other.name == name) throw std::invalid_argument("there are two nodes `" + name + "`; name one otherwise");
  TaskPlan task;
  task.name = name;
  task.node = node.get();
  task.rate = pace.rate;
  task.offset_ns = pace.offset_ns;
  const int64_t usual = pace.rate ? pace.rate->period_ns() : kUsualDeadline_ns;
  task.deadline_ns = pace.deadline_ns > 0 ? pace.deadline_ns : usual;
  for (OutputPort* output : node->outputs()) {
    task.ports.push_back(plan.ports.size());
    inside_->ports.emplace(output, plan.ports.size());
    PortPlan port;
    port.node = name;
    port.port = output->name();
    port.type = &output->type();
    plan.ports.push_back(port);
  }
  for (size_t i = 0; i < node->inputs().size(); ++i)
    inside_->inputs.emplace(node->inputs()[i], std::pair(plan.tasks.size(), i));
  plan.tasks.push_back(std::move(task));
  inside_->directories.push_back(pace.directory.empty() ? std::filesystem::current_path() : pace.directory);
  inside_->nodes.push_back(std::move(node));
}

void Assembly::join(const OutputPort& from, const InputPort& to, const Link& link) {
  const auto port = inside_->ports.find(&from);
  const auto input = inside_->inputs.find(&to);
  if (port == inside_->ports.end() || input == inside_->inputs.end())
    throw std::invalid_argument(std::string(from.name()) + " -> " + std::string(to.name()) +
                                ": both must be ports of nodes of this assembly; add() the nodes first");
  Plan& plan = inside_->plan;
  TaskPlan& task = plan.tasks[input->second.first];
  const std::string name = id(task.name, to.name());
  for (const EdgePlan& edge : task.edges)
    if (edge.input == input->second.second) throw std::invalid_argument(name + " is connected already");
  if (link.depth < 1 || link.depth > InputPort::kMaxDepth)
    throw std::invalid_argument(name + ": depth is " + std::to_string(link.depth) + "; it must be 1 to " +
                                std::to_string(InputPort::kMaxDepth));
  if (link.triggers) {
    if (task.rate) throw std::invalid_argument(name + " cannot trigger: " + task.name + " has a rate");
    if (task.on_task != kNone) throw std::invalid_argument(name + " cannot trigger: another input of it does");
    task.on_task = PortProducers(plan).find(port->second);
    task.on_port = port->second;
  }
  task.edges.push_back({input->second.second, port->second, link.depth, link.max_age_ns});
  PortAccess::mark_read(const_cast<OutputPort&>(from));
}

void Assembly::run(const RunFor& how) {
  if (std::exchange(inside_->ran, true)) throw std::logic_error("an assembly runs once; make another one");
  Inside& in = *inside_;
  if (how.virtual_time) in.clock = std::make_unique<VirtualClock>();
  else in.clock = std::make_unique<MonotonicClock>();
  for (const size_t task : in.in_order(PortProducers(in.plan))) in.set_up(task, *in.clock);
  size_ports(in.plan);
  in.transport = make_local_transport(in.plan.ports);
  Executor::Options options;
  options.duration_ns = how.duration_ns;
  options.start_delay_ns = how.virtual_time ? 0 : kStartDelay_ns;
  in.executor = std::make_unique<Executor>(in.plan, *in.transport, *in.clock, options);
  in.running = in.executor.get();
  const RunResult result = in.executor->run();
  if (!result.stuck.empty()) {
    const std::string name = in.plan.tasks[result.stuck.front()].name;
    static_cast<void>(inside_.release());  // its thread goes on, and uses all this until the process ends
    throw std::runtime_error("a job of " + name + " never returned; its thread is still at work");
  }
  for (const auto& node : in.nodes) node->finish();
}

void Assembly::stop() {
  if (inside_ == nullptr) return;
  if (Executor* const executor = inside_->running) executor->stop();
}

}  // namespace takt
