// SPDX-License-Identifier: Apache-2.0
#include "graph/command/replay_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <optional>
#include <sstream>

#include "graph/cli/file_option.hpp"
#include "graph/command/graph_commands.hpp"
#include "graph/command/recorded_options.hpp"
#include "graph/command/what_if_command.hpp"
#include "graph/compose/composition.hpp"
#include "graph/compose/partition.hpp"
#include "graph/language/words.hpp"
#include "graph/log/cut_log.hpp"
#include "graph/log/damages.hpp"
#include "graph/log/log_content.hpp"
#include "graph/log/recorded_plan.hpp"
#include "graph/run/isolated_replay.hpp"
#include "graph/run/outputs.hpp"
#include "graph/run/prepare.hpp"
#include "graph/run/support.hpp"
#include "rt/abi.hpp"
#include "rt/record/replayer.hpp"

namespace takt::command {
namespace {

using log::fact;
using log::Json;

/// The outputs of the devices as the record has them; everything else is made here.
class RecordedFacts final : public graph::FactExchange {
 public:
  explicit RecordedFacts(const Json& plan) : plan_(plan) {}
  void tell(size_t, const std::optional<Capacity>&) override {}
  std::optional<Capacity> wait_for(size_t port) override { return log::capacity_of(plan_, port); }
  void tell_source(size_t, const SourcePlan&) override {}
  SourcePlan wait_for_source(size_t) override { return {0, 0, "it is recorded"}; }

 private:
  const Json& plan_;
};

/// SIMD code of another width may round differently: the target of the record, or none.
void force_simd(const VectorTargets& vectors, const std::string& recorded) {
  const auto names = vectors.names != nullptr ? vectors.names() : std::vector<std::string>{};
  if (recorded.empty() || names.empty() || recorded == names.front()) return;
  const auto found = std::find(names.begin(), names.end(), recorded);
  if (found == names.end())
    throw Refused{fmt::format("the record was made with the SIMD target {}, which this CPU (best: {}) does not have",
                              recorded, names.front())};
  vectors.leave_out(static_cast<size_t>(found - names.begin()));
  std::fprintf(stderr, "takt: SIMD target %s as in the record, not this machine's %s\n", recorded.c_str(),
               names.front().c_str());
}

class Replay {
 public:
  explicit Replay(const ReplayOptions& options) : options_(options) {}

  /// Reads the record: what it says of its run. Throws Refused, as all others do.
  RunOptions& open() {
    auto file = record::LogFile::open(options_.log);
    if (!file) throw Refused{file.error()};
    file_.emplace(std::move(*file));
    for (const std::string& damage : file_->damages())
      std::fprintf(stderr, "takt: the record is not whole: %s\n", damage.c_str());
    damaged_ = !options_.allow_damage && !file_->damages().empty();
    run_ = recorded_options(*file_, options_);
    recorded_ = attached_json(*file_, "plan.json");
    return run_;
  }

  /// After open(), with a registry that knows what its options name.
  int run(const Registry& registry) {
    force_simd(registry.vectors, fact(file_->facts(), "simd"));
    if (const int code = rehearse(registry); code != kOk) return code;
    return judge(replay([this](const ReplayPart& part) { return replay(part.how); }));
  }

  /// All but the jobs.
  int rehearse(const Registry& registry) {
    check_plugins(run_.load.plugins);
    prepared_.emplace(registry);
    const int code = compose();
    if (code == kOk) check_sameness();
    return code;
  }

  /// After a rehearsal in another process: `registry` has descriptions, and each process of the replay loads plug-ins.
  int run_apart(const Registry& registry) {
    force_simd(registry.vectors, fact(file_->facts(), "simd"));
    prepared_.emplace(registry);
    if (const int code = load(run_, *prepared_); code != kOk) return code;
    prepared_->composition = graph::outline(*prepared_->graph, registry, *prepared_->clock);
    return judge(replay([&](const ReplayPart& part) {
      prepared_.emplace(of_jobs(registry));
      if (compose() != kOk) throw std::runtime_error("it cannot be composed again");
      return replay(part.how);
    }));
  }

 private:
  int compose() {
    int code = load(run_, *prepared_);
    if (code == kOk) {
      tell_ignored_overlay(prepared_->graph->name, "the record says which values held");
      RecordedFacts facts(recorded_);
      graph::ComposeOptions& how = composed_;
      how.output = options_.output;
      how.seed = run_.seed;
      how.exchange = &facts;
      how.owns = [this](const std::string& id) {
        return std::none_of(prepared_->graph->devices.begin(), prepared_->graph->devices.end(),
                            [&](const graph::DeviceSpec& device) { return device.id == id; });
      };
      code = command::compose(run_, how, *prepared_);
      how.exchange = nullptr;
    }
    if (code != kOk) tell_problems(prepared_->problems.size());
    return code;
  }

