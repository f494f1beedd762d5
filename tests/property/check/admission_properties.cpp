// SPDX-License-Identifier: Apache-2.0
// What admission proves of a plan against what a run of it does: random plans with lanes, `let`, `every`, modes, and
// each policy, run by the executor in virtual time with phases and execution times of many kinds.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdio>
#include <deque>
#include <random>

#include "graph/check/check.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/shm/local_transport.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/property_scale.hpp"

namespace {

using namespace takt;
using namespace takt::graph;

using test::kMs;
constexpr int64_t kEpoch = 1'000 * kMs;

struct Random {
  std::mt19937 engine;
  int64_t uniform(int64_t low, int64_t high) { return std::uniform_int_distribution<int64_t>(low, high)(engine); }
  bool chance(double p) { return std::bernoulli_distribution(p)(engine); }
};

/// Hands on the stamp of what it has; without an input it is where the stamps come from. Its first jobs may make
/// nothing: which of them an `every`-th one follows depends on that.
struct Relay final : Node {
  Input<Odometry> in{this, "in", "", Need::optional};
  Output<Odometry> out{this, "out", ""};
  bool source = false;
  uint64_t silent_jobs = 0;
  void setup(Setup&) override {}
  void run(Job& job) override {
    if (job.index() < silent_jobs || (!source && in.empty())) return job.no_result();
    if (out.loan() == nullptr) return job.no_result();
    out.send(source ? job.release_ns() : in.stamp_ns());
  }
};

struct Scene {
  Plan plan;
  GraphSpec graph;
  std::deque<Relay> nodes;

  void add(Random& random) {
    constexpr int64_t kRates[] = {5, 10, 20, 40};  // one common period of 200 ms
    Relay& node = nodes.emplace_back();
    const size_t index = plan.tasks.size();
    TaskPlan task;
    task.name = "n" + std::to_string(index);
    task.node = &node;
    task.criticality = random.chance(0.5) ? Criticality::high : Criticality::low;
    task.ports = {index};
    task.device = node.source = index == 0;
    if (index > 0) {
      const auto producer = static_cast<size_t>(random.uniform(0, static_cast<int64_t>(index) - 1));
      task.edges = {{0, producer, 1, 0}};
      PortAccess::connect(node.in, {});
      if (random.chance(0.3)) {
        task.on_task = task.on_port = producer;
        task.every = static_cast<int>(random.uniform(1, 2));
      }
    }
    if (task.on_task == kNone) {
      task.rate = Rate{kRates[random.uniform(0, 3)], 1};
    }
    if (random.chance(0.25)) task.publish = PublishAt::let;
    PortPlan port;
    port.node = task.name;
    port.port = "out";
    port.type = &node.out.type();
    port.history = 24;
    port.held = 8;
    plan.ports.push_back(port);
    plan.tasks.push_back(std::move(task));
  }

  /// Other phases of all; in one of four cases they begin together, but for a hair: a bound holds for whoever goes
  /// first.
  void shift(Random& random) {
    constexpr int64_t kHair = 1'000;  // the shortest jobs take a thousandth of it
    const bool together = random.chance(0.25);
    for (TaskPlan& task : plan.tasks) {
      if (!task.rate) continue;
      const int64_t phase = together ? 0 : random.uniform(0, task.rate->period_ns() / kMs - 1);
      task.offset_ns = phase * kMs + random.uniform(0, 2) * kHair;
    }
  }

