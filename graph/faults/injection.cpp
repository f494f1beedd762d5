// SPDX-License-Identifier: Apache-2.0
#include "graph/faults/injection.hpp"

#include <algorithm>
#include <thread>

namespace takt::graph {
namespace {

using faults::MessageFault;
using faults::MessageFaultKind;

/// Of the kinds up to exhausted_pool, in their order.
MessageFaultKind message_kind(FaultKind kind) {
  static_assert(static_cast<int>(FaultKind::exhausted_pool) == static_cast<int>(MessageFaultKind::exhaust));
  static_assert(static_cast<int>(FaultKind::clock_step) == static_cast<int>(MessageFaultKind::clock_step));
  return static_cast<MessageFaultKind>(kind);
}

size_t port_of(const Plan& plan, const std::string& output) {
  for (size_t p = 0; p < plan.ports.size(); ++p)
    if (plan.ports[p].node + "." + plan.ports[p].port == output) return p;
  return kNone;
}

/// Those that the plan has: a mode may have left out the node.
std::vector<MessageFault> message_faults(const Scenario& scenario, const Plan& plan) {
  std::vector<MessageFault> all;
  for (size_t f = 0; f < scenario.faults.size(); ++f) {
    const FaultSpec& spec = scenario.faults[f];
    if (!strikes_messages(spec.kind)) continue;
    MessageFault fault;
    fault.kind = message_kind(spec.kind);
    fault.port = port_of(plan, spec.target);
    fault.from_ns = spec.from_ns;
    fault.to_ns = spec.to_ns;
    fault.probability = spec.probability;
    fault.by_ns = spec.by_ns;
    fault.seed = faults::mixed(scenario.seed, f, 0);
    all.push_back(fault);
  }
  return all;
}

/// Indexes into Scenario::faults.
std::vector<size_t> faults_of_messages(const Scenario& scenario) {
  std::vector<size_t> indexes;
  for (size_t f = 0; f < scenario.faults.size(); ++f)
    if (strikes_messages(scenario.faults[f].kind)) indexes.push_back(f);
  return indexes;
}

}  // namespace

Injection::Injection(Scenario scenario, const GraphSpec& graph, size_t ports, bool processes)
    : scenario_(std::move(scenario)),
      graph_(graph),
      processes_(processes),
      message_faults_(faults_of_messages(scenario_)),
      counts_(scenario_.faults.size(), message_faults_.size(), ports) {
  plan_process_strikes();
  for (const FaultSpec& fault : scenario_.faults)
    for (const std::string& node : nodes_of(fault))
      if (std::find(struck_nodes_.begin(), struck_nodes_.end(), node) == struck_nodes_.end())
        struck_nodes_.push_back(node);
}

Injection::~Injection() = default;

void Injection::plan_process_strikes() {
  const std::vector<std::string> all = processes_of(graph_);
  for (size_t f = 0; f < scenario_.faults.size(); ++f) {
    const FaultSpec& fault = scenario_.faults[f];
    if (!strikes_processes(fault.kind)) continue;
    uint64_t number = 0;
    uint32_t turn = 0;
    const auto add = [&](int64_t at_ns) {
      const bool any = fault.target == "any";
      const std::string at_step = fault.reader.empty() ? fault.target.substr(0, fault.target.find('.')) : fault.reader;
      const std::string process = any ? all[faults::mixed(scenario_.seed, f, number++) % all.size()]
                                      : process_of(graph_, fault.step == MessageStep::none ? fault.target : at_step);
      strikes_.push_back({fault.kind, process, at_ns, fault.for_ns, f, fault.step,
                          fault.step == MessageStep::none ? std::string() : fault.target, turn++ % kInstantsOfStep});
    };
    if (fault.every_ns == 0) add(fault.at_ns);
    else
      for (int64_t at = fault.from_ns; at < fault.to_ns; at += fault.every_ns) add(at);
  }
  std::stable_sort(strikes_.begin(), strikes_.end(),
                   [](const ProcessStrike& a, const ProcessStrike& b) { return a.at_ns < b.at_ns; });
}

void Injection::add_all_of(const std::string& process, std::vector<std::string>& nodes) const {
  for (const NodeSpec& node : graph_.nodes)
    if (node.subsystem == process) nodes.push_back(node.id);
  for (const DeviceSpec& device : graph_.devices)
    if (process_of(graph_, device.id) == process) nodes.push_back(device.id);
}

void Injection::add_all_struck_by(const FaultSpec& fault, std::vector<std::string>& nodes) const {
  for (const ProcessStrike& strike : strikes_)
    if (&scenario_.faults[strike.fault] == &fault) add_all_of(strike.process, nodes);
}

std::vector<std::string> Injection::nodes_of(const FaultSpec& fault) const {
  std::vector<std::string> nodes;
  switch (info(fault.kind).target) {
    case FaultTarget::none: break;
    case FaultTarget::output:
      add_all_struck_by(fault, nodes);  // at a step of its messages
      if (fault.kind == FaultKind::exhausted_pool) nodes.push_back(fault.target.substr(0, fault.target.find('.')));
      break;
    case FaultTarget::node:
    case FaultTarget::device:
      if (fault.kind == FaultKind::hang && processes_) add_all_of(process_of(graph_, fault.target), nodes);
      else nodes.push_back(fault.target);
      break;
    case FaultTarget::process: add_all_struck_by(fault, nodes);
  }
  return nodes;
}

void Injection::make_room(Plan& plan) {
  std::vector<double> rates(plan.ports.size());
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    for (const size_t port : plan.tasks[t].ports) rates[port] = effective_rate_hz(plan, t);
  std::vector<MessageFault> known = message_faults(scenario_, plan);
  ports_.clear();
  for (const MessageFault& fault : known) ports_.push_back(fault.port);
  std::erase_if(known, [&](const MessageFault& fault) { return fault.port >= plan.ports.size(); });
  faults::make_room(plan.ports, known, rates);
}

void Injection::disturb(Plan& plan, const Clock& clock, const std::atomic<int64_t>& epoch_ns) {
  using faults::NodeFault;
  using faults::NodeFaultKind;
  std::map<size_t, std::pair<std::vector<NodeFault>, std::vector<std::atomic<uint64_t>*>>> by_task;
  const auto add = [&](size_t task, size_t f, NodeFaultKind kind, int64_t from_ns, int64_t to_ns, int64_t by_ns) {
    by_task[task].first.push_back({kind, task, from_ns, to_ns, by_ns});
    by_task[task].second.push_back(&counts_.faults()[f]);
  };
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    for (size_t f = 0; f < scenario_.faults.size(); ++f) {
      const FaultSpec& fault = scenario_.faults[f];
      if (fault.target != plan.tasks[t].name) continue;
      if (fault.kind == FaultKind::slow_consumer)
        add(t, f, NodeFaultKind::slow, fault.from_ns, fault.to_ns, fault.by_ns);
      if (fault.kind == FaultKind::hang)
        add(t, f, NodeFaultKind::hang, fault.at_ns, faults::kForever,
            fault.for_ns > 0 ? fault.for_ns : faults::kForever);
    }
    for (const ProcessStrike& strike : strikes_)
      if (clock.is_virtual() && strike.process == process_of(graph_, plan.tasks[t].name))
        add(t, strike.fault, NodeFaultKind::absent, strike.at_ns, strike.at_ns + strike.for_ns, 0);
  }
  for (auto& [task, list] : by_task) {
    node_faults_[task] =
        std::make_unique<faults::NodeFaults>(std::move(list.first), clock, epoch_ns, std::move(list.second));
    plan.tasks[task].disturbance = node_faults_[task].get();
  }
}

