// SPDX-License-Identifier: Apache-2.0
#include "graph/compose/composition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "graph/compose/plan_modes.hpp"
#include "graph/language/share.hpp"
#include "hal/device_node.hpp"
#include "hal/devices.hpp"
#include "hal/reads_files.hpp"
#include "rt/machine/limits.hpp"
#include "rt/sched/port_access.hpp"

namespace takt::graph {
namespace {

constexpr int64_t kSecond = 1'000'000'000;
constexpr int64_t kLeastRoom = 16'000'000;  ///< bytes; setups take some of memory at once

/// Ports of the plan by name.
using PortIndex = std::map<std::string, size_t>;

template <class Ports>
size_t index_of(const Ports& ports, std::string_view name) {
  for (size_t i = 0; i < ports.size(); ++i) {
    if (ports[i]->name() == name) return i;
  }
  return kNone;
}

std::unique_ptr<Node> make_node(const NodeSpec& spec, const NodeTypes& types, bool with_state) {
  std::unique_ptr<Node> node = types.find(spec.type)->make();
  if (with_state && node->declares_state()) node->publish_state();
  for (ParamBase* param : node->params()) {
    // Ranges were checked when the graph was loaded; a refusal here is a bug in the checker.
    if (const auto it = spec.params.find(std::string(param->name())); it != spec.params.end()) {
      if (!param->set(it->second.value)) std::abort();
    } else if (param->unit() == kPath) {
      if (!param->set(default_asset(*param))) std::abort();
    }
  }
  return node;
}

/// What the registry's `setting_up` is told while it lives: whose setup it is that crashes or never returns.
class Told {
 public:
  Told(const Registry& registry, const Position& at, const std::string& node) : told_(registry.setting_up) {
    if (told_) told_(to_string(Problem{at, node}));
  }
  ~Told() {
    if (told_) told_({});
  }
  Told(const Told&) = delete;
  Told& operator=(const Told&) = delete;

 private:
  const std::function<void(std::string_view)>& told_;
};

void give_setup(Node& node, const TaskPlan& task, size_t t, const GraphSpec& graph, const Clock& clock,
                const ComposeOptions& options, const Registry& registry, const Position& at) {
  const Told told(registry, at, task.name);
  Setup setup{clock, graph.directory, options.output, options.seed + t, task.rate, task.offset_ns};
  node.setup(setup);
  node.end_setup();
  if (node.state() != nullptr) node.size_state();
}

class Composer {
 public:
  Composer(const GraphSpec& graph, const Registry& registry, const Clock& clock, const ComposeOptions& options)
      : graph_(graph), registry_(registry), clock_(clock), options_(options) {}

  tl::expected<Composition, ComposeError> compose(const DeviceFactory& make_device) {
    if (auto made = make_devices(make_device); !made) return tl::make_unexpected(made.error());
    make_nodes();
    connect();
    for (size_t t = 0; t < result_.plan.tasks.size(); ++t)
      if (result_.plan.tasks[t].device && owns(result_.plan.tasks[t].name)) ask_source(t);
    if (auto ready = set_up(); !ready) return tl::make_unexpected(ready.error());
    for (size_t p = 0; p < result_.plan.ports.size(); ++p)
      result_.plan.ports[p].capacity = capacity_of(p).value_or(Capacity{});
    size_ports(result_.plan, options_.observers);
    for (size_t t = 0; t < result_.plan.tasks.size(); ++t)
      if (TaskPlan& task = result_.plan.tasks[t]; task.device && !owns(task.name))
        task.source = options_.exchange->wait_for_source(t);
    return std::move(result_);
  }

  Composition outline() {
    for (const DeviceSpec& device : graph_.devices) add_device(device, shell_of(device));
    make_nodes();
    connect();
    return std::move(result_);
  }

 private:
  tl::expected<void, ComposeError> make_devices(const DeviceFactory& make_device) {
    for (const DeviceSpec& device : graph_.devices) {
      if (!owns(device.id)) {
        add_device(device, shell_of(device));
        continue;
      }
      auto node = make_device(device);
      if (!node) return tl::make_unexpected(node.error());
      if (auto* const hardware = dynamic_cast<DeviceNode*>(node->get()))
        if (const auto* const reader = dynamic_cast<const ReadsFiles*>(&hardware->device()))
          for (const std::string& left : reader->left_out()) result_.left_out.push_back(device.id + ": " + left);
      add_device(device, std::move(*node));
    }
    return {};
  }

