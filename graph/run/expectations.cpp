// SPDX-License-Identifier: Apache-2.0
#include "graph/run/expectations.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "graph/expect/figures.hpp"
#include "graph/run/prepare.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

/// Far less than the time whose messages the ports keep for a follower (observers()).
constexpr std::chrono::milliseconds kPeriod{5};

/// Devices that were lost where the graph says which modes that leads to: what they did meanwhile is no surprise.
std::vector<std::string> lost_devices(const Json& report) {
  std::vector<std::string> lost;
  for (const Json& device : report["devices"])
    if (device["losses"].get<uint64_t>() > 0) lost.push_back(device["name"].get<std::string>());
  return lost;
}

}  // namespace

int RunExpectations::bind(graph::WorldTruth world) {
  if (!wanted()) return kOk;
  world_ = std::move(world);
  std::vector<graph::Problem> problems = graph::unknown_objects(*graph_.expect, world_);
  for (graph::Problem& problem : problems) {
    if (world_.objects.empty())
      problem.text =
          "a condition on the simulated world needs one, in the process that judges it: with devices whose "
          "driver is sim, and --isolate none";
    std::fprintf(stderr, "%s\n", graph::to_string(problem).c_str());
  }
  if (!problems.empty()) tell_problems(problems.size());
  return problems.empty() ? kOk : kBadInput;
}

RunExpectations::Active::Active(RunExpectations& expectations, const Plan& plan, const Clock& clock, RunBoard& board,
                                Transport& transport)
    : expectations_(expectations) {
  if (!expectations_.wanted()) return;
  expectations_.clock_ = &clock;
  expectations_.board_ = &board;
  expectations_.watch_.emplace(*expectations_.graph_.expect, plan, transport, expectations_.world_);
  if (!clock.is_virtual()) expectations_.looking_.emplace(kPeriod, [this] { expectations_.look(); });
}

RunExpectations::Active::~Active() {
  if (!expectations_.wanted()) return;
  expectations_.looking_.reset();
  expectations_.look();
  expectations_.findings_ = expectations_.watch_->findings();
  expectations_.watch_.reset();
}

void RunExpectations::look() {
  if (!watch_ || decided_) return;
  const int64_t now_ns = clock_->now_ns(), epoch_ns = board_->epoch_ns().load();
  if (epoch_ns == 0) return;  // not known yet
  if (now_ns >= board_->stop().end_ns()) return watch_->look_at_messages(epoch_ns);
  watch_->look(now_ns, epoch_ns);
  decided_ = watch_->decided(now_ns, epoch_ns);
  if (decided_) board_->stop().raise(now_ns);
}

void RunExpectations::judge(Json& report) const {
  if (!wanted()) return;
  std::vector<graph::Finding> findings = findings_;
  const auto add = [&](std::vector<graph::Finding> more) { findings.insert(findings.end(), more.begin(), more.end()); };
  const graph::FigureExpectations& figures = graph_.expect->figures;
  add(graph::figure_findings(figures, report));
  // With a fault scenario that one says who keeps which promise.
  if (options_.faults.empty())
    add(graph::promise_findings(figures, report,
                                figures.modes.empty() ? std::vector<std::string>{} : lost_devices(report)));
  report["expectations"] = {{"within_s", static_cast<double>(graph_.expect->within_ns) / 1e9},
                            {"conditions", graph::findings_json(findings)},
                            {"met", graph::all_met(findings)}};
}

int RunExpectations::exit_code(int told, const Json& report) const {
  if (!wanted() || told == kBadInput || told == kDeviceOrSystem) return told;
  if (!options_.faults.empty() && told != kOk) return told;  // the scenario was not met
  return report["expectations"]["met"].get<bool>() ? kOk : kNotOk;
}

}  // namespace takt::command
