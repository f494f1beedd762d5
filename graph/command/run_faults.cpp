// SPDX-License-Identifier: Apache-2.0
#include "graph/command/run_faults.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>

#include "graph/command/prepare.hpp"

namespace takt::command {

int RunFaults::load(const graph::GraphSpec& graph, const Clock& clock) {
  if (!wanted()) return kOk;
  const graph::Composition outline = graph::outline(graph, graph::node_types(), clock);
  graph::RunKind kind;
  kind.virtual_time = clock.is_virtual();
  kind.iceoryx = options_.transport == "iceoryx";
  kind.records = !options_.record.empty();
  auto loaded = graph::load_scenario(options_.faults, graph, outline.plan, kind);
  for (const auto& problem : loaded.problems) std::fprintf(stderr, "%s\n", graph::to_string(problem).c_str());
  if (!loaded.scenario) {
    tell_problems(loaded.problems.size());
    return kBadInput;
  }
  if (const auto failures = graph::device_failures(*loaded.scenario); !failures.empty())
    return refuse(
        "--faults: no driver of this build can be told to fail; take the fault of " + failures[0].device + " out",
        kBadInput);
  injection_ = std::make_unique<graph::Injection>(std::move(*loaded.scenario), graph);
  return kOk;
}

void RunFaults::make_room(Plan& plan) const {
  if (injection_) injection_->make_room(plan);
}

std::unique_ptr<Transport> RunFaults::inject(std::unique_ptr<Transport> transport, Plan& plan, const Clock& clock,
                                             RunBoard& board, RunRecord& record) {
  if (!injection_) return transport;
  injection_->disturb(plan, clock, board.epoch_ns());
  record.on_disk([this, &clock, &board](mcap::Sink& file) { return injection_->disk(file, clock, board.epoch_ns()); });
  return injection_->wrap(std::move(transport), plan, clock, board.epoch_ns());
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
  health_.emplace(plan, board);
  if (clock.is_virtual()) return;
  injection_->begin_loads(board.epoch_ns());
  looking_ = std::jthread([this](const std::stop_token& stop) {
    std::mutex mutex;
    std::condition_variable_any ending;
    std::unique_lock lock(mutex);
    while (!stop.stop_requested()) {
      look();
      ending.wait_for(lock, stop, std::chrono::nanoseconds(graph::HealthWatch::kPeriod_ns), [] { return false; });
    }
  });
}

void RunFaults::look() {
  if (health_) health_->look(clock_->now_ns(), board_->epoch_ns().load());
}

void RunFaults::end() {
  if (!injection_) return;
  if (looking_.joinable()) {
    looking_.request_stop();
    looking_.join();
  }
  injection_->end_loads();
}

void RunFaults::judge(const RunResult& result, const RunBoard& board, int exit, nlohmann::ordered_json& report) const {
  if (!injection_) return;
  graph::RunEvents events;
  events.struck = injection_->struck();
  events.struck_nodes = injection_->struck_nodes();
  events.unwell = health_->unwell();
  events.end_ns = result.end_ns - result.epoch_ns;
  events.exit = exit;
  events.unaccounted = injection_->unaccounted([&](size_t port) { return board.port(port).writer.sent; });
  for (const graph::ProcessStrike& strike : injection_->process_strikes())  // there are some in virtual time only
    if (strike.at_ns < events.end_ns)
      events.restarts.push_back({strike.process, strike.at_ns, strike.at_ns + strike.for_ns});
  const graph::Scenario& scenario = injection_->scenario();
  report["scenario"] = graph::scenario_json(scenario, events, graph::verdict(scenario, report, events));
}

int RunFaults::exit_code(int told, const nlohmann::ordered_json& report) const {
  if (!injection_ || told == kBadInput) return told;  // a file that could not be written
  return report["scenario"]["met"].get<bool>() ? kOk : kNotOk;
}

}  // namespace takt::command