  std::unique_ptr<Node> shell_of(const DeviceSpec& device) const {
    if (device.remote) return std::make_unique<RemoteNode>(remote_ports(registry_, *device.remote), nullptr);
    return registry_.devices.find(device.kind)->shell();
  }

  void add_device(const DeviceSpec& device, std::unique_ptr<Node> node) {
    add(device.id, std::move(node), true, device.position);
    if (auto& task = result_.plan.tasks.back(); !task.rate && task.on_task == kNone) task.rate = device.rate;
  }

  /// Before anything is set up: what is known in advance does not depend on what the device is like today.
  void ask_source(size_t t) {
    TaskPlan& task = result_.plan.tasks[t];
    if (auto* const hardware = dynamic_cast<DeviceNode*>(task.node)) {
      StampLaw law = hardware->stamp_law({task.rate, task.offset_ns});
      task.source = {law.lag_ns(), law.wait_ns, std::move(law.unknown), hardware->known_faults(),
                     hardware->takes_answers()};
    }
    if (options_.exchange != nullptr) options_.exchange->tell_source(t, task.source);
  }

  bool owns(const std::string& id) const { return !options_.owns || options_.owns(id); }

  /// Of an output of this process, or as its owner tells.
  std::optional<Capacity> capacity_of(size_t port) {
    const PortPlan& plan = result_.plan.ports[port];
    return owns(plan.node) ? output_of(plan).capacity() : options_.exchange->wait_for(port);
  }

  void make_nodes() {
    for (const NodeSpec& spec : graph_.nodes) {
      add(spec.id, make_node(spec, registry_.nodes, graph_.record.state_every_ns() > 0), false, spec.position);
    }
  }

  void add(const std::string& id, std::unique_ptr<Node> node, bool device, const Position& position) {
    TaskPlan task;
    task.name = id;
    task.node = node.get();
    task.device = device;
    if (const auto it = graph_.schedule.entries.find(id); it != graph_.schedule.entries.end()) fill(task, it->second);
    if (node->state() != nullptr) task.state_every_ns = graph_.record.state_every_ns();
    for (const OutputPort* output : node->outputs()) {
      port_index_[id + "." + std::string(output->name())] = result_.plan.ports.size();
      task.ports.push_back(result_.plan.ports.size());
      PortPlan port;
      port.node = id;
      port.port = output->name();
      port.type = &output->type();
      if (is_described(*port.type)) port.counts.emplace();
      result_.plan.ports.push_back(port);
    }
    task_index_[id] = result_.plan.tasks.size();
    positions_.push_back(position);
    result_.plan.tasks.push_back(std::move(task));
    result_.nodes.push_back(std::move(node));
  }

  static void fill(TaskPlan& task, const ScheduleEntry& entry) {
    task.rate = entry.rate;
    task.every = entry.every;
    task.min_interval_ns = entry.min_interval_ns;
    task.offset_ns = entry.offset_ns;
    task.deadline_ns = entry.deadline_ns;
    task.budget_ns = entry.budget_ns;
    task.criticality = entry.criticality;
    task.on_overrun = entry.on_overrun;
    task.on_miss = entry.on_miss;
    task.publish = entry.publish;
    task.memory_bytes = entry.memory_bytes;
    task.core = entry.core;
  }

  void connect() {
    result_.plan.policy = graph_.schedule.policy;
    result_.plan.cores = graph_.schedule.cores;
    result_.plan.anticipate_ns = graph_.schedule.anticipate_ns;
    result_.plan.mode = graph_.mode;
    std::set<std::string> subsystems;
    for (const NodeSpec& node : graph_.nodes) subsystems.insert(node.subsystem);
    result_.plan.processes = static_cast<int64_t>(subsystems.size()) + 1;  // and one of the devices
    for (const DeviceSpec& spec : graph_.devices) connect_inputs(result_.plan.tasks[task_index_.at(spec.id)], spec);
    for (const NodeSpec& spec : graph_.nodes) connect_inputs(result_.plan.tasks[task_index_.at(spec.id)], spec);
    mark_expected();
    for (auto& task : result_.plan.tasks) {
      const auto it = graph_.schedule.entries.find(task.name);
      if (it == graph_.schedule.entries.end() || !it->second.on) continue;
      task.on_task = task_index_.at(it->second.on->node);
      task.on_port = port_index_.at(it->second.on->text());
    }
    for (size_t t = 0; t < result_.plan.tasks.size(); ++t) {
      TaskPlan& task = result_.plan.tasks[t];
      if (task.deadline_ns > 0) continue;
      const double rate = effective_rate_hz(result_.plan, t);
      task.deadline_ns = rate > 0 ? static_cast<int64_t>(1e9 / rate) : kSecond;
    }
    add_modes(graph_, result_.plan);
  }