std::unique_ptr<Transport> Injection::wrap(std::unique_ptr<Transport> transport, const Plan& plan, const Clock& clock,
                                           const std::atomic<int64_t>& epoch_ns) {
  if (message_faults_.empty()) return transport;
  std::vector<MessageFault> all = message_faults(scenario_, plan);
  return std::make_unique<faults::FaultyTransport>(std::move(transport), plan.ports, std::move(all), clock, epoch_ns,
                                                   counts_.messages(), counts_.offered());
}

std::function<int64_t(size_t, uint64_t)> Injection::durations(std::function<int64_t(size_t, uint64_t)> inner,
                                                              const Plan& plan) const {
  if (node_faults_.empty()) return inner;
  return [this, inner = std::move(inner), &plan](size_t task, uint64_t job) {
    const auto disturbed = node_faults_.find(task);
    const int64_t extra = disturbed == node_faults_.end() ? 0 : disturbed->second->extra_ns();
    return extra + (inner ? inner(task, job) : plan.tasks[task].budget_ns);
  };
}

std::unique_ptr<mcap::Sink> Injection::disk(mcap::Sink& inner, const Clock& clock,
                                            const std::atomic<int64_t>& epoch_ns) {
  std::vector<record::DiskFault> disks;
  std::vector<std::atomic<uint64_t>*> struck;
  for (size_t f = 0; f < scenario_.faults.size(); ++f) {
    const FaultSpec& fault = scenario_.faults[f];
    if (fault.kind != FaultKind::slow_disk && fault.kind != FaultKind::full_disk) continue;
    record::DiskFault disk;
    disk.from_ns = fault.from_ns;
    disk.to_ns = fault.to_ns;
    if (fault.kind == FaultKind::slow_disk) disk.bytes_per_s = fault.bytes_per_s;
    else disk.room_bytes = fault.bytes;
    disks.push_back(disk);
    struck.push_back(&counts_.faults()[f]);
  }
  if (disks.empty()) return nullptr;
  const auto wait = [](int64_t ns) { std::this_thread::sleep_for(std::chrono::nanoseconds(ns)); };
  return std::make_unique<record::FaultySink>(inner, std::move(disks), clock, epoch_ns, std::move(struck), wait);
}

