// SPDX-License-Identifier: Apache-2.0
#include "graph/command/profile_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "graph/check/figures_file.hpp"
#include "graph/check/measured.hpp"
#include "graph/command/profile.hpp"
#include "graph/language/edit_schedule.hpp"
#include "graph/run/prepare.hpp"
#include "graph/run/support.hpp"
#include "rt/sched/executor.hpp"

namespace takt::command {
namespace {

struct Profile {
  graph::ScheduleSpec schedule;
  Policy policy = Policy::cooperative;  ///< granted to the pass with all nodes together
  std::vector<NodeProfile> nodes;
};

/// What is measured must neither be thrown away nor made smaller.
void let_jobs_finish(Plan& plan) {
  for (TaskPlan& task : plan.tasks) {
    task.on_overrun = OnOverrun::proceed;
    task.on_miss = OnMiss::proceed;
  }
}

void alone(Plan& plan) {
  plan.policy = Policy::cooperative;
  if (plan.cores.size() > 1) plan.cores = {plan.cores.front()};
}

/// Budgets that do not throttle: what the largest job alone took, and a half more.
void unthrottled(Plan& plan, const std::vector<NodeProfile>& nodes) {
  if (plan.tasks.size() != nodes.size()) throw std::invalid_argument("the graph was changed meanwhile; measure again");
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const int64_t seen = nodes[t].alone.max_ns() / 2 * 3;
    if (plan.tasks[t].budget_ns > 0 && seen > plan.tasks[t].budget_ns)
      plan.tasks[t].budget_ns = std::min(seen, plan.tasks[t].deadline_ns);
  }
}

/// One pass: composes the graph anew, since nodes and devices carry state, and runs it. Exit code, kOk if it ran.
template <class Change, class Take>
int pass(const Registry& registry, const RunOptions& options, const char* name, const Change& change,
         const Take& take) {
  Prepared prepared(registry);
  if (const int code = load(options, prepared); code != kOk) return tell_problems(prepared.problems.size()), code;
  graph::ComposeOptions how;
  how.output = options.output;
  how.seed = options.seed;
  if (const int code = compose(options, how, prepared); code != kOk)
    return tell_problems(prepared.problems.size()), code;
  Plan& plan = prepared.composition->plan;
  std::vector<std::string> adjusted;
  choose_cores(plan.cores, adjusted);
  plan.overheads = this_machine().overheads;
  let_jobs_finish(plan);
  change(plan);
  std::fprintf(stderr, "takt profile: %s, %g s\n", name, options.duration_s);
  const auto transport = make_local_transport(plan.ports);
  RunBoard board(plan);
  Executor::Options run;
  run.duration_ns = static_cast<int64_t>(options.duration_s * 1e9);
  run.require_policy = options.policy_required();
  run.board = &board;
  Executor executor(plan, *transport, *prepared.clock, run);
  const Stoppable stoppable(board);
  const RunResult result = executor.run();
  if (!result.stuck.empty()) {  // its thread still uses what would now be taken down
    refuse(fmt::format("a job of {} never returned", plan.tasks[result.stuck.front()].name), kDeviceOrSystem);
    end_process(kDeviceOrSystem, "local");
  }
  for (const std::string& refused : result.refused)
    adjusted.push_back(fmt::format("policy {} -> cooperative: {}", to_string(plan.policy), refused));
  for (const std::string& line : adjusted) std::fprintf(stderr, "takt: adjusted: %s\n", line.c_str());
  take(*prepared.graph, plan, board, result);
  return StopOnSignal::asked() ? refuse("stopped: nothing was written", kNotOk) : static_cast<int>(kOk);
}

int measure(const Registry& registry, const RunOptions& options, Profile& profile) {
  const CpuLatencyHold latency = hold_cpu_dma_latency();
  std::vector<std::string> lacks = prepare_process(registry);
  if (!latency.granted()) lacks.push_back(latency.lacks());
  for (const std::string& line : lacks) std::fprintf(stderr, "takt: adjusted: %s\n", line.c_str());
  const auto take_alone = [&](const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board,
                              const RunResult&) {
    profile.schedule = graph.schedule;
    profile.nodes.resize(plan.tasks.size());
    for (size_t t = 0; t < plan.tasks.size(); ++t) {
      profile.nodes[t].name = plan.tasks[t].name;
      profile.nodes[t].budget_ns = plan.tasks[t].budget_ns;
      profile.nodes[t].alone = board.task(t).exec;
    }
  };
  if (const int code = pass(registry, options, "each job alone", alone, take_alone); code != kOk) return code;
  return pass(
      registry, options, "all nodes together", [&](Plan& plan) { unthrottled(plan, profile.nodes); },
      [&](const graph::GraphSpec&, const Plan& plan, const RunBoard& board, const RunResult& result) {
        profile.policy = result.policy_granted;
        for (size_t t = 0; t < plan.tasks.size(); ++t) profile.nodes[t].together = board.task(t).exec;
      });
}

int write_budgets(const ProfileOptions& options, const Profile& profile) {
  graph::MeasuredSpec measured;
  measured.machine = machine::Identity::of(machine::SystemFacts());
  measured.at = graph::utc_now();
  measured.policy = to_string(profile.policy);
  measured.quantile = options.quantile;
  measured.margin = options.margin;
  for (const NodeProfile& node : profile.nodes)
    if (node.samples() > 0)
      measured.nodes[node.name] = {node.quantile_ns(options.quantile), static_cast<int64_t>(node.samples())};
  const std::filesystem::path from = profile.schedule.file, to = options.in_place ? from : options.write;
  std::ifstream in(from, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto budgets = options.keep_budgets ? std::map<std::string, int64_t>()
                                            : budgets_of(profile.nodes, options.quantile, options.margin);
  const auto edited = graph::with_budgets(text, from.string(), budgets, measured);
  if (!edited) return refuse(graph::to_string(edited.error()) + "; nothing was written", kBadInput);
  if (const std::string why = graph::write_whole(to, *edited); !why.empty())
    return refuse(fmt::format("{}: {}; choose another --write", to.string(), why), kBadInput);
  std::printf("written to %s\nsee `takt check GRAPH --schedule` of it\n", to.c_str());
  return kOk;
}

int compare(const ProfileOptions& options, double tolerance, const Profile& profile) {
  const std::string elsewhere =
      graph::measured_elsewhere(profile.schedule, machine::Identity::of(machine::SystemFacts()));
  if (!elsewhere.empty()) std::fprintf(stderr, "%s\n", elsewhere.c_str());
  const auto& measured = profile.schedule.measured;
  const double quantile = measured ? measured->quantile : options.quantile;
  const auto drifts = drift_of(profile.nodes, profile.schedule, quantile, tolerance);
  std::fputs(drift_text(drifts, tolerance).c_str(), stdout);
  return std::all_of(drifts.begin(), drifts.end(), [](const Drift& d) { return d.ok(); }) ? kOk : kNotOk;
}

}  // namespace

int profile_graph(const Registry& registry, const ProfileOptions& options) {
  const auto tolerance = parse_tolerance(options.tolerance);
  if (!tolerance) return refuse("--tolerance " + options.tolerance + " is no share; write for instance 20%", kBadInput);
  if (!options.compare.empty() && options.run.load.schedule)
    return refuse("--compare names the schedule; leave --schedule out", kBadInput);
  if (options.run.duration_s <= 0) return refuse("--for: a profile needs an end; write for instance 20s", kBadInput);
  // Before both passes; --in-place names its file only once the graph is loaded.
  if (const std::string why = options.write.empty() ? "" : graph::cannot_write(options.write); !why.empty())
    return refuse(fmt::format("{}: {}; choose another --write", options.write.string(), why), kBadInput);
  RunOptions run = options.run;
  if (!options.compare.empty()) run.load.schedule = options.compare;
  const StopOnSignal guard;
  try {
    Profile profile;
    if (const int code = measure(registry, run, profile); code != kOk) return code;
    if (!options.compare.empty()) return compare(options, *tolerance, profile);
    std::fputs(profile_text(profile.nodes, options.quantile, options.margin).c_str(), stdout);
    std::printf("together under policy %s\n", std::string(to_string(profile.policy)).c_str());
    return options.in_place || !options.write.empty() ? write_budgets(options, profile) : static_cast<int>(kOk);
  } catch (const std::invalid_argument& problem) {  // more ports or edges than the transport carries
    return refuse(problem.what(), kBadInput);
  } catch (const std::exception& problem) {  // PolicyRefused, TransportError, no memory
    return refuse(problem.what(), kDeviceOrSystem);
  }
}

}  // namespace takt::command
