// SPDX-License-Identifier: Apache-2.0
#include "graph/command/what_if_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "graph/cli/file_option.hpp"
#include "graph/compose/composition.hpp"
#include "graph/expect/figures.hpp"
#include "graph/language/words.hpp"
#include "graph/log/damages.hpp"
#include "graph/log/log_content.hpp"
#include "graph/rewind/recorded_options.hpp"
#include "graph/run/prepare.hpp"
#include "graph/run/report.hpp"
#include "graph/run/support.hpp"
#include "graph/what_if/comparison.hpp"
#include "rt/file/input_file.hpp"
#include "rt/sched/plan_ports.hpp"

namespace takt::command {
namespace {

using log::Json;
using rewind::attached_json;
using rewind::judged;
using rewind::recorded_options;
using rewind::Refused;

constexpr int kMostCores = 64;
constexpr double kSlowest = 0.001, kFastest = 1000;

/// What is wrong with the options; empty: nothing.
std::string wrong_options(const ReplayOptions& o) {
  if (!o.asks_what_if() && (o.json || !o.report.empty()))
    return fmt::format("{}: only a what-if has a report; add --schedule, --cores or --speed",
                       o.json ? "--json" : "--report " + o.report.string());
  if (!o.asks_what_if()) return "";
  for (const auto& [given, option] : {std::pair(o.compare, "--compare"),
                                      {!o.live.empty(), "--live"},
                                      {o.recorded_pace, "--recorded-pace"},
                                      {o.from_s != 0, "--from"},
                                      {o.until_s.has_value(), "--until"},
                                      {o.inspect, "--inspect"},
                                      {!o.until_condition.empty(), "--break"},
                                      {o.isolate != "none", "--isolate"}})
    if (given)
      return fmt::format("{}: --schedule, --cores and --speed ask for a what-if, which runs no node; leave it out",
                         option);
  if (o.cores && (*o.cores < 1 || *o.cores > kMostCores))
    return fmt::format("--cores {}: choose 1 to {}", *o.cores, kMostCores);
  if (o.speed && !(*o.speed >= kSlowest && *o.speed <= kFastest))
    return fmt::format(
        "--speed {:g}: choose {:g} to {:g}, how many times as fast the other computer is (0.5: half as fast)", *o.speed,
        kSlowest, kFastest);
  return "";
}

class WhatIf {
 public:
  WhatIf(const ReplayOptions& options, record::LogFile& file, RunOptions run)
      : options_(options), file_(file), run_(std::move(run)) {
    if (!options_.schedule.empty()) {
      recorded_schedule_ = run_.load.schedule.value_or("");
      run_.load.schedule = options_.schedule;
      run_.load.policy.clear();
    }
    run_.clock = "virtual";
  }

  RunOptions& options() { return run_; }

  int run(const Registry& registry) {
    Prepared prepared(registry);
    if (const int code = load_schedule(prepared); code != kOk) return code;
    rewind::remember_as_recorded(*prepared.graph, file_);
    graph::Composition outline = graph::outline(*prepared.graph, registry, *prepared.clock);
    Plan& plan = outline.plan;
    take_sizes(plan);
    for (TaskPlan& task : plan.tasks) task.state_every_ns = 0;  // who stands in for a node publishes that as it did
    std::vector<std::string> adjusted = prepared.graph->adjusted;
    choose_cores(plan, adjusted);
    const what_if::RecordedRun recorded = what_if::read_recorded_run(file_, plan);
    if (std::none_of(recorded.tasks.begin(), recorded.tasks.end(), [](const auto& task) { return !task.jobs.empty(); }))
      return refuse(options_.log.string() + ": the record has no job whose time could be taken", kNotOk);
    RunBoard board(plan);
    const what_if::Prediction prediction =
        what_if::predict(plan, recorded, {options_.speed.value_or(1), [] { return StopOnSignal::asked(); }}, board);
    Json report = report_of(registry, *prepared.graph, plan, board, prediction, std::move(adjusted));
    expect(*prepared.graph, report);
    return tell(what_if::comparison_json(
        {options_.log.string(), prepared.graph->schedule.file, options_.speed.value_or(1)}, plan, recorded, prediction,
        what_if::recorded_json(recorded, plan, *prepared.graph, file_.facts(), file_.end()), std::move(report)));
  }

 private:
  int load_schedule(Prepared& prepared) {
    const std::filesystem::path& asked = options_.schedule;
    if (const std::string why = asked.empty() ? "" : why_unreadable(asked); !why.empty())
      throw Refused{fmt::format("--schedule {} {}{}", asked.string(), why, choices(prepared.registry))};
    const int code = load(run_, prepared);
    if (code == kOk) return code;
    tell_problems(prepared.problems.size());
    if (asked.empty()) return code;
    throw Refused{fmt::format("--schedule {}: this is no schedule of the graph of the record, {}{}", asked.string(),
                              run_.graph.string(), choices(prepared.registry))};
  }

  /// The schedules next to that of the record which this graph can run on.
  std::string choices(const Registry& registry) const {
    std::vector<std::string> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(recorded_schedule_.parent_path(), error)) {
      graph::LoadOptions with = run_.load;
      with.schedule = entry.path();
      if (entry.path().extension() == ".yaml" && graph::load(run_.graph, with, registry).graph)
        files.push_back(entry.path().lexically_proximate(std::filesystem::current_path()).string());
    }
    return graph::alternatives("", files, "schedules of this graph");
  }