  /// Budgets and deadlines that have a fair chance.
  void time(Random& random) {
    const auto cores = static_cast<double>(plan.cores.size()), count = static_cast<double>(plan.tasks.size());
    for (size_t t = 0; t < plan.tasks.size(); ++t) {
      TaskPlan& task = plan.tasks[t];
      const auto period = static_cast<int64_t>(1e9 / effective_rate_hz(plan, t));
      const double share = cores * std::uniform_real_distribution(0.2, 0.9)(random.engine) / count;
      task.budget_ns = std::max<int64_t>(kMs / 10, static_cast<int64_t>(share * static_cast<double>(period)));
      const int64_t most = task.on_task == kNone ? period : period / 2;
      task.deadline_ns = std::max(task.budget_ns, random.uniform(most / 3, most) / 1000 * 1000);
    }
  }
};

Scene random_scene(Random& random) {
  Scene scene;
  scene.plan.policy = static_cast<Policy>(random.uniform(0, 2));
  scene.plan.cores = random.chance(0.6) ? std::vector<int>{0} : std::vector<int>{0, 1};
  for (int64_t n = random.uniform(2, 6); n > 0; --n) scene.add(random);
  scene.shift(random);
  scene.time(random);
  for (size_t t = 1; t < scene.plan.tasks.size(); ++t)
    scene.graph.chains.push_back(
        {"to " + scene.plan.tasks[t].name, {"n0", "out"}, {scene.plan.tasks[t].name, "out"}, 3'600'000 * kMs, {}});
  if (random.chance(0.3)) {  // in a mode without the last task, and who follows it
    scene.plan = without(scene.plan, {scene.plan.tasks.back().name});
    scene.plan.mode = "less";
  }
  return scene;
}

struct Seen {
  std::vector<int64_t> response_ns, age_ns;  ///< the longest by task, and by its port
};

/// How long jobs take, of their budgets.
enum class Use : uint8_t { all, any, all_or_nothing };

/// Several common periods and the longest way through.
Seen seen_in(const Plan& plan, Use use, Random& random) {
  for (const TaskPlan& task : plan.tasks)  // not all for as long: who has nothing to hand on is silent, too
    dynamic_cast<Relay&>(*task.node).silent_jobs =
        static_cast<uint64_t>(random.uniform(0, task.rate ? 3 * task.rate->numerator / 5 : 3));
  VirtualClock clock(kEpoch);
  RunBoard board(plan);
  const auto transport = make_local_transport(plan.ports);
  Executor::Options options;
  options.duration_ns = 1'400 * kMs;
  options.board = &board;
  options.job_duration_ns = [&](size_t task, uint64_t) {
    const int64_t budget = plan.tasks[task].budget_ns;
    switch (use) {
      case Use::all: break;
      case Use::any: return random.uniform(1, budget);
      case Use::all_or_nothing: return random.chance(0.6) ? budget : 1;
    }
    return budget;
  };
  Executor(plan, *transport, clock, options).run();
  Seen seen;
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    seen.response_ns.push_back(board.task(t).response.max_ns());
    seen.age_ns.push_back(board.port(plan.tasks[t].ports[0]).age.max_ns());
  }
  return seen;
}

/// The worst of many runs.
Seen worst_of(const Plan& plan, Random& random) {
  constexpr int kRuns[] = {6, 4, 6};  // by Use
  Seen worst{std::vector<int64_t>(plan.tasks.size()), std::vector<int64_t>(plan.tasks.size())};
  for (const Use use : {Use::all, Use::any, Use::all_or_nothing}) {
    for (int run = 0; run < kRuns[static_cast<size_t>(use)]; ++run) {
      const Seen other = seen_in(plan, use, random);
      for (size_t t = 0; t < plan.tasks.size(); ++t) {
        worst.response_ns[t] = std::max(worst.response_ns[t], other.response_ns[t]);
        worst.age_ns[t] = std::max(worst.age_ns[t], other.age_ns[t]);
      }
    }
  }
  return worst;
}

/// The longest by task, of several runs or proofs.
void raise(std::vector<int64_t>& longest, size_t task, int64_t ns) { longest[task] = std::max(longest[task], ns); }

/// Whether a worker waits within a lane (`let` before a follower), or a member is not in every pass (`every`).
bool in_pieces(const Plan& plan) {
  return std::any_of(plan.tasks.begin(), plan.tasks.end(), [&](const TaskPlan& task) {
    return task.on_task != kNone && (task.every > 1 || plan.tasks[task.on_task].publish == PublishAt::let);
  });
}

/// A bound is far from what was seen if it is more than so many times that.
constexpr double kFar = 2;

struct Tally {
  double largest = 0, sum = 0;
  int count = 0, far = 0;
  void add(int64_t bound_ns, int64_t seen_ns) {
    if (seen_ns <= 0) return;
    const double ratio = static_cast<double>(bound_ns) / static_cast<double>(seen_ns);
    largest = std::max(largest, ratio);
    sum += ratio;
    ++count;
    far += ratio > kFar;
  }
  void print(const char* what) const {
    std::printf("%s: bound / observed %.3f on average, at most %.3f, above %.0f for %d of %d\n", what, sum / count,
                largest, kFar, far, count);
  }
};

