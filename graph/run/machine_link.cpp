// SPDX-License-Identifier: Apache-2.0
#include "graph/run/machine_link.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "graph/attach/endpoint.hpp"
#include "graph/attach/follow.hpp"
#include "graph/compose/composition.hpp"
#include "graph/log/log_content.hpp"
#include "graph/log/recorded_plan.hpp"
#include "rt/abi.hpp"
#include "rt/record/message_record.hpp"
#include "rt/sched/grant.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;
constexpr auto kLook = std::chrono::milliseconds(100);

/// Of all that must be the same on each machine: program, graph with all its files, schedule, profile and settings.
std::string same_everywhere(const graph::GraphSpec& graph, const std::vector<std::string>& set) {
  std::string all = fmt::format("{} {} {}", version().commit, graph.profile, fmt::join(set, " "));
  for (const std::string& file : graph.files) all += log::file_text(file);
  all += log::file_text(graph.schedule.file);
  return fmt::format("{:016x}", record::hash_of(std::as_bytes(std::span(all.data(), all.size()))));
}

/// What others are told of this run.
Json told_of(const Plan& plan, const RunBoard& board) {
  uint64_t misses = 0, high_misses = 0;
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const uint64_t of_task = board.task(t).deadline_misses.load();
    misses += of_task;
    if (plan.tasks[t].criticality == Criticality::high) high_misses += of_task;
  }
  const uint32_t mode = board.modes().newest();
  return {{"mode", mode < plan.modes.size() ? plan.modes[mode].name : plan.mode},
          {"misses", misses},
          {"high_misses", high_misses}};
}

/// Of this machine's run to the question of another machine.
Json answer_of(int run, const Json& question) {
  constexpr std::array kTaken{"top", "get", "set", "forget", "fault", "mark", "mode", "stop"};
  const std::string what = question.is_object() ? question.value("do", "") : "";
  if (std::find(kTaken.begin(), kTaken.end(), what) == kTaken.end())
    return {{"error", fmt::format("of other machines these are answered: {}", fmt::join(kTaken, ", "))}};
  auto connection = attach::connect_to(run);
  const auto answer = connection && connection->write(question) ? connection->read_line() : std::nullopt;
  return answer ? *answer : Json{{"error", "its run does not answer"}};
}

std::function<std::optional<Capacity>()> told(RunBoard& board, size_t port) {
  return [&record = board.capacity(port)]() -> std::optional<Capacity> {
    if (record.known.load(std::memory_order_acquire) != CapacityRecord::kTold) return std::nullopt;
    return record.capacity;
  };
}

}  // namespace

std::unique_ptr<machines::Link> make_link(const graph::GraphSpec& graph, const Registry& registry,
                                          const std::vector<std::string>& set, RunBoard& board, int run,
                                          const Clock& clock) {
  const auto composed = std::make_shared<const graph::Composition>(graph::outline(graph, registry, clock));
  const graph::Composition& outline = *composed;
  machines::Link::Options options{graph.name,
                                  graph.machine,
                                  same_everywhere(graph, set),
                                  {},
                                  graph.network.latency_ns,
                                  graph.network.clock_error_ns,
                                  [](const std::string& line) { std::fprintf(stderr, "takt: %s\n", line.c_str()); }};
  options.tells = [composed, &board] { return told_of(composed->plan, board); };
  if (graph.network.trusted || !graph.network.keys.empty())
    options.answer = [run](const Json& question) { return answer_of(run, question); };
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
  const graph::MachineSpec& own = *std::find_if(graph.machines.begin(), graph.machines.end(),
                                                [&](const auto& machine) { return machine.name == graph.machine; });
  for (const graph::PortName& port : graph.exported) {
    exports.push_back({port.text(), told(board, *attach::find_port(outline.plan, port.text()))});
    auto& one = exports.back();
    if (const auto age = own.ages.find(port.text()); age != own.ages.end()) one.age_ns = age->second;
    if (const auto wire = own.wire.find(port.text()); wire != own.wire.end())
      one.coding = *machines::coding_of(wire->second);
  }
  return std::make_unique<machines::Link>(std::move(options), imports, std::move(exports),
                                          machines::make_dds_wire(wire), board.published(), clock);
}

Courier::Courier(machines::Link& link, int run) {
  thread_ = OwnThread([&link, run](const std::stop_token& end) {
    pthread_setname_np(pthread_self(), "takt-courier");
    while (!end.stop_requested()) {
      std::this_thread::sleep_for(kLook);
      auto connection = attach::connect_to(run);  // nobody listens before the start
      if (!connection || !connection->write({{"do", "carry"}})) continue;
      while (!end.stop_requested() && !connection->gone()) {
        if (!connection->readable(static_cast<int>(kLook.count()))) continue;
        const auto question = connection->read_line();
        if (!question || !connection->write(link.ask(question->value("machine", ""), *question))) break;
      }
    }
  });
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