  /// An outline knows no sizes; the record does. Throws Refused where the graph is another one by now.
  void take_sizes(Plan& plan) const {
    const Json then = attached_json(file_, "plan.json");
    if (then.at("ports").size() == plan.ports.size())
      for (size_t p = 0; p < plan.ports.size(); ++p) plan.ports[p].capacity = log::capacity_of(then, p);
    size_ports(plan, {1, 0, 0});  // a record that begins late is joined, and that takes a reader
    if (const auto differs = log::structure_differs(then, log::plan_json(plan)))
      throw Refused{"this graph is not that of the record: " + *differs};
  }

  int recorded_cores() const {
    const Json machine = Json::parse(log::fact(file_.facts(), "machine"), nullptr, false);
    const int cores = machine.is_object() ? machine.value("cores", 0) : 0;
    return cores > 0 ? cores : std::max(1, this_machine().identity.cores);
  }

  void choose_cores(Plan& plan, std::vector<std::string>& adjusted) const {
    std::vector<int>& cores = plan.cores;
    const auto wanted = static_cast<size_t>(options_.cores.value_or(cores.empty() ? recorded_cores() : 0));
    if (wanted > 0 && cores.size() > wanted) cores.resize(wanted);
    for (int next = 0; cores.size() < wanted; ++next)
      if (std::find(cores.begin(), cores.end(), next) == cores.end()) cores.push_back(next);
    for (TaskPlan& task : plan.tasks) {
      if (task.core < 0 || std::find(cores.begin(), cores.end(), task.core) != cores.end()) continue;
      adjusted.push_back(
          fmt::format("core {} of {} -> chosen: --cores {} leaves it out", task.core, task.name, wanted));
      task.core = -1;
    }
    plan.overheads = this_machine().overheads;  // under `fixed` they are part of who gets which core
  }

  Json report_of(const Registry& registry, const graph::GraphSpec& graph, const Plan& plan, RunBoard& board,
                 const what_if::Prediction& prediction, std::vector<std::string> adjusted) const {
    MachineUse use;
    for (size_t t = 0; t < plan.tasks.size(); ++t)  // what jobs are taken to use, not what this process did
      use.cpu_ns += board.task(t).cpu_ns = board.task(t).exec.sum_ns();
    graph::Proofs proofs;
    proofs.policy = plan.policy;
    proofs.why = "recorded times are simulated, not proven; takt check proves";
    const StallLog stalls;
    const auto transport = make_local_transport({});
    Json report = make_report({registry,
                               graph,
                               plan,
                               board,
                               prediction.run,
                               *transport,
                               use,
                               "virtual",
                               std::string(to_string(plan.policy)),
                               "none",
                               {},
                               std::move(adjusted),
                               proofs,
                               stalls});
    report["simulated"] = {{"policy", to_string(plan.policy)},
                           {"cores", plan.cores.size()},
                           {"durations", options_.log.string()},
                           {"speed", options_.speed.value_or(1)}};
    report["memory"] = nullptr;  // stand-ins send no images
    return report;
  }

  static void expect(const graph::GraphSpec& graph, Json& report) {
    if (!graph.expect) return;
    const graph::FigureExpectations& figures = graph.expect->figures;
    std::vector<graph::Finding> findings = graph::figure_findings(figures, report);
    for (graph::Finding& finding : graph::promise_findings(figures, report, {})) findings.push_back(std::move(finding));
    report["expectations"] = {{"within_s", static_cast<double>(graph.expect->within_ns) / 1e9},
                              {"conditions", graph::findings_json(findings)},
                              {"met", graph::all_met(findings)},
                              {"not_judged", graph.expect->conditions.size()}};
  }

  int tell(const Json& comparison) const {
    const std::string json = comparison.dump(2) + "\n";
    std::fputs(options_.json ? json.c_str() : what_if::comparison_text(comparison).c_str(), stdout);
    int code = comparison["ok"].get<bool>() ? kOk : kNotOk;
    if (!options_.report.empty()) code = std::max(code, write_output(options_.report, json, "--report"));
    return code;
  }

  const ReplayOptions& options_;
  record::LogFile& file_;
  RunOptions run_;
  std::filesystem::path recorded_schedule_;
};

}  // namespace

int what_if(plugin::Plugins& plugins, const ReplayOptions& options) {
  if (const std::string wrong = wrong_options(options); !wrong.empty()) return refuse(wrong, kBadInput);
  return judged(options, [&] {
    auto file = record::LogFile::open(options.log);
    if (!file) throw Refused{file.error()};
    WhatIf what_if(options, *file, recorded_options(*file, options));
    RunOptions& run = what_if.options();
    const int code = plugins.carry_out(run.graph, run.load, [&](const Registry& known) {
      const StopOnSignal guard;
      return judged(options, [&] { return what_if.run(known); });
    });
    const std::string damages = log::damages_text(options.log, *file);
    if (damages.empty() || options.allow_damage || code != kOk) return code;
    return refuse(damages + "; --allow-damage goes on with what is left", kNotOk);
  });
}

void add_what_if_options(CLI::App& replay, ReplayOptions& o) {
  replay.add_option("--schedule", o.schedule, "what if: predicts the run on this schedule, from the recorded times")
      ->type_name("FILE");
  replay.add_option("--cores", o.cores, "what if: on so many cores (default: those of schedule and record)");
  replay.add_option("--speed", o.speed, "what if: on a computer so many times as fast, such as 0.5");
  writes_file(replay.add_option("--report", o.report, "writes record and what-if as JSON, as reports of runs"));
  replay.add_flag("--json", o.json, "prints that JSON instead of tables");
}

}  // namespace takt::command
