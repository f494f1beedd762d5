// SPDX-License-Identifier: Apache-2.0
#include "graph/rewind/recorded_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <stdexcept>

#include "graph/compose/partition.hpp"
#include "graph/language/words.hpp"
#include "graph/log/cut_log.hpp"
#include "graph/log/recorded_plan.hpp"
#include "graph/run/outputs.hpp"
#include "graph/run/support.hpp"
#include "rt/abi.hpp"

namespace takt::rewind {
namespace {

using command::kOk;
using command::ReplayPart;
using command::StopOnSignal;
using command::tell_ignored_overlay;
using command::tell_problems;
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

/// Of a frozen file, the begin of what it was written for; else that of the run.
int64_t frozen_from_ns(const record::LogFile& file) {
  for (const auto& named : file.container().metadata())
    if (named.name == "takt frozen") return std::strtoll(fact(named.map, "from_ns").c_str(), nullptr, 10);
  return INT64_MIN;
}

/// A replay from an instant on looks for snapshots in so many intervals before it, and in the last and the next to last
/// of those in which a ring on disk has one of each large state.
constexpr int64_t kIntervals = 5, kStates = 2;
/// A job that was released before the end of a part is published until then.
constexpr int64_t kLatest_ns = 5'000'000'000;

}  // namespace

/// SIMD code of another width may round differently: the target of the record, or none.
void RecordedRun::force_simd(const VectorTargets& vectors) const {
  const std::string recorded = fact(file_->facts(), "simd");
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

command::RunOptions& RecordedRun::open() {
  const bool part = options_.from_s > 0 || options_.until_s;
  auto file = part ? record::LogFile::open_head(options_.log) : record::LogFile::open(options_.log);
  if (!file) throw Refused{file.error()};
  file_.emplace(std::move(*file));
  if (part) read_part();
  for (const std::string& damage : file_->damages())
    std::fprintf(stderr, "takt: the record is not whole: %s\n", damage.c_str());
  run_ = recorded_options(*file_, options_);
  recorded_ = attached_json(*file_, "plan.json");
  return run_;
}

/// A record without an end does not say when its run began, and is read whole.
void RecordedRun::read_part() {
  if (fact(file_->end(), "epoch_ns").empty()) return file_->read(INT64_MIN, INT64_MAX);
  const auto told_ns = [this](const char* name) {
    return static_cast<int64_t>(std::strtoll(fact(file_->facts(), name).c_str(), nullptr, 10));
  };
  const int64_t snapshots_ns = told_ns("snapshots_ns");
  const bool begins_late = options_.from_s > 0 && snapshots_ns > 0;
  file_->read(
      begins_late ? at(options_.from_s) - kIntervals * snapshots_ns - kStates * told_ns("states_ns") : INT64_MIN,
      options_.until_s ? at(*options_.until_s) + kLatest_ns : INT64_MAX);
}

int RecordedRun::compose(const Registry& registry) {
  force_simd(registry.vectors);
  check_plugins(run_.load.plugins);
  prepared_.emplace(registry);
  const int code = compose();
  if (code == command::kOk) check_sameness();
  return code;
}

int RecordedRun::outline(const Registry& registry) {
  force_simd(registry.vectors);
  prepared_.emplace(registry);
  if (const int code = load(run_, *prepared_); code != command::kOk) return code;
  remember_as_recorded(*prepared_->graph, *file_);
  prepared_->composition = graph::outline(*prepared_->graph, registry, *prepared_->clock);
  return command::kOk;
}

void RecordedRun::compose_again() {
  const Registry& registry = prepared_->registry;
  prepared_.emplace(of_jobs(registry));
  if (compose() != command::kOk) throw std::runtime_error("it cannot be composed again");
}

int64_t RecordedRun::epoch_ns() const { return log::epoch_ns(*file_); }

int RecordedRun::compose() {
  int code = load(run_, *prepared_);
  if (code == kOk) {
    remember_as_recorded(*prepared_->graph, *file_);
    tell_ignored_overlay(prepared_->graph->name, "the record says which values held");
    RecordedFacts facts(recorded_);
    graph::ComposeOptions& how = composed_;
    how.output = options_.output;
    how.seed = run_.seed;
    if (options_.recorded_pace) how.observers.taps = 1;  // somebody may look (ShownReplay)
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

void RecordedRun::check_plugins(const std::vector<graph::PluginFact>& loaded) const {
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

void RecordedRun::check_sameness() {
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

record::ReplayResult RecordedRun::run(record::Replayer::Options how) {
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

void RecordedRun::renew(size_t task) {
  graph::Composition& composition = *prepared_->composition;
  auto fresh =
      graph::make_again(*prepared_->graph, prepared_->registry, *prepared_->clock, composed_, composition.plan, task);
  composition.plan.tasks[task].node = fresh.get();
  composition.nodes[task] = std::move(fresh);
}

std::vector<ReplayPart> RecordedRun::parts() const {
  record::Replayer::Options how;
  how.begin_ns = frozen_from_ns(*file_);  // what lies before that are snapshots
  if (options_.from_s > 0) how.begin_ns = how.from_ns = at(options_.from_s);
  if (options_.until_s) how.end_ns = at(*options_.until_s);
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

std::vector<char> RecordedRun::live_tasks() const {
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

std::vector<char> RecordedRun::with_producers(std::vector<char> runs) const {
  for (size_t t = 0; t < runs.size(); ++t)
    if (runs[t] != 0 && add_producers(t, runs)) t = SIZE_MAX;  // from the first one again
  return runs;
}

bool RecordedRun::add_producers(size_t task, std::vector<char>& runs) const {
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

std::function<void(int64_t)> RecordedRun::pace(int64_t from_ns) const {
  return [this, from_ns, origin_ns = int64_t{0}](int64_t release_ns) mutable {
    if (release_ns < from_ns) return;
    if (origin_ns == 0) origin_ns = clock_.now_ns() - release_ns;
    const int64_t until_ns = origin_ns + release_ns;
    const timespec until{until_ns / 1'000'000'000, until_ns % 1'000'000'000};
    while (!StopOnSignal::asked() && clock_.now_ns() < until_ns)
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
  };
}

}  // namespace takt::rewind
