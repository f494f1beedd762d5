// SPDX-License-Identifier: Apache-2.0
// One commit per job, in real time: commits [JOBS] [SEED]
// Two processes with four producers of pairs (asap and let, on_miss continue, skip and reuse_last) and four consumers
// that latch two pairs each, of their own process and of the other one, JOBS jobs in all (default 100000). At random
// steps between the last payload and the end of a publication the producers sleep for up to 1.5 ms. An observer notes
// every message with its visible_at. Prints one line. Exit 1 if a job did not latch the newest messages with visible_at
// <= its release, if it saw two outputs of one job apart, if late publications and deadline misses differ, or if too
// little was compared.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>
#include <random>
#include <thread>
#include <vector>

#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/shm/follower.hpp"
#include "rt/shm/local_transport.hpp"

namespace {

using namespace takt;

constexpr int64_t kMs = 1'000'000;
constexpr size_t kProducers = 4, kConsumers = 4, kPairs = 2;  // pairs that a consumer latches
constexpr int64_t kProducerHz = 250, kConsumerHz = 400;
constexpr int64_t kDeadline_ns = 2 * kMs;
/// Of consumer c: half of them in its own process.
constexpr std::array<std::array<size_t, kPairs>, kConsumers> kReads = {{{0, 2}, {1, 3}, {0, 3}, {1, 2}}};

void pause(int64_t ns) {
  const timespec rest{0, ns};
  nanosleep(&rest, nullptr);
}

struct Pair final : Node {
  Output<Odometry> a{this, "a", ""}, b{this, "b", ""};
  void setup(Setup&) override {}
  void run(Job& job) override {
    for (Output<Odometry>* output : {&a, &b}) {
      Odometry* message = output->loan();
      if (message == nullptr) continue;
      message->x_m = static_cast<double>(job.index());
      output->send(job.release_ns());
    }
  }
};

/// What a job latched: of each pair the numbers of the jobs that made `a` and `b`; -1: nothing.
struct Latched {
  int64_t release_ns = 0;
  std::array<std::array<int64_t, 2>, kPairs> pairs{};
};

/// Of one consumer, where both processes see it.
struct Notes {
  std::atomic<uint64_t> count{0};
  std::array<Latched, 1'000'000> jobs;
};

struct Consumer final : Node {
  Input<Odometry> a0{this, "a0", ""}, b0{this, "b0", ""}, a1{this, "a1", ""}, b1{this, "b1", ""};
  Notes* notes = nullptr;
  void setup(Setup&) override {}
  void run(Job& job) override {
    const auto made_by = [](const Input<Odometry>& input) {
      return input.newest() != nullptr ? static_cast<int64_t>(input.newest()->x_m) : -1;
    };
    const uint64_t n = notes->count.load();
    if (n == notes->jobs.size()) return;
    notes->jobs[n] = {job.release_ns(), {{{made_by(a0), made_by(b0)}, {made_by(a1), made_by(b1)}}}};
    notes->count.store(n + 1);
  }
};

/// What both processes share besides the board and the pools.
struct Common {
  std::atomic<uint64_t> sleeps{0};
  std::array<Notes, kConsumers> notes;
};

template <class T>
T* shared() {
  void* memory = mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) std::abort();
  return ::new (memory) T;
}

Common* common = nullptr;
std::atomic<uint32_t> seed{1};

void sleep_at(MessageStep step, size_t) {
  if (step != MessageStep::inside_publish && step != MessageStep::after_publish && step != MessageStep::inside_commit &&
      step != MessageStep::after_commit)
    return;
  thread_local std::mt19937 random(seed.fetch_add(1));
  if (random() % 24 != 0) return;
  common->sleeps.fetch_add(1);
  pause(static_cast<int64_t>(random() % 1'500'000));
}

struct Graph {
  std::array<Pair, kProducers> producers;
  std::array<Consumer, kConsumers> consumers;
  Plan plan;

  Graph() {
    for (size_t p = 0; p < kProducers; ++p) add_producer(p);
    for (size_t c = 0; c < kConsumers; ++c) add_consumer(c);
    plan.cores = {0, 0, 0, 0};  // so many workers: one that sleeps holds up no other task
    plan.anticipate_ns = kDefaultAnticipate_ns;
  }
  static bool own(size_t task, size_t process) { return task % 2 == process; }