  /// Throws where one is missing that the record was made with; says where one is another file now.
  void check_plugins(const std::vector<graph::PluginFact>& loaded) const {
    std::istringstream recorded(fact(file_->facts(), "plugins"));
    for (std::string name, hash; recorded >> name >> hash;) {
      const auto found = std::find_if(loaded.begin(), loaded.end(),
                                      [&](const graph::PluginFact& plugin) { return plugin.name == name; });
      if (found == loaded.end())
        throw Refused{fmt::format("the record was made with the plug-in {}; name it: --plugin FILE", name)};
      if (found->hash != hash)
        std::fprintf(stderr, "takt: plug-in %s is not what it was when the record was made\n", name.c_str());
    }
  }

  /// Says what is not as it was; throws where that makes a replay impossible.
  void check_sameness() {
    const graph::GraphSpec& graph = *prepared_->graph;
    const Json plan = log::plan_json(prepared_->composition->plan);
    if (const auto differs = log::structure_differs(recorded_, plan))
      throw Refused{"this graph cannot run the jobs of the record: " + *differs};
    const Json assets = attached_json(*file_, "assets.json");
    const Json hashes = log::asset_hashes(prepared_->composition->plan, graph.directory);
    const auto places = log::assets(prepared_->composition->plan, graph.directory);
    for (const auto& [name, hash] : assets.items()) {
      if (hashes.value(name, "") == hash) continue;
      const auto place = places.find(name);
      throw Refused{fmt::format("{} is not what it was when the record was made",
                                (place == places.end() ? graph.directory / name : place->second).string())};
    }
    if (const std::string cut = fact(file_->facts(), "cut"); !cut.empty())
      std::fprintf(stderr, "takt: this is %s; nodes begin here without what they remembered\n", cut.c_str());
    for (size_t i = 0; i < graph.files.size(); ++i)
      if (log::file_text(graph.files[i]) != file_->attached(i == 0 ? "graph.yaml" : log::part_name(i)))
        std::fprintf(stderr, "takt: %s has changed since the record was made\n", graph.files[i].c_str());
    for (const std::string& param : log::changed_params(recorded_, plan))
      std::fprintf(stderr, "takt: %s\n", param.c_str());
    if (fact(file_->facts(), "program") != log::program_hash())
      std::fprintf(stderr, "takt: this is another program (commit %s) than the one that recorded (commit %s)\n",
                   version().commit, fact(file_->facts(), "commit").c_str());
  }

  record::ReplayResult replay(const std::function<record::ReplayResult(const ReplayPart&)>& run_part) {
    const std::vector<ReplayPart> parts = this->parts();
    const int64_t before_ns = clock_.now_ns();
    processes_ = parts.size();
    auto result = options_.isolate == "subsystem" ? replay_isolated(parts, run_part) : run_part(parts.front());
    took_ns_ = clock_.now_ns() - before_ns;
    return result;
  }

  /// Runs the jobs of some nodes, in this process.
  record::ReplayResult replay(record::Replayer::Options how) {
    const std::vector<TaskPlan>& tasks = prepared_->composition->plan.tasks;
    how.epoch_ns = log::epoch_ns(*file_);
    for (const TaskPlan& task : tasks)
      if (!task.device) task.node->start(how.epoch_ns);
    how.renew = [this](size_t task) { renew(task); };
    record::Replayer replayer(prepared_->composition->plan, *file_, how);
    auto result = replayer.run([] { return StopOnSignal::asked(); });
    for (size_t t = 0; t < tasks.size(); ++t)  // pictures: each by one process
      if (!tasks[t].device && (how.told.empty() || how.told[t] != 0)) tasks[t].node->finish();
    return result;
  }

  /// As the process of the node was started again in the run.
  void renew(size_t task) {
    graph::Composition& composition = *prepared_->composition;
    auto fresh =
        graph::make_again(*prepared_->graph, prepared_->registry, *prepared_->clock, composed_, composition.plan, task);
    composition.plan.tasks[task].node = fresh.get();
    composition.nodes[task] = std::move(fresh);
  }