  void connect_inputs(TaskPlan& task, const DeviceSpec& spec) { connect_edges(task, spec.edges); }

  void connect_inputs(TaskPlan& task, const NodeSpec& spec) {
    connect_edges(task, spec.edges);
    for (const auto& group : spec.joins) {
      std::vector<size_t> inputs;
      for (const std::string& name : group) inputs.push_back(index_of(task.node->inputs(), name));
      task.joins.push_back(std::move(inputs));
    }
  }

  void connect_edges(TaskPlan& task, const std::vector<EdgeSpec>& edges) {
    for (const EdgeSpec& edge : edges) {
      const size_t input = index_of(task.node->inputs(), edge.input);
      const size_t port = port_index_.at(edge.from.text());
      task.edges.push_back({input, port, static_cast<uint32_t>(edge.depth), edge.max_age_ns.value_or(0)});
      OutputPort& output = output_of(result_.plan.ports[port]);
      PortAccess::mark_read(output);
    }
  }

  /// Whoever expects something of an output reads it, too, and other machines do: nodes leave out what nobody reads.
  void mark_expected() {
    for (const PortName& port : graph_.exported) {
      PortAccess::mark_read(output_of(result_.plan.ports[port_index_.at(port.text())]));
      result_.plan.tasks[task_index_.at(port.node)].rings = true;
    }
    if (!graph_.expect) return;
    const auto mark = [&](const ConditionSpec& condition) {
      if (const auto port = port_index_.find(condition.port.text()); port != port_index_.end())
        PortAccess::mark_read(output_of(result_.plan.ports[port->second]));
    };
    for (const ConditionSpec& condition : graph_.expect->conditions) {
      mark(condition);
      std::for_each(condition.unless.begin(), condition.unless.end(), mark);
    }
  }

  OutputPort& output_of(const PortPlan& port) {
    Node& node = *result_.nodes[task_index_.at(port.node)];
    return *node.outputs()[index_of(node.outputs(), port.port)];
  }

  /// Producers before consumers, so that an input's capacity is known when its node is set up; in a cycle, file order.
  /// Requests make no cycle: the runtime reads them, and no node takes memory for them.
  std::vector<size_t> setup_order() const {
    std::vector<size_t> order;
    std::vector<char> done(result_.plan.tasks.size(), 0);
    const auto ready = [&](const TaskPlan& task) {
      return std::all_of(task.edges.begin(), task.edges.end(), [&](const EdgePlan& edge) {
        return task.node->inputs()[edge.input] == task.node->control() ||
               done[task_index_.at(result_.plan.ports[edge.port].node)] != 0;
      });
    };
    while (order.size() < result_.plan.tasks.size()) {
      size_t next = kNone;
      for (size_t t = 0; t < done.size(); ++t) {
        if (done[t]) continue;
        if (ready(result_.plan.tasks[t])) {
          next = t;
          break;
        }
        if (next == kNone) next = t;
      }
      done[next] = 1;
      order.push_back(next);
    }
    return order;
  }

  tl::expected<void, ComposeError> set_up() {
    ComposeError error;
    std::vector<SetUp> states(result_.plan.tasks.size(), SetUp::not_yet);
    for (const size_t t : setup_order())
      states[t] = !owns(result_.plan.tasks[t].name) || set_up_node(t, states, error) ? SetUp::done : SetUp::failed;
    // Without a problem of its own where what failed belongs to another process, which tells it.
    if (std::find(states.begin(), states.end(), SetUp::failed) != states.end())
      return tl::make_unexpected(std::move(error));
    return {};
  }

  enum class SetUp : uint8_t { not_yet, done, failed };