 private:
  void add_producer(size_t p) {
    TaskPlan task;
    task.name = "pair" + std::to_string(p);
    task.node = &producers[p];
    task.rate = Rate{kProducerHz, 1};
    task.offset_ns = static_cast<int64_t>(p) * kMs;
    task.deadline_ns = kDeadline_ns;
    task.publish = p == 1 ? PublishAt::let : PublishAt::asap;
    task.on_miss = p == 2 ? OnMiss::skip : p == 3 ? OnMiss::reuse_last : OnMiss::proceed;
    for (OutputPort* output : producers[p].outputs()) {
      task.ports.push_back(plan.ports.size());
      PortAccess::mark_read(*output);
      plan.ports.push_back({task.name, std::string(output->name()), &output->type(), {}, 512, 8, 4});
    }
    plan.tasks.push_back(task);
  }
  void add_consumer(size_t c) {
    TaskPlan task;
    task.name = "consumer" + std::to_string(c);
    task.node = &consumers[c];
    task.rate = Rate{kConsumerHz, 1};
    task.offset_ns = static_cast<int64_t>(c) * 300'000;
    task.deadline_ns = kDeadline_ns;
    for (size_t i = 0; i < 2 * kPairs; ++i) {
      task.edges.push_back({i, kReads[c][i / 2] * 2 + i % 2});
      PortAccess::connect(*consumers[c].inputs()[i], {});
    }
    consumers[c].notes = &common->notes[c];
    plan.tasks.push_back(task);
  }
};

class Gate final : public StartGate {
 public:
  explicit Gate(int64_t epoch_ns) : epoch_ns_(epoch_ns) {}
  bool all_granted(bool mine) override { return mine; }
  int64_t epoch_ns() override { return epoch_ns_; }

 private:
  const int64_t epoch_ns_;
};

/// One process of the run. `finish` is called when it has ended, and what it published is still there.
template <class Finish>
void run_part(const Graph& graph, Transport& transport, RunBoard& board, int64_t epoch_ns, int64_t duration_ns,
              size_t process, const Finish& finish) {
  static KillOrder none;
  obey_orders(&none);
  at_every_step(sleep_at);
  MonotonicClock clock;
  Gate gate(epoch_ns);
  Executor::Options options;
  options.duration_ns = duration_ns;
  options.board = &board;
  options.gate = &gate;
  for (size_t t = 0; t < graph.plan.tasks.size(); ++t) options.own.push_back(Graph::own(t, process));
  Executor executor(graph.plan, transport, clock, options);
  executor.run();
  finish();
}

struct Message {
  int64_t job = 0, visible_at_ns = 0;
  bool operator==(const Message&) const = default;
};

/// Notes all that is published, in order.
class Observer {
 public:
  Observer(const Plan& plan, Transport& transport) : messages(plan.ports.size()) {
    for (size_t p = 0; p < plan.ports.size(); ++p) followers_.emplace_back(transport.make_reader(p));
  }
  void take() {
    for (size_t p = 0; p < messages.size(); ++p)
      gone += followers_[p].take([&](const Held& held) {
        messages[p].push_back(
            {static_cast<int64_t>(static_cast<const Odometry*>(held.message())->x_m), held.visible_at_ns});
      });
  }
  std::vector<std::vector<Message>> messages;  ///< by port
  uint64_t gone = 0;

 private:
  std::vector<Follower> followers_;
};

struct Verdict {
  uint64_t jobs = 0, broken = 0, torn = 0, late = 0, missed = 0, apart = 0, wrong_counts = 0;
};

void judge_consumer(size_t c, const Observer& observer, Verdict& verdict) {
  const Notes& notes = common->notes[c];
  for (uint64_t n = 0; n < notes.count.load(); ++n) {
    const Latched& latched = notes.jobs[n];
    ++verdict.jobs;
    bool broken = false, torn = false;
    for (size_t i = 0; i < kPairs; ++i) {
      for (size_t out = 0; out < 2; ++out) {
        const std::vector<Message>& all = observer.messages[kReads[c][i] * 2 + out];
        const auto later = std::partition_point(
            all.begin(), all.end(), [&](const Message& m) { return m.visible_at_ns <= latched.release_ns; });
        broken |= latched.pairs[i][out] != (later == all.begin() ? -1 : (later - 1)->job);
      }
      torn |= latched.pairs[i][0] != latched.pairs[i][1];
    }
    verdict.broken += broken;
    verdict.torn += torn;
  }
}