  /// One for each process.
  std::vector<ReplayPart> parts() const {
    record::Replayer::Options how;
    if (options_.from_s > 0) how.from_ns = log::epoch_ns(*file_) + static_cast<int64_t>(options_.from_s * 1e9);
    if (options_.recorded_pace) how.pace = pace(how.from_ns);
    const std::vector<char> live = live_tasks();
    how.run = live;
    if (options_.isolate != "subsystem") return {{"all", how}};
    const std::vector<TaskPlan>& tasks = prepared_->composition->plan.tasks;
    std::vector<std::string> adjusted;
    const graph::Partition partition = graph::partition(*prepared_->graph, adjusted);
    std::vector<ReplayPart> parts;
    for (size_t process = 0; process < partition.names.size(); ++process) {
      how.told.assign(tasks.size(), 0);
      for (size_t t = 0; t < tasks.size(); ++t)
        how.told[t] =
            !tasks[t].device && (live.empty() || live[t] != 0) && partition.process_of.at(tasks[t].name) == process;
      if (std::count(how.told.begin(), how.told.end(), 1) == 0) continue;  // the devices'
      how.run = with_producers(how.told);
      parts.push_back({partition.names[process], how});
    }
    return parts;
  }

  /// By task: the nodes of --live with_producers(); empty: all.
  std::vector<char> live_tasks() const {
    const Plan& plan = prepared_->composition->plan;
    if (options_.live.empty()) return {};
    std::vector<char> runs(plan.tasks.size(), 0);
    std::vector<std::string> names;
    for (const TaskPlan& task : plan.tasks)
      if (!task.device) names.push_back(task.name);
    for (const std::string& id : options_.live) {
      const auto task = std::find_if(plan.tasks.begin(), plan.tasks.end(),
                                     [&](const TaskPlan& t) { return t.name == id && !t.device; });
      if (task == plan.tasks.end())
        throw Refused{fmt::format("--live {}: there is no such node{}", graph::ticked(id),
                                  graph::alternatives(id, names, "nodes of the graph"))};
      runs[static_cast<size_t>(task - plan.tasks.begin())] = 1;
    }
    return with_producers(runs);
  }

  /// And those that must run because their messages are in the record by hash only.
  std::vector<char> with_producers(std::vector<char> runs) const {
    for (size_t t = 0; t < runs.size(); ++t)
      if (runs[t] != 0 && add_producers(t, runs)) t = SIZE_MAX;  // from the first one again
    return runs;
  }

  /// True if a producer had to be added.
  bool add_producers(size_t task, std::vector<char>& runs) const {
    const Plan& plan = prepared_->composition->plan;
    bool added = false;
    for (const EdgePlan& edge : plan.tasks[task].edges) {
      const PortPlan& port = plan.ports[edge.port];
      const auto& messages = file_->messages(file_->channel(port.node + "." + port.port));
      const bool whole = std::all_of(messages.begin(), messages.end(), [](const auto& m) { return m.second.whole; });
      for (size_t t = 0; t < runs.size(); ++t) {
        const auto& ports = plan.tasks[t].ports;
        if (whole || runs[t] != 0 || std::find(ports.begin(), ports.end(), edge.port) == ports.end()) continue;
        if (options_.isolate != "subsystem")  // there each process runs what it needs
          std::fprintf(stderr, "takt: %s runs, too: its %s is in the record by hash only\n", port.node.c_str(),
                       port.port.c_str());
        runs[t] = 1;
        added = true;
      }
    }
    return added;
  }

  /// Waits until as much time has passed as in the record; what was before `from_ns` is not waited for.
  std::function<void(int64_t)> pace(int64_t from_ns) const {
    return [this, from_ns, origin_ns = int64_t{0}](int64_t release_ns) mutable {
      if (release_ns < from_ns) return;
      if (origin_ns == 0) origin_ns = clock_.now_ns() - release_ns;
      const int64_t until_ns = origin_ns + release_ns;
      const timespec until{until_ns / 1'000'000'000, until_ns % 1'000'000'000};
      while (!StopOnSignal::asked() && clock_.now_ns() < until_ns)
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
    };
  }

  int judge(const record::ReplayResult& result) const {
    const int code = tell(result);
    if (code != kOk || !damaged_) return code;
    return refuse(log::damages_text(options_.log, *file_) + "; --allow-damage goes on with what is left", kNotOk);
  }

