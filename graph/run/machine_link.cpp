// SPDX-License-Identifier: Apache-2.0
#include "graph/run/machine_link.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "graph/attach/follow.hpp"
#include "graph/compose/composition.hpp"
#include "graph/log/log_content.hpp"
#include "graph/log/recorded_plan.hpp"
#include "rt/abi.hpp"
#include "rt/record/message_record.hpp"
#include "rt/sched/grant.hpp"

namespace takt::command {
namespace {

/// Of all that must be the same on each machine: program, graph with all its files, schedule, profile and settings.
std::string same_everywhere(const graph::GraphSpec& graph, const std::vector<std::string>& set) {
  std::string all = fmt::format("{} {} {}", version().commit, graph.profile, fmt::join(set, " "));
  for (const std::string& file : graph.files) all += log::file_text(file);
  all += log::file_text(graph.schedule.file);
  return fmt::format("{:016x}", record::hash_of(std::as_bytes(std::span(all.data(), all.size()))));
}

std::optional<int64_t> age_of(const graph::GraphSpec& graph, const graph::PortName& port) {
  for (const graph::MachineSpec& machine : graph.machines)
    if (const auto age = machine.ages.find(port.text()); age != machine.ages.end()) return age->second;
  return std::nullopt;
}

std::function<std::optional<Capacity>()> told(RunBoard& board, size_t port) {
  return [&record = board.capacity(port)]() -> std::optional<Capacity> {
    if (record.known.load(std::memory_order_acquire) != CapacityRecord::kTold) return std::nullopt;
    return record.capacity;
  };
}

}  // namespace

std::unique_ptr<machines::Link> make_link(const graph::GraphSpec& graph, const Registry& registry,
                                          const std::vector<std::string>& set, RunBoard& board, const Clock& clock) {
  const graph::Composition outline = graph::outline(graph, registry, clock);
  machines::Link::Options options{graph.name,
                                  graph.machine,
                                  same_everywhere(graph, set),
                                  {},
                                  graph.network.latency_ns,
                                  graph.network.clock_error_ns,
                                  [](const std::string& line) { std::fprintf(stderr, "takt: %s\n", line.c_str()); }};
  machines::WireOptions wire{"", graph.network.domain, graph.network.keys, options.say};
  for (const graph::MachineSpec& machine : graph.machines) {
    if (machine.name == graph.machine) wire.address = machine.address;
    else options.peers.push_back(machine.name);
  }
  std::vector<machines::Link::ImportName> imports;
  for (const graph::DeviceSpec& device : graph.devices)
    for (const std::string& port : device.remote ? device.remote->ports : std::vector<std::string>())
      imports.push_back({device.remote->machine, device.id + "." + port,
                         told(board, *attach::find_port(outline.plan, device.id + "." + port))});
  std::vector<machines::Link::Export> exports;
  for (const graph::PortName& port : graph.exported)
    exports.push_back({port.text(), told(board, *attach::find_port(outline.plan, port.text())), age_of(graph, port)});
  return std::make_unique<machines::Link>(std::move(options), imports, std::move(exports),
                                          machines::make_dds_wire(wire), clock);
}

void lift_other_threads() {
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task"))
    if (const int id = std::atoi(thread.path().filename().c_str()); id != gettid()) lift_thread(id, kLowestPriority);
}

void begin(machines::Link& link, const graph::GraphSpec& graph, const Plan& plan, Transport& transport) {
  std::vector<machines::Link::Outgoing> outgoing;
  for (const graph::PortName& port : graph.exported) {
    const size_t p = *attach::find_port(plan, port.text());
    outgoing.push_back({plan.ports[p].type, transport.make_reader(p)});
  }
  link.begin(std::move(outgoing));
}

}  // namespace takt::command
