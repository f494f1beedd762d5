// SPDX-License-Identifier: Apache-2.0
// Whatever admission uses of a plan is the same in one process, in several, and in the supervisor that runs none of the
// nodes: one graph, one verdict.
#include <doctest/doctest.h>

#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "graph/ace/ace_registry.hpp"
#include "graph/check/check.hpp"
#include "graph/compose/partition.hpp"
#include "graph/plugins/description.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;

namespace {

/// The board of a run in several processes, with threads for processes.
class SharedFacts final : public graph::FactExchange {
 public:
  void tell(size_t port, const std::optional<Capacity>& capacity) override { put(capacities_, port, capacity); }
  std::optional<Capacity> wait_for(size_t port) override { return get(capacities_, port); }
  void tell_counts(size_t port, const ArrayCounts& counts) override { put(counts_, port, counts); }
  ArrayCounts counts(size_t port) override { return get(counts_, port); }
  void tell_source(size_t task, const SourcePlan& source) override { put(sources_, task, source); }
  SourcePlan wait_for_source(size_t task) override { return get(sources_, task); }

 private:
  template <class T>
  void put(std::map<size_t, T>& told, size_t key, const T& value) {
    const std::lock_guard lock(mutex_);
    told[key] = value;
    changed_.notify_all();
  }
  template <class T>
  T get(std::map<size_t, T>& told, size_t key) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return told.contains(key); });
    return told[key];
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<size_t, std::optional<Capacity>> capacities_;
  std::map<size_t, ArrayCounts> counts_;
  std::map<size_t, SourcePlan> sources_;
};

/// All of the robot, as if it were of a plug-in that this process must not load.
const Registry& described() {
  static Registry known;
  static plugin::Descriptions descriptions(known);
  if (known.nodes.all().empty()) descriptions.add(plugin::describe(Registry{}, ace_registry()));
  return known;
}

graph::GraphSpec loaded(const char* file, const char* profile, const Registry& registry) {
  graph::LoadOptions options;
  options.profile = profile;
  graph::Loaded result = graph::load(test::graph_folder() / file, options, registry);
  for (const auto& problem : result.problems) MESSAGE(graph::to_string(problem));
  REQUIRE(result.graph);
  return std::move(*result.graph);
}

/// One process of the run: what `owns` names, no device plugged in. Its nodes live as long as it does.
struct Process {
  MonotonicClock clock;
  hal::Devices devices;
  graph::Composition composition;
};

void compose_in(Process& process, const graph::GraphSpec& graph, const graph::ComposeOptions& how) {
  const graph::DeviceFactory factory =
      [&](const graph::DeviceSpec& d) -> tl::expected<std::unique_ptr<Node>, graph::ComposeError> {
    hal::DeviceConfig config{d.id, d.kind, d.driver, d.settings, graph.directory, 1};
    config.plugged = false;
    auto node = hal::make_device(ace_registry().devices, config, process.devices, process.clock);
    if (node) return std::move(*node);
    return tl::make_unexpected(graph::ComposeError{{{d.position, node.error().text()}}, false});
  };
  auto composed = graph::compose(graph, ace_registry(), factory, process.clock, how);
  if (composed) process.composition = std::move(*composed);
  else MESSAGE(graph::to_string(composed.error().problems.front()));
}

void check_equal(const graph::GraphSpec& graph, const Plan& one, const Plan& other) {
  REQUIRE(one.tasks.size() == other.tasks.size());
  for (size_t t = 0; t < one.tasks.size(); ++t) {
    CAPTURE(one.tasks[t].name);
    CHECK(one.tasks[t].source.lag_ns == other.tasks[t].source.lag_ns);
    CHECK(one.tasks[t].source.wait_ns == other.tasks[t].source.wait_ns);
    CHECK(one.tasks[t].source.unknown == other.tasks[t].source.unknown);
  }
  for (size_t p = 0; p < one.ports.size(); ++p) {
    CAPTURE(one.ports[p].node);
    CHECK(one.ports[p].chunk_bytes() == other.ports[p].chunk_bytes());
    CHECK(one.ports[p].chunks() == other.ports[p].chunks());
  }
  CHECK(graph::check(graph, one).json == graph::check(graph, other).json);
}

void check_graph(const char* file, const char* profile) {
  CAPTURE(file);
  CAPTURE(profile);
  const graph::GraphSpec graph = loaded(file, profile, ace_registry());
  const test::TemporaryFolder folder;
  graph::ComposeOptions how;
  how.output = folder.path;
  Process whole;
  compose_in(whole, graph, how);
  const Plan& alone = whole.composition.plan;
  REQUIRE_FALSE(alone.tasks.empty());
  for (const TaskPlan& task : alone.tasks)
    if (task.device && !task.ports.empty()) {
      CAPTURE(task.name);
      CHECK(task.source.unknown == "");
    }
  std::vector<std::string> adjusted;
  const graph::Partition parts = graph::partition(graph, adjusted);
  SharedFacts facts;
  std::vector<Process> processes(parts.names.size());
  {
    std::vector<std::jthread> threads;
    for (size_t p = 0; p < processes.size(); ++p)
      threads.emplace_back([&, p, how]() mutable {
        how.owns = [&, p](const std::string& id) { return parts.process_of.at(id) == p; };
        how.exchange = &facts;
        compose_in(processes[p], graph, how);
      });
  }
  for (const Process& process : processes) check_equal(graph, alone, process.composition.plan);
  const MonotonicClock clock;
  const Registry robot = ace_registry();
  for (const Registry* known : {&robot, &described()}) {
    const graph::GraphSpec of_supervisor = loaded(file, profile, *known);
    graph::Composition supervisor = graph::outline(of_supervisor, *known, clock);
    graph::complete(supervisor.plan, facts, {});
    check_equal(of_supervisor, alone, supervisor.plan);
  }
}

}  // namespace

TEST_CASE("what admission uses of a plan is the same in every process of a run, and in check") {
  check_graph("ace.yaml", "sim");
  check_graph("ace.yaml", "robot");
  check_graph("lasers.yaml", "");
  check_graph("people.yaml", "");
  check_graph("yard.yaml", "");
}