  bool set_up_node(size_t t, const std::vector<SetUp>& states, ComposeError& error) {
    TaskPlan& task = result_.plan.tasks[t];
    bool sound = true;
    for (const EdgePlan& edge : task.edges) {
      // In a cycle the producer may come later in the order: then its capacity is not known yet, here as elsewhere.
      const SetUp producer = states[task_index_.at(result_.plan.ports[edge.port].node)];
      InputPort* const input = task.node->inputs()[edge.input];
      const bool requests = input == task.node->control();  // it needs no size of them, and waits for none
      std::optional<Capacity> capacity = Capacity{};
      if (producer == SetUp::done && !requests) capacity = capacity_of(edge.port);
      if (producer == SetUp::failed) capacity.reset();
      PortAccess::connect(*input, capacity.value_or(Capacity{}));
      // What it would say of an input whose sizes nobody knows is no problem of its own.
      sound = sound && (capacity || requests);
    }
    if (sound) sound = call_setup(t, error);
    if (options_.exchange != nullptr) {
      for (const size_t port : task.ports) {
        const OutputPort& output = output_of(result_.plan.ports[port]);
        if (sound) options_.exchange->tell_counts(port, counts_of(output.type(), output.capacity()));
        options_.exchange->tell(port, sound ? std::optional(output.capacity()) : std::nullopt);
      }
    }
    return sound;
  }

  bool call_setup(size_t t, ComposeError& error) {
    TaskPlan& task = result_.plan.tasks[t];
    try {
      give_setup(*task.node, task, t, graph_, clock_, options_, registry_, positions_[t]);
      // Beyond the limit of a control group the kernel kills instead of refusing.
      if (const auto room = machine::memory_room(); room && *room < kLeastRoom) throw std::bad_alloc();
      return true;
    } catch (const std::exception& problem) {
      error.problems.push_back({positions_[t], fmt::format("{}: {}", task.name, machine::explain(problem))});
      error.device_failed = error.device_failed || machine::scarce(problem);
      return false;
    }
  }

  const GraphSpec& graph_;
  const Registry& registry_;
  const Clock& clock_;
  const ComposeOptions options_;
  Composition result_;
  PortIndex port_index_;
  std::map<std::string, size_t> task_index_;
  std::vector<Position> positions_;
};

}  // namespace

std::vector<RemoteNode::Port> remote_ports(const Registry& registry, const RemoteSpec& remote) {
  if (remote.type.empty()) return {};
  const std::unique_ptr<Node> there =
      remote.of_device ? registry.devices.find(remote.type)->shell() : registry.nodes.find(remote.type)->make();
  std::vector<RemoteNode::Port> ports;
  for (const std::string& name : remote.ports) {
    const OutputPort& output = *there->outputs()[index_of(there->outputs(), name)];
    ports.push_back({name, std::string(output.doc()), &output.type()});
  }
  return ports;
}

StampLaw remote_law(const RemoteSpec& remote) {
  if (remote.lag_ns) return {*remote.lag_ns, 0, 0, {}};
  return StampLaw::none("it comes from machine " + remote.machine + ", whose `ages` do not name it");
}

Composition outline(const GraphSpec& graph, const Registry& registry, const Clock& clock) {
  return Composer(graph, registry, clock, {}).outline();
}

std::unique_ptr<Node> make_again(const GraphSpec& graph, const Registry& registry, const Clock& clock,
                                 const ComposeOptions& options, const Plan& plan, size_t t) {
  const TaskPlan& task = plan.tasks[t];
  const auto spec =
      std::find_if(graph.nodes.begin(), graph.nodes.end(), [&](const NodeSpec& node) { return node.id == task.name; });
  if (spec == graph.nodes.end()) throw SetupError(task.name + " is no node of the graph");
  std::unique_ptr<Node> node = make_node(*spec, registry.nodes, task.node->state() != nullptr);
  for (size_t i = 0; i < node->outputs().size(); ++i)
    if (task.node->outputs()[i]->connected()) PortAccess::mark_read(*node->outputs()[i]);
  for (size_t i = 0; i < node->inputs().size(); ++i)
    if (const InputPort& before = *task.node->inputs()[i]; before.connected())
      PortAccess::connect(*node->inputs()[i], before.capacity());
  give_setup(*node, task, t, graph, clock, options, registry, spec->position);
  return node;
}

void complete(Plan& plan, FactExchange& exchange, const Observers& observers) {
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    if (plan.tasks[t].device) plan.tasks[t].source = exchange.wait_for_source(t);
  for (size_t p = 0; p < plan.ports.size(); ++p) {
    plan.ports[p].capacity = exchange.wait_for(p).value_or(Capacity{});
    if (plan.ports[p].counts) plan.ports[p].counts = exchange.counts(p);
  }
  size_ports(plan, observers);
}

tl::expected<Composition, ComposeError> compose(const GraphSpec& graph, const Registry& registry,
                                                const DeviceFactory& make_device, const Clock& clock,
                                                const ComposeOptions& options) {
  return Composer(graph, registry, clock, options).compose(make_device);
}

}  // namespace takt::graph