/// One scene under several phases: the longest that was proved and seen under any of them.
struct Compared {
  Seen bound, seen;
  int admitted = 0;

  explicit Compared(size_t tasks) {
    for (Seen* each : {&bound, &seen}) each->response_ns.resize(tasks), each->age_ns.resize(tasks);
  }

  /// Whether a bound of a response is far from what was seen so far.
  bool far() const {
    for (size_t t = 0; t < bound.response_ns.size(); ++t)
      if (static_cast<double>(bound.response_ns[t]) > kFar * static_cast<double>(seen.response_ns[t])) return true;
    return false;
  }

  void compare(const Scene& scene, Random& random) {
    const Plan& plan = scene.plan;
    const Admission admission = admit(plan, {});
    if (admission.answer != Answer::admitted) return;
    ++admitted;
    const Seen worst = worst_of(plan, random);
    for (size_t t = 0; t < plan.tasks.size(); ++t) {
      CAPTURE(plan.tasks[t].name);
      REQUIRE(admission.nodes[t].response_ns);
      const int64_t proven = *admission.nodes[t].response_ns;
      REQUIRE(worst.response_ns[t] <= proven);
      REQUIRE(proven <= plan.tasks[t].deadline_ns);
      raise(bound.response_ns, t, proven);
      raise(seen.response_ns, t, worst.response_ns[t]);
    }
    for (const AgeBound& age : age_bounds(scene.graph, plan, admission.nodes)) {
      CAPTURE(age.name);
      const auto to = std::find_if(plan.tasks.begin(), plan.tasks.end(),
                                   [&](const TaskPlan& task) { return age.name == "to " + task.name; });
      const auto t = static_cast<size_t>(to - plan.tasks.begin());
      REQUIRE(age.bound_ns);
      REQUIRE(worst.age_ns[t] <= *age.bound_ns);
      raise(bound.age_ns, t, *age.bound_ns);
      raise(seen.age_ns, t, worst.age_ns[t]);
    }
  }
};

}  // namespace

TEST_CASE("what a run does stays within what admission proved, and is not far from it") {
  // What few phases allow, few were seen of; and two lanes may meet in few of all phases: where a bound looks far, more
  // of them are tried before it counts as far.
  constexpr int kPhases = 8, kMorePhases = 64, kTries = 100;
  Random random{std::mt19937(test::seed(70))};
  Tally one_core, pieces, more_cores, ages;
  int admitted[3] = {};
  for (int round = 0; round < test::rounds(200); ++round) {
    CAPTURE(round);
    Scene scene = random_scene(random);
    const Plan& plan = scene.plan;
    CAPTURE(to_string(plan.policy));
    Compared compared(plan.tasks.size());
    const auto enough = [&] { return compared.admitted >= (compared.far() ? kMorePhases : kPhases); };
    for (int phase = 0; phase < kTries && !enough(); ++phase) {
      CAPTURE(phase);
      if (phase > 0) scene.shift(random);
      compared.compare(scene, random);
    }
    admitted[static_cast<size_t>(plan.policy)] += compared.admitted;
    for (size_t t = 0; t < plan.tasks.size(); ++t) {
      (plan.cores.size() > 1 ? more_cores
       : in_pieces(plan)     ? pieces
                             : one_core)
          .add(compared.bound.response_ns[t], compared.seen.response_ns[t]);
      ages.add(compared.bound.age_ns[t], compared.seen.age_ns[t]);
    }
  }
  std::printf("admitted: deadline %d, fixed %d, cooperative %d\n", admitted[0], admitted[1], admitted[2]);
  one_core.print("response, one core");
  pieces.print("response, one core, beside lanes that wait within or do not always do all");
  more_cores.print("response, two cores");
  ages.print("age of a chain");
  for (const int plans : admitted) CHECK(plans >= test::at_scale(60));
  CHECK(one_core.largest <= kFar);
  CHECK(pieces.largest <= kFar);
  CHECK(ages.largest <= 3);
}
