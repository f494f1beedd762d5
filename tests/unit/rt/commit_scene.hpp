// SPDX-License-Identifier: Apache-2.0
// A task with two outputs in virtual time, and readers of both, for tests of what a job makes visible.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/task.hpp"
#include "rt/shm/local_transport.hpp"
#include "tests/unit/rt/epoch.hpp"

namespace takt::test {

/// Sends the number of the job on both outputs, stamped with its release.
struct PairNode final : Node {
  Output<Odometry> a{this, "a", ""}, b{this, "b", ""};
  std::function<void()> work = [] {};
  void setup(Setup&) override {}
  void run(Job& job) override {
    work();
    for (Output<Odometry>* output : {&a, &b}) {
      Odometry* message = output->loan();
      if (message == nullptr) continue;
      message->x_m = static_cast<double>(job.index());
      output->send(job.release_ns());
    }
  }
};

inline constexpr uint32_t kPairHistory = 16;

inline std::vector<PortPlan> pair_ports() {
  std::vector<PortPlan> ports;
  for (const char* name : {"a", "b"})
    ports.push_back({"pair", name, &MessageType::of<Odometry>(), {}, kPairHistory, 8, 8});
  return ports;
}

inline Plan pair_plan(Node& node, OnMiss on_miss = OnMiss::proceed, PublishAt publish = PublishAt::asap) {
  Plan plan;
  plan.ports = pair_ports();
  TaskPlan task;
  task.name = "pair";
  task.node = &node;
  task.rate = Rate{100, 1};
  task.deadline_ns = 8 * kMs;
  task.budget_ns = kMs;
  task.on_miss = on_miss;
  task.publish = publish;
  task.ports = {0, 1};
  plan.tasks = {task};
  return plan;
}

struct SeenMessage {
  uint64_t sequence = 0;
  int64_t job = 0, visible_at_ns = 0;
  bool operator==(const SeenMessage&) const = default;
};

/// The newest `depth` messages for a job released then, newest first.
inline std::vector<SeenMessage> look_at(Reader& reader, int64_t limit_ns, size_t depth = 64) {
  std::vector<Candidate> candidates(depth);
  candidates.resize(reader.list(limit_ns, candidates));
  std::vector<SeenMessage> seen;
  for (const Candidate& candidate : candidates) {
    Held held = reader.take(candidate.sequence);
    if (!held) continue;
    const auto job = static_cast<int64_t>(static_cast<const Odometry*>(held.message())->x_m);
    seen.push_back({candidate.sequence, job, candidate.visible_at_ns});
    reader.release(held);
  }
  return seen;
}

/// The readers of a job that latches both outputs, or, without commits, of an observer.
struct PairReaders {
  std::unique_ptr<Reader> a, b;
  explicit PairReaders(Transport& transport) : a(transport.make_reader(0)), b(transport.make_reader(1)) {}
  PairReaders(Transport& transport, RunBoard& board, const Clock& clock) : PairReaders(transport) {
    for (Reader* reader : {a.get(), b.get()}) reader->set_commits(*board.commits_of_port(0), clock);
  }
};

/// Calls `at` at every step of a message's life while it lives.
class AtEveryStep {
 public:
  using Hook = std::function<void(MessageStep, size_t)>;
  explicit AtEveryStep(Hook hook) {
    current() = std::move(hook);
    at_every_step([](MessageStep step, size_t port) { current()(step, port); });
    obey_orders(&none());
  }
  ~AtEveryStep() {
    obey_orders(nullptr);
    at_every_step(nullptr);
  }
  AtEveryStep(const AtEveryStep&) = delete;
  AtEveryStep& operator=(const AtEveryStep&) = delete;

 private:
  static Hook& current() {
    static Hook hook;
    return hook;
  }
  static KillOrder& none() {
    static KillOrder order;
    return order;
  }
};

}  // namespace takt::test
