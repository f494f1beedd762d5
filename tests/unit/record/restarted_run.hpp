// SPDX-License-Identifier: Apache-2.0
// The small graph in a process that is killed and started again, on virtual time, recorded from another one.
#pragma once
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <memory>
#include <optional>
#include <vector>

#include "rt/record/replayer.hpp"
#include "rt/sched/param_mail.hpp"
#include "rt/shm/kill_order.hpp"
#include "rt/shm/local_transport.hpp"
#include "rt/supervise/nursery.hpp"
#include "tests/unit/record/recorded_run.hpp"

namespace takt::test {

inline constexpr uint32_t kSelf = 1, kVictim = 2;
inline constexpr int64_t kMs = 1'000'000, kEpoch = 1'000 * kMs;
/// So long a process lives at most, if nothing ends it before: what it publishes meanwhile is still there when it is
/// copied.
inline constexpr int64_t kLongestLife = 1'500 * kMs;

struct LongGraph : SmallGraph {
  explicit LongGraph(double gain = 2.0) {
    if (!filter.gain.set(gain)) std::abort();
    for (PortPlan& port : plan.ports) {
      port.history = 64;
      port.held = 16;
      port.readers = 6;
    }
  }
};

struct EpochGate final : StartGate {
  bool all_granted(bool mine) override { return mine; }
  int64_t epoch_ns() override { return kEpoch; }
};

struct Life {
  MessageStep step = MessageStep::none;
  uint32_t port = 0, passes = 0;
  double bias = 0;  ///< > 0: set before it
};

class RestartedRun {
 public:
  RestartedRun(mcap::Sink& sink, record::Recorder::Options how, size_t lives, const record::Head& head = {},
               double gain = 2.0)
      : gain_(gain),
        board_(graph_.plan, 1),
        transport_(make_local_transport(graph_.plan.ports, file_, kSelf)),
        rings_(3 * lives),
        recorder_(graph_.plan, board_, *transport_, sink, head, with_caller(std::move(how))) {
    trace::Collector::Options heard;
    heard.best = trace::Source::none;
    heard.by_caller = true;
    heard.listener = [this](int32_t ring, const trace::Event& event) { recorder_.take(ring, event); };
    collector_.emplace(rings_, heard);
  }
  ~RestartedRun() { munmap(shared_, sizeof(Shared)); }

  /// False if it came to the end of the run.
  bool live(const Life& life) {
    // Refused where the last life did not take the value before.
    if (life.bias > 0) sets_ += post(board_.mail(1), 1, ParamValue(life.bias));
    shared_->order.port.store(life.port);
    shared_->order.passes.store(life.passes);
    shared_->order.step.store(life.step);
    const pid_t child = nursery_.fork_child(0);
    REQUIRE(child > 0);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    const bool killed = WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
    CHECK((killed || (WIFEXITED(status) && WEXITSTATUS(status) == 0)));
    collector_->drain();
    transport_->reclaim(kVictim);
    recorder_.capture();
    shared_->began.store(true);
    return killed;
  }
  uint64_t sets() const { return sets_; }
  record::RecordResult finish() {
    collector_->finish();
    return recorder_.finish({{"epoch_ns", std::to_string(kEpoch)}});
  }

 private:
  /// What the processes share.
  struct Shared {
    KillOrder order;
    std::atomic<int64_t> last_ns{kEpoch};
    std::atomic<bool> began{false};
  };
  static record::Recorder::Options with_caller(record::Recorder::Options how) {
    how.by_caller = true;
    return how;
  }
  static Shared* map() {
    void* memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    REQUIRE(memory != MAP_FAILED);
    return new (memory) Shared;
  }

  /// In the child; never returns, and leaves as a killed one does: nothing is taken down.
  [[noreturn]] void run_child() {
    obey_orders(&shared_->order);
    try {
      LongGraph graph(gain_);
      const int64_t from_ns = shared_->last_ns.load() + (shared_->began ? 150 * kMs : 0);
      VirtualClock clock(from_ns);
      const auto transport = join_local_transport(graph.plan.ports, file_, kVictim);
      EpochGate gate;
      Executor::Options how;
      how.board = &board_;
      how.trace = &rings_;
      how.gate = &gate;
      how.rejoin = shared_->began;
      how.after_step = [&] {
        shared_->last_ns.store(clock.now_ns());
        if (clock.now_ns() > from_ns + kLongestLife) raise(SIGKILL);
      };
      Executor(graph.plan, *transport, clock, how).run();
      _exit(0);
    } catch (...) {
    }
    _exit(1);
  }

  const double gain_;
  LongGraph graph_;
  RunBoard board_;
  PoolFile file_{kVictim};
  std::unique_ptr<Transport> transport_;
  Shared* shared_ = map();
  trace::Rings rings_;
  /// Before the recorder has its thread, which may hold a lock of the allocator at a fork.
  Nursery nursery_{[this](size_t) -> int { run_child(); }};
  record::Recorder recorder_;
  std::optional<trace::Collector> collector_;
  uint64_t sets_ = 0;
};

/// The nodes of a replay, which are renewed.
struct Renewable {
  explicit Renewable(double gain = 2.0) : gain(gain), graph(gain) {}
  const double gain;
  LongGraph graph;
  std::vector<std::unique_ptr<LongGraph>> fresh;
  void renew(size_t task) {
    fresh.push_back(std::make_unique<LongGraph>(gain));
    graph.plan.tasks[task].node = fresh.back()->plan.tasks[task].node;
  }
  /// For Replayer; what it refers to is this.
  record::Replayer::Options options() {
    record::Replayer::Options how;
    how.epoch_ns = kEpoch;
    how.renew = [this](size_t task) { renew(task); };
    return how;
  }
};

}  // namespace takt::test
