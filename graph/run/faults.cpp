// SPDX-License-Identifier: Apache-2.0
#include "graph/run/faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "graph/run/prepare.hpp"

namespace takt::command {

namespace {

/// Writes the failures of devices into their settings, as simulated devices and doubles read them.
int fail_devices(const hal::DeviceTypes& types, const graph::Scenario& scenario, graph::GraphSpec& graph) {
  for (const graph::DeviceFailure& failure : graph::device_failures(scenario)) {
    const auto device = std::find_if(graph.devices.begin(), graph.devices.end(),
                                     [&](const graph::DeviceSpec& d) { return d.id == failure.device; });
    if (!types.find(device->kind)->takes(device->driver, "failures"))
      return refuse(fmt::format("--faults: device {} has the driver {}, which cannot be told to fail; `sim` and "
                                "`double` can",
                                failure.device, device->driver),
                    kBadInput);
    // Beyond any run, and still a time that can be added to.
    constexpr int64_t kNever = 1'000'000'000LL * 86'400 * 365;
    const std::string more = fmt::format("{} {}ms..{}ms", graph::info(failure.kind).name, failure.from_ns / 1'000'000,
                                         std::min(failure.to_ns, kNever) / 1'000'000);
    const std::string had = device->settings.value("failures", "");
    device->settings["failures"] = had.empty() ? more : had + ", " + more;
  }
  return kOk;
}

/// How often that device was found to be lost; where it never was for long enough, its jobs without a result.
uint64_t losses_of(const std::vector<TaskPlan>& tasks, const std::string& device, const RunBoard& board) {
  for (size_t t = 0; t < tasks.size(); ++t) {
    if (tasks[t].name != device) continue;
    const uint64_t losses = board.source(t).losses.load();
    return losses > 0 ? losses : board.task(t).no_result.load();
  }
  return 0;
}

std::vector<graph::Restart> restarts_of(const OutageLog& outages, const std::vector<std::string>& processes,
                                        const RunResult& result) {
  std::vector<graph::Restart> restarts;
  for (const Outage& outage : outages.in_order()) {
    const int64_t back_ns = outage.back_ns > 0 ? outage.back_ns : result.end_ns;
    restarts.push_back({processes[outage.process], outage.from_ns - result.epoch_ns, back_ns - result.epoch_ns});
  }
  return restarts;
}

}  // namespace

int RunFaults::load(graph::GraphSpec& graph, const Clock& clock, bool processes) {
  if (!wanted()) return kOk;
  const graph::Composition outline = graph::outline(graph, registry_, clock);
  graph::RunKind kind;
  kind.virtual_time = clock.is_virtual();
  kind.processes = processes;
  kind.iceoryx = options_.transport == "iceoryx";
  kind.records = !options_.record.empty();
  auto loaded = graph::load_scenario(options_.faults, graph, outline.plan, kind);
  for (const auto& problem : loaded.problems) std::fprintf(stderr, "%s\n", graph::to_string(problem).c_str());
  if (!loaded.scenario) {
    tell_problems(loaded.problems.size());
    return kBadInput;
  }
  if (const int code = fail_devices(registry_.devices, *loaded.scenario, graph); code != kOk) return code;
  injection_ =
      std::make_unique<graph::Injection>(std::move(*loaded.scenario), graph, outline.plan.ports.size(), processes);
  return kOk;
}

void RunFaults::make_room(Plan& plan) const {
  if (injection_) injection_->make_room(plan);
}

std::unique_ptr<Transport> RunFaults::inject(std::unique_ptr<Transport> transport, Plan& plan, const Clock& clock,
                                             RunBoard& board) {
  if (!injection_) return transport;
  injection_->disturb(plan, clock, board.epoch_ns());
  return injection_->wrap(std::move(transport), plan, clock, board.epoch_ns());
}

void RunFaults::disturb_disk(RunRecord& record, const Clock& clock, RunBoard& board) {
  if (!injection_) return;
  record.on_disk([this, &clock = record.disk_clock(clock), &board](mcap::Sink& file) {
    return injection_->disk(file, clock, board.epoch_ns());
  });
}

std::vector<graph::ProcessStrike> RunFaults::due(int64_t now_ns) {
  if (!injection_ || board_ == nullptr) return {};
  const int64_t epoch_ns = board_->epoch_ns().load();
  std::vector<graph::ProcessStrike> due = injection_->due(now_ns - epoch_ns);
  if (!std::exchange(asked_, true)) {  // a supervisor that took another one's place
    constexpr int64_t kPast_ns = 500'000'000;
    std::erase_if(due, [&](const graph::ProcessStrike& s) { return s.at_ns < now_ns - epoch_ns - kPast_ns; });
  }
  return due;
}

std::function<int64_t(size_t, uint64_t)> RunFaults::durations(std::function<int64_t(size_t, uint64_t)> inner,
                                                              const Plan& plan) const {
  return injection_ ? injection_->durations(std::move(inner), plan) : inner;
}

RunFaults::Active::Active(RunFaults& faults, const Plan& plan, const Clock& clock, RunBoard& board) : faults_(faults) {
  faults_.begin(plan, clock, board);
}

RunFaults::Active::~Active() { faults_.end(); }

void RunFaults::begin(const Plan& plan, const Clock& clock, RunBoard& board) {
  if (!injection_) return;
  clock_ = &clock;
  board_ = &board;
  plan_ = &plan;
  health_.emplace(plan, board);
  if (clock.is_virtual()) return;
  injection_->begin_loads(board.epoch_ns());
  looking_.emplace(std::chrono::nanoseconds(graph::HealthWatch::kPeriod_ns), [this] { look(); });
}

void RunFaults::look() {
  if (health_) health_->look(clock_->now_ns(), board_->epoch_ns().load());
}

void RunFaults::end() {
  if (!injection_) return;
  looking_.reset();
  injection_->end_loads();
}

void RunFaults::judge(const RunResult& result, const RunBoard& board, int exit,
                      const std::vector<std::string>& processes, nlohmann::ordered_json& report) const {
  if (!injection_) return;
  graph::RunEvents events;
  events.struck = injection_->struck();
  for (size_t f = 0; f < injection_->scenario().faults.size(); ++f) {
    const graph::FaultSpec& fault = injection_->scenario().faults[f];
    if (graph::info(fault.kind).target == graph::FaultTarget::device)
      events.struck[f] = losses_of(plan_->tasks, fault.target, board);
  }
  events.struck_nodes = injection_->struck_nodes();
  events.unwell = health_->unwell();
  events.end_ns = result.end_ns - result.epoch_ns;
  events.exit = exit;
  events.unaccounted = injection_->unaccounted([&](size_t port) { return board.port(port).writer.sent; });
  events.restarts = restarts_of(board.outages(), processes, result);
  for (const graph::ProcessStrike& strike : injection_->process_strikes())
    if (clock_->is_virtual() && strike.at_ns < events.end_ns)  // where a process only seems to be gone
      events.restarts.push_back({strike.process, strike.at_ns, strike.at_ns + strike.for_ns});
  const graph::Scenario& scenario = injection_->scenario();
  report["scenario"] = graph::scenario_json(scenario, events, graph::verdict(scenario, report, events));
}

int RunFaults::exit_code(int told, const nlohmann::ordered_json& report) const {
  if (!injection_ || told == kBadInput) return told;
  return report["scenario"]["met"].get<bool>() ? kOk : kNotOk;
}

}  // namespace takt::command
