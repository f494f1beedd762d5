// SPDX-License-Identifier: Apache-2.0
// The latch rule in virtual time against its own sentence, evaluated message by message.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/port_access.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/property_scale.hpp"

namespace {

using namespace takt;
using test::kMs;
constexpr int64_t kStart = 1'000'000'000, kDuration = 3'000 * kMs;

struct Source final : Node {
  Output<Odometry> out{this, "out", ""};
  void setup(Setup&) override {}
  void run(Job& job) override {
    Odometry* message = out.loan();
    REQUIRE(message != nullptr);
    message->x_m = static_cast<double>(job.index());
    out.send(job.release_ns());
  }
};

/// What one job saw: indexes of the latched messages, oldest first, how many of them were new, and staleness.
struct Seen {
  std::vector<int64_t> indexes;
  size_t fresh = 0;
  bool stale = false;
  bool operator==(const Seen&) const = default;
};

struct Sink final : Node {
  Input<Odometry> in{this, "in", ""};
  std::vector<Seen> seen;
  void setup(Setup&) override {}
  void run(Job&) override {
    Seen s;
    for (size_t i = 0; i < in.size(); ++i) {
      s.indexes.push_back(static_cast<int64_t>(in[i].x_m));
      s.fresh += in.is_new(i);
    }
    s.stale = in.stale();
    seen.push_back(s);
  }
};

struct LatchScene {
  TaskPlan producer, consumer;
  uint32_t depth = 1;
  int64_t max_age_ns = 0;
};

LatchScene random_scene(std::mt19937& random) {
  const auto uniform = [&](int64_t low, int64_t high) {
    return std::uniform_int_distribution<int64_t>(low, high)(random);
  };
  LatchScene scene;
  for (TaskPlan* task : {&scene.producer, &scene.consumer}) {
    task->rate = Rate{uniform(1, 40), uniform(1, 3)};
    task->offset_ns = uniform(0, 200 * kMs);
    task->budget_ns = uniform(0, 60 * kMs);
    task->deadline_ns = uniform(60, 120) * kMs;
  }
  scene.producer.publish = uniform(0, 1) == 0 ? PublishAt::asap : PublishAt::let;
  scene.depth = static_cast<uint32_t>(uniform(1, 8));
  scene.max_age_ns = uniform(0, 1) == 0 ? 0 : uniform(1, 400) * kMs;
  return scene;
}

std::vector<Seen> observed(const LatchScene& scene) {
  Source source;
  Sink sink;
  Plan plan;
  plan.tasks = {scene.producer, scene.consumer};
  plan.tasks[0].name = "source";
  plan.tasks[0].node = &source;
  plan.tasks[0].ports = {0};
  plan.tasks[1].name = "sink";
  plan.tasks[1].node = &sink;
  plan.tasks[1].edges = {{0, 0, scene.depth, scene.max_age_ns}};
  PortPlan port;
  port.node = "source";
  port.port = "out";
  port.type = &source.out.type();
  port.history = 64;
  port.held = scene.depth;
  plan.ports.push_back(port);
  PortAccess::connect(sink.in, {});
  VirtualClock clock(kStart);
  const auto transport = make_local_transport(plan.ports);
  Executor(plan, *transport, clock, {kDuration, 0, false}).run();
  return sink.seen;
}

struct Ran {
  int64_t index, release_ns, start_ns, end_ns;
};

/// The jobs of a task that has a CPU of its own: after a late one the last release that has passed is still run, those
/// before it are skipped.
std::vector<Ran> jobs_of(const TaskPlan& task) {
  const auto release = [&](int64_t k) { return task.rate->release_ns(kStart + task.offset_ns, k); };
  std::vector<Ran> jobs;
  int64_t end = 0;
  for (int64_t k = 0; release(k) < kStart + kDuration; ++k) {
    if (release(k + 1) <= end) continue;
    const int64_t start = std::max(release(k), end);
    end = start + task.budget_ns;
    jobs.push_back({k, release(k), start, end});
  }
  return jobs;
}

std::vector<Seen> expected(const LatchScene& scene) {
  const auto& [producer, consumer, depth, max_age] = scene;
  struct Message {
    int64_t index, stamp_ns, visible_at_ns;
  };
  std::vector<Message> messages;
  for (const Ran& job : jobs_of(producer)) {
    const bool let = producer.publish == PublishAt::let;
    messages.push_back(
        {job.index, job.release_ns, let ? std::max(job.end_ns, job.release_ns + producer.deadline_ns) : job.end_ns});
  }
  std::vector<Seen> seen;
  int64_t newest_seen = -1;
  for (const Ran& job : jobs_of(consumer)) {
    Seen s;
    int64_t newest_stamp_ns = 0;
    for (const Message& m : messages) {
      if (m.visible_at_ns > job.release_ns) continue;
      s.indexes.push_back(m.index);
      newest_stamp_ns = m.stamp_ns;
    }
    if (s.indexes.size() > depth) s.indexes.erase(s.indexes.begin(), s.indexes.end() - depth);
    s.fresh = static_cast<size_t>(
        std::count_if(s.indexes.begin(), s.indexes.end(), [&](int64_t i) { return i > newest_seen; }));
    s.stale = s.indexes.empty() || (max_age > 0 && job.start_ns - newest_stamp_ns > max_age);
    if (!s.indexes.empty()) newest_seen = s.indexes.back();
    seen.push_back(s);
  }
  return seen;
}

}  // namespace

TEST_CASE(
    "every job sees the newest messages with visible_at <= its release, whatever the rates, budgets and offsets") {
  std::mt19937 random(test::seed(7));
  for (int round = 0; round < test::rounds(200); ++round) {
    CAPTURE(round);
    const LatchScene scene = random_scene(random);
    const std::vector<Seen> got = observed(scene), wanted = expected(scene);
    REQUIRE(got.size() == wanted.size());
    for (size_t k = 0; k < got.size(); ++k) {
      CAPTURE(k);
      REQUIRE(got[k].indexes == wanted[k].indexes);
      REQUIRE(got[k].fresh == wanted[k].fresh);
      REQUIRE(got[k].stale == wanted[k].stale);
    }
  }
}