void Injection::begin_loads(const std::atomic<int64_t>& epoch_ns) {
  std::vector<faults::LoadFault> loads;
  std::vector<faults::LoadCount*> struck;
  for (size_t f = 0; f < scenario_.faults.size(); ++f) {
    const FaultSpec& fault = scenario_.faults[f];
    if (fault.kind != FaultKind::cpu_hog && fault.kind != FaultKind::memory_hog) continue;
    faults::LoadFault load;
    load.kind = fault.kind == FaultKind::cpu_hog ? faults::LoadFault::Kind::cpu : faults::LoadFault::Kind::memory;
    load.from_ns = fault.from_ns;
    load.to_ns = fault.to_ns;
    load.threads = fault.threads;
    load.fixed_priority = fault.fixed_policy;
    load.bytes = fault.bytes;
    loads.push_back(load);
    struck.push_back(&counts_.faults()[f]);
  }
  if (!loads.empty()) loads_ = std::make_unique<faults::Loads>(std::move(loads), epoch_ns, std::move(struck));
}

std::vector<ProcessStrike> Injection::due(int64_t until_ns) {
  std::vector<ProcessStrike> due;
  while (given_ < strikes_.size() && strikes_[given_].at_ns < until_ns) due.push_back(strikes_[given_++]);
  return due;
}

std::vector<uint64_t> Injection::struck() const {
  std::vector<uint64_t> counts;
  for (const auto& count : counts_.faults()) counts.push_back(count.load());
  for (size_t m = 0; m < message_faults_.size(); ++m) counts[message_faults_[m]] += counts_.messages()[m].struck.load();
  return counts;
}

uint64_t Injection::unaccounted(const std::function<uint64_t(size_t port)>& sent) const {
  std::map<size_t, std::pair<uint64_t, uint64_t>> balance;  // by port: came, went
  for (size_t m = 0; m < ports_.size(); ++m) {
    if (ports_[m] == kNone) continue;
    balance.try_emplace(ports_[m], counts_.offered()[ports_[m]].load(), sent(ports_[m]));
    balance[ports_[m]].first += counts_.messages()[m].added.load();
    balance[ports_[m]].second += counts_.messages()[m].withheld.load();
  }
  uint64_t messages = 0;
  for (const auto& [port, sides] : balance) {
    const auto [came, went] = sides;
    messages += came > went ? came - went : went - came;
  }
  return messages;
}

}  // namespace takt::graph