/// Late messages and misses of a producer, which must agree.
void judge_producer(size_t p, const Graph& graph, const RunBoard& board, const Observer& observer, int64_t epoch_ns,
                    Verdict& verdict) {
  const TaskPlan& task = graph.plan.tasks[p];
  const std::vector<Message>& messages = observer.messages[p * 2];
  verdict.apart += messages != observer.messages[p * 2 + 1];
  uint64_t late = 0, own = 0;
  int64_t newest = -1;
  for (const Message& message : messages) {
    if (std::exchange(newest, message.job) == message.job) continue;  // a former one again
    ++own;
    const int64_t release_ns = task.rate->release_ns(epoch_ns + task.offset_ns, message.job);
    late += message.visible_at_ns > release_ns + task.deadline_ns;
  }
  const TaskStatistics& counts = board.task(p);
  verdict.late += late;
  verdict.missed += counts.deadline_misses.load();
  const bool withholds = task.on_miss == OnMiss::skip || task.on_miss == OnMiss::reuse_last;
  verdict.wrong_counts += late != (withholds ? 0 : counts.deadline_misses.load()) || own != counts.completed.load();
}

}  // namespace

int main(int argc, char** argv) {
  const int64_t jobs = argc > 1 ? std::atoll(argv[1]) : 100'000;
  seed = argc > 2 ? static_cast<uint32_t>(std::atoll(argv[2])) : 1;
  common = shared<Common>();
  const Graph graph;
  RunBoard board(graph.plan, 2);
  const PoolFile file;
  const auto transport = make_local_transport(graph.plan.ports, file, 1);
  const MonotonicClock clock;
  const int64_t epoch_ns = clock.now_ns() + 200 * kMs;
  // A tenth more than asked for: releases that pass while a job is late are skipped.
  const int64_t duration_ns = jobs * 1'100'000'000 / (static_cast<int64_t>(kConsumers) * kConsumerHz);
  const pid_t child = fork();
  if (child == 0) {
    seed += 1'000;
    const auto joined = join_local_transport(graph.plan.ports, file, 2);
    run_part(graph, *joined, board, epoch_ns, duration_ns, 1, [&] {
      board.process(1).state.store(ProcessRecord::finished);
      while (!board.dismissed().load()) pause(kMs);
    });
    _exit(0);
  }
  Observer observer(graph.plan, *transport);
  std::atomic<bool> ended{false};
  std::thread observing([&] {
    while (!ended.load()) {
      observer.take();
      pause(kMs);
    }
    observer.take();
  });
  int status = 0;
  run_part(graph, *transport, board, epoch_ns, duration_ns, 0, [&] {
    while (board.process(1).state.load() != ProcessRecord::finished && waitpid(child, &status, WNOHANG) == 0)
      pause(kMs);
    ended.store(true);
    observing.join();
    board.dismissed().store(true);
  });
  if (waitpid(child, &status, 0) == child && status != 0) std::fprintf(stderr, "the second process died\n");
  Verdict verdict;
  for (size_t c = 0; c < kConsumers; ++c) judge_consumer(c, observer, verdict);
  for (size_t p = 0; p < kProducers; ++p) judge_producer(p, graph, board, observer, epoch_ns, verdict);
  const unsigned long sleeps = common->sleeps.load();
  std::printf(
      "commits: %lu jobs: %lu broke the latch rule, %lu saw a pair apart; %lu deadline misses, %lu late messages, %lu "
      "of "
      "4 producers counted wrongly, %lu published a pair apart; %lu sleeps, %lu messages not observed\n",
      verdict.jobs, verdict.broken, verdict.torn, verdict.missed, verdict.late, verdict.wrong_counts, verdict.apart,
      sleeps, observer.gone);
  const bool enough = verdict.jobs >= static_cast<uint64_t>(jobs) && sleeps > verdict.jobs / 50 && verdict.late > 0;
  if (!enough) std::printf("commits: too little was compared\n");
  const bool right = verdict.broken + verdict.torn + verdict.wrong_counts + verdict.apart + observer.gone == 0;
  return right && enough && status == 0 ? 0 : 1;
}