  int tell(const record::ReplayResult& result) const {
    const double recorded_s = static_cast<double>(result.recorded_ns) / 1e9;
    const double took_s = static_cast<double>(took_ns_) / 1e9;
    fmt::print("replayed {} jobs in {} process{}, {:.1f} s in {:.1f} s ({:.1f}x real time)\n", result.jobs, processes_,
               processes_ == 1 ? "" : "es", recorded_s, took_s, took_s > 0 ? recorded_s / took_s : 0.0);
    if (result.restarts > 0) fmt::print("{} restarts of nodes done again\n", result.restarts);
    if (result.uncommitted > 0)
      fmt::print("{} jobs were not run: their process was lost before they published\n", result.uncommitted);
    if (result.lacking > 0) fmt::print("{} jobs were not run: the record lost what they were given\n", result.lacking);
    if (result.unmade > 0)
      fmt::print("{} messages are not compared: the record has their hash only, and lacks the jobs that made them\n",
                 result.unmade);
    // A record without an end lacks the last jobs, as it says.
    const bool lacking = result.lacking > 0 || (result.unmade > 0 && !file_->end().empty());
    if (result.jobs == 0 && !StopOnSignal::asked())
      return refuse(options_.log.string() + ": nothing was replayed, the record has no job to be run", kNotOk);
    if (!options_.compare) return lacking ? kNotOk : kOk;
    if (result.compared == 0 && !StopOnSignal::asked())
      return refuse(options_.log.string() + ": nothing was compared", kNotOk);
    fmt::print("compared {} of {} messages: {} field by field, {} by hash; {} differ\n", result.compared,
               result.messages, result.whole, result.compared - result.whole, result.different);
    if (result.first) {
      const record::Divergence& first = *result.first;
      fmt::print("first difference: {}{}{}, job {} (released {:.3f} s after the epoch): {}\n", first.node,
                 first.port.empty() ? "" : ".", first.port, first.job,
                 static_cast<double>(first.release_ns - log::epoch_ns(*file_)) / 1e9, first.what);
      for (const auto& [node, count] : result.different_of) fmt::print("  {}: {} differ\n", node, count);
    }
    if (result.different > 0 && file_->format() == 1)
      fmt::print(
          "a record of format 1 does not tell where a process was started again: what its nodes publish after "
          "that differs. Record again, or replay up to there: takt log cut --to S\n");
    return result.different > 0 || lacking ? kNotOk : kOk;
  }

  const ReplayOptions& options_;
  RunOptions run_;  ///< of the record, and what the command line says
  MonotonicClock clock_;
  std::optional<record::LogFile> file_;
  Json recorded_;
  std::optional<Prepared> prepared_;
  graph::ComposeOptions composed_;
  int64_t took_ns_ = 0;
  bool damaged_ = false;  ///< and that is not allowed
  size_t processes_ = 1;
};

}  // namespace

int replay(plugin::Plugins& plugins, const ReplayOptions& options) {
  if (options.asks_what_if() || options.json || !options.report.empty()) return what_if(plugins, options);
  std::vector<WriterLock> locks;
  if (const int code = claim_folder(options.output, locks); code != kOk) return code;
  return judged(options, [&] {
    Replay replay(options);
    RunOptions& run = replay.open();
    const auto stoppable = [&](const std::function<int()>& part) {
      const StopOnSignal guard;
      return judged(options, part);
    };
    const bool apart = options.isolate == "subsystem" && plugin::are_named(run.graph, run.load);
    const int code = plugins.carry_out(run.graph, run.load, [&](const Registry& known) {
      return stoppable([&] { return apart ? replay.rehearse(known) : replay.run(known); });
    });
    if (!apart || code != kOk) return code;
    return plugins.supervise(run.graph, run.load,
                             [&](const Registry& known) { return stoppable([&] { return replay.run_apart(known); }); });
  });
}

void add_replay(CLI::App& app, plugin::Plugins& plugins, ReplayOptions& o, int& exit_code) {
  CLI::App* replay =
      app.add_subcommand("replay", "runs the jobs of a record again, or predicts them on another schedule");
  reads_file(replay->add_option("log", o.log, "what `takt run --record` wrote"), UINT64_MAX)->required();
  reads_file(replay->add_option("graph", o.graph, "graph file instead of that of the record"));
  replay->add_flag("--compare", o.compare, "bit by bit with the record; exit 1 on the first message that differs");
  replay->add_flag("--allow-damage", o.allow_damage, "a record that is damaged or cut off is no failure");
  replay->add_option("--live", o.live, "runs only these nodes, with the rest from the record")->delimiter(',');
  reads_file(replay->add_option("--params", o.params, "parameter file of the robot instead of that of the record"));
  replay->add_option("--set", o.set, "node.param=value, repeatable");
  add_plugin_option(*replay, o.plugin_files);
  replay->add_option("--from", o.from_s, "tells and paces only what was released so many seconds into the run");
  replay->add_option("--isolate", o.isolate, "none (one process) | subsystem: as many as the run had")
      ->check(CLI::IsMember({"none", "subsystem"}));
  replay->add_flag("--recorded-pace", o.recorded_pace, "as fast as it was, instead of as fast as possible");
  writes_folder(replay->add_option("--output", o.output, "folder for pictures and other results (default out)"));
  add_what_if_options(*replay, o);
  replay->footer(
      "Example: takt replay run.mcap --compare\n"
      "Example: takt replay run.mcap --schedule other.yaml --cores 1 --speed 0.5\n"
      "Example: takt replay run.mcap --live ground_map --set ground_map.votes_min=7");
  replay->callback([&] { exit_code = command::replay(plugins, o); });
}

}  // namespace takt::command
