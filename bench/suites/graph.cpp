// SPDX-License-Identifier: Apache-2.0
// Ten nodes, seven hops, 15 Hz, empty work: from the source's publication to the sink's job start, and CPU per frame.
// In one process against threads with bare futexes, as ten processes against raw iceoryx, and next to what others
// offer. All contestants of a course take turns frame by frame: each has its own phase of the 15 Hz period.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <numeric>
#include <optional>
#include <random>

#include "bench/instants.hpp"
#include "bench/peers/rung_graph.hpp"
#include "bench/peers/takt_executor.hpp"
#include "bench/suite.hpp"
#include "rt/shm/iceoryx_transport.hpp"

namespace takt::bench {

std::vector<Row> run_graph(const Options& options);

namespace {

constexpr uint32_t kSizes[] = {128, 921'600};
constexpr int kFramesPerRound = 15;
constexpr int64_t kPeriodNs = 1'000'000'000 / 15;
constexpr int kPriority = 80;  // what Takt's executor takes for its first lane

struct Condition {
  std::string name;
  Reservation reservation;
};

/// All samples of a contestant, and per round its median and its CPU time per frame (us).
struct Measured {
  Samples latency_us;
  std::vector<double> median_us, cpu_us;
  void add_round(const std::vector<double>& latencies_us, int64_t cpu_ns) {
    if (latencies_us.empty()) return;  // given up: no later round has any
    Samples round;
    round.add(latencies_us);
    latency_us.add(latencies_us);
    median_us.push_back(*round.quantile(0.5));
    cpu_us.push_back(static_cast<double>(cpu_ns) * 1e-3 / static_cast<double>(latencies_us.size()));
  }
};

/// Contestants that are rung, each once in a period.
class Turns {
 public:
  /// The period has as many slots as contestants and `first_slot` more, which are left free. `locked`: somebody else
  /// keeps the same 15 Hz and must not be met, so a late frame moves the rest by whole periods; otherwise by its
  /// lateness.
  Turns(std::vector<std::unique_ptr<RungGraph>>& graphs, size_t first_slot, bool locked, int64_t epoch_ns)
      : graphs_(graphs),
        first_slot_(first_slot),
        locked_(locked),
        step_ns_(kPeriodNs / static_cast<int64_t>(graphs.size() + first_slot)),
        base_ns_(epoch_ns),
        order_(graphs.size()) {
    std::iota(order_.begin(), order_.end(), size_t{0});
  }

  int64_t base_ns() const { return base_ns_; }

  /// One round; latencies and CPU time go to `out`, one entry per contestant.
  void run_round(std::vector<Measured>& out) {
    std::vector<std::vector<double>> latencies_us(graphs_.size());
    std::vector<int64_t> cpu_ns;
    for (const auto& graph : graphs_) cpu_ns.push_back(graph->cpu_ns());
    for (int frame = 0; frame < kFramesPerRound; ++frame) {
      std::shuffle(order_.begin(), order_.end(), random_);
      for (size_t slot = 0; slot < order_.size(); ++slot)
        if (const auto taken = run_slot(slot)) latencies_us[order_[slot]].push_back(static_cast<double>(*taken) * 1e-3);
      base_ns_ += kPeriodNs;
    }
    for (size_t i = 0; i < graphs_.size(); ++i) out[i].add_round(latencies_us[i], graphs_[i]->cpu_ns() - cpu_ns[i]);
  }

 private:
  std::optional<int64_t> run_slot(size_t slot) {
    RungGraph& graph = *graphs_[order_[slot]];
    if (graph.given_up()) return std::nullopt;
    const auto phase = static_cast<int64_t>(slot + first_slot_) * step_ns_;
    const int64_t late = now_ns() - base_ns_ - phase;
    if (late > step_ns_ / 4) base_ns_ += locked_ ? (late + kPeriodNs - 1) / kPeriodNs * kPeriodNs : late;
    sleep_until(base_ns_ + phase);
    graph.send();
    sleep_until(base_ns_ + phase + step_ns_ * 3 / 4);  // off the CPU that the nodes may need
    return graph.taken_ns();
  }

  std::vector<std::unique_ptr<RungGraph>>& graphs_;
  const size_t first_slot_;
  const bool locked_;
  const int64_t step_ns_;
  int64_t base_ns_;
  std::vector<size_t> order_;
  std::mt19937 random_{1};
};

/// The calling thread is the coordinator: it must be on time and is no part of any figure. Ends with the scope, since
/// threads and processes would inherit it.
class Punctual {
 public:
  Punctual() {
    Reservation reservation;
    reservation.policy = Policy::fixed;
    reservation.priority = kPriority + 5;
    apply(reservation);
  }
  Punctual(const Punctual&) = delete;
  Punctual& operator=(const Punctual&) = delete;
  ~Punctual() { apply_default(); }
};

/// Rows of one contestant against the reference of its course.
void add_rows(std::vector<Row>& rows, const std::string& what, const std::string& variant, const Measured& measured,
              const std::string& reference, const Measured& reference_measured, const std::string& granted) {
  const auto add = [&](const std::string& figure, Samples samples, const std::vector<double>& values,
                       const std::vector<double>& reference_values) {
    Pairs pairs;
    for (size_t round = 0; round < values.size() && round < reference_values.size(); ++round) {
      pairs.add_a(reference_values[round]);
      pairs.add_b(values[round]);
    }
    add_pair(rows, {"graph/" + what + "/" + figure + "_" + variant, "us", 0, std::move(samples), {}, {}, {}, granted},
             reference, pairs);
  };
  Samples cpu;
  cpu.add(measured.cpu_us);
  add("latency", measured.latency_us, measured.median_us, reference_measured.median_us);
  add("cpu_per_frame", std::move(cpu), measured.cpu_us, reference_measured.cpu_us);
}

/// What every course does with those that could not start: the measured pair must be there, a peer may fail.
void drop_failed(std::vector<std::unique_ptr<RungGraph>>& graphs, size_t needed) {
  for (size_t i = graphs.size(); i-- > 0;) {
    if (graphs[i]->settle()) continue;
    if (i < needed) throw CannotRun(graphs[i]->name() + " did not start");
    std::fprintf(stderr, "peer %s: did not start here; left out\n", graphs[i]->name().c_str());
    graphs.erase(graphs.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void in_process(uint32_t bytes, const Condition& condition, int rounds, std::vector<Row>& rows) {
  const GraphShape shape = chain10();
  std::vector<std::unique_ptr<RungGraph>> graphs;
  const auto add = [&](const std::string& name, std::unique_ptr<Medium> medium) {
    graphs.push_back(
        std::make_unique<RungGraph>(name, std::move(medium), shape, RungGraph::Place::threads, condition.reservation));
  };
  const auto plan = [&](const std::string& name) { return MediumPlan{shape, bytes, name + std::to_string(bytes)}; };
  add("futex_threads", make_futex(plan("a")));
  add("futex_threads_null", make_futex(plan("b")));
  for (const Peer& peer : peers())
    if (peer.threads != nullptr) add(peer.name + "_inproc", peer.threads(plan(peer.name)));
#ifdef TAKT_BENCH_ONETBB
  graphs.push_back(std::make_unique<RungGraph>("onetbb_flow_graph", onetbb_runner(shape, bytes, condition.reservation),
                                               condition.reservation));
#endif
  for (auto& graph : graphs) graph->start();
  drop_failed(graphs, 2);

  TaktExecutor takt(shape, bytes, condition.reservation);
  constexpr int kWarmUpFrames = 20;
  Turns turns(graphs, 1, true, takt.start() + kWarmUpFrames * kPeriodNs);
  auto punctual = std::make_optional<Punctual>();
  std::vector<Measured> measured(graphs.size());
  std::vector<int64_t> starts, cpu_ns;
  const auto note_boundary = [&] {
    // Half a slot before its frame, when the worker sleeps.
    const int64_t boundary = turns.base_ns() - kPeriodNs / 2 / static_cast<int64_t>(graphs.size() + 1);
    sleep_until(boundary);
    starts.push_back(boundary);
    cpu_ns.push_back(takt.cpu_ns());
  };
  note_boundary();
  for (int round = 0; round < rounds; ++round) {
    turns.run_round(measured);
    note_boundary();
  }
  punctual.reset();
  takt.stop();
  Measured ours;
  for (size_t round = 0; round + 1 < starts.size(); ++round)
    ours.add_round(takt.latencies_us(starts[round], starts[round + 1]), cpu_ns[round + 1] - cpu_ns[round]);

  const std::string course = "chain10_in_process/", variant = std::to_string(bytes) + "_" + condition.name;
  add_rows(rows, course + "takt", variant, ours, graphs[0]->name(), measured[0], takt.granted());
  for (size_t i = 1; i < graphs.size(); ++i)
    add_rows(rows, course + graphs[i]->name(), variant, measured[i], graphs[0]->name(), measured[0],
             graphs[i]->granted());
}

void processes(uint32_t bytes, const Condition& condition, int rounds, std::vector<Row>& rows) {
  const GraphShape shape = chain10();
  std::vector<std::string> names{"iceoryx", "iceoryx_null", "takt", "takt_local"};
  std::vector<std::unique_ptr<Medium>> media;
  const auto plan = [&](const std::string& name) {
    return MediumPlan{shape, bytes, name + "_" + std::to_string(getpid()) + "_" + std::to_string(bytes)};
  };
  media.push_back(make_iceoryx(plan("iox_a")));
  media.push_back(make_iceoryx(plan("iox_b")));
  media.push_back(make_takt(plan("takt")));
  media.push_back(make_takt_local(plan("takt_local")));
  for (const Peer& peer : peers()) {
    if (peer.processes == nullptr) continue;
    names.push_back(peer.name);
    media.push_back(peer.processes(plan(peer.name)));
  }
  const std::vector<PortPlan> pools = serve(media);
  std::unique_ptr<Transport> daemon;  // outlives the processes
  std::vector<std::unique_ptr<RungGraph>> graphs;
  for (size_t i = 0; i < media.size(); ++i)
    graphs.push_back(std::make_unique<RungGraph>(names[i], std::move(media[i]), shape, RungGraph::Place::processes,
                                                 condition.reservation));
  daemon = make_iceoryx_transport(pools);
  for (auto& graph : graphs) graph->start();
  drop_failed(graphs, 4);

  Turns turns(graphs, 0, false, now_ns() + 20'000'000);
  std::vector<Measured> measured(graphs.size());
  {
    const Punctual punctual;
    for (int round = 0; round < rounds; ++round) turns.run_round(measured);
  }
  for (size_t i = 1; i < graphs.size(); ++i)
    add_rows(rows, "chain10_processes/" + graphs[i]->name(), std::to_string(bytes) + "_" + condition.name, measured[i],
             graphs[0]->name(), measured[0], graphs[i]->granted());
}

Reservation fifo(int core) {
  Reservation reservation;
  reservation.policy = Policy::fixed;
  reservation.priority = kPriority;
  reservation.core = core;
  return reservation;
}

}  // namespace

std::vector<Row> run_graph(const Options& options) {
  const int rounds = options.rounds_or(6);
  std::vector<Row> rows;
  for (const Condition& condition :
       {Condition{"fifo_one_cpu", fifo(0)}, Condition{"fifo", fifo(-1)}, Condition{"default", {}}}) {
    for (uint32_t bytes : kSizes) {
      std::fprintf(stderr, "graph: %u bytes, %s\n", bytes, condition.name.c_str());
      in_process(bytes, condition, rounds, rows);
      processes(bytes, condition, rounds, rows);
    }
  }
  return rows;
}

}  // namespace takt::bench
