// SPDX-License-Identifier: Apache-2.0
// What a bad reader costs a writer: from asking for a chunk to the message being out, beside a reader that takes each
// message and gives it back (reference), one that never comes, and one that keeps all it gets until the pool is empty.
// Beside them `machine`: as long a time in which nothing is done but look at the clock, which tells how often the
// machine itself holds a thread for longer than the limit. All contestants of a transport take turns message by
// message, in an order drawn anew.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <numeric>
#include <random>
#include <span>
#include <thread>

#include "bench/instants.hpp"
#include "bench/suite.hpp"
#include "rt/msg/image.hpp"
#include "rt/shm/transport.hpp"

namespace takt::bench {

std::vector<Row> run_publish(const Options& options);

namespace {

constexpr int kPerRound = 100;
constexpr int kWarmUp = 20;
constexpr int64_t kStepNs = 1'250'000;  // four contestants: 200 Hz each
constexpr int kPriority = 50;
constexpr double kLimitUs = 50;  ///< no publisher may be delayed for longer by its readers

enum class Manner { prompt, absent, keeping };
constexpr Manner kManners[] = {Manner::prompt, Manner::absent, Manner::keeping};
constexpr const char* kNames[] = {"prompt_reader", "absent_reader", "keeping_reader", "machine"};
constexpr size_t kMachine = std::size(kManners), kContestants = std::size(kNames);

/// A port of its own with one reader.
class Contestant {
 public:
  Contestant(Transport& transport, size_t port, Manner manner)
      : manner_(manner), writer_(transport.make_writer(port)), reader_(transport.make_reader(port)) {
    kept_.reserve(16);
  }
  ~Contestant() {
    for (Held& held : kept_) reader_->release(held);
  }
  Contestant(const Contestant&) = delete;
  Contestant& operator=(const Contestant&) = delete;

  /// us
  double publish() {
    const int64_t begin = now_ns();
    if (writer_->loan() != nullptr) writer_->publish(begin, begin, begin);
    const double took = static_cast<double>(now_ns() - begin) * 1e-3;
    read();
    return took;
  }
  uint64_t empty_loans() const { return writer_->statistics().pool_empty; }

 private:
  void read() {
    Candidate newest;
    if (manner_ == Manner::absent || reader_->list(INT64_MAX, {&newest, 1}) == 0) return;
    if (!kept_.empty() && kept_.back().sequence == newest.sequence) return;
    Held held = reader_->take(newest.sequence);
    if (manner_ == Manner::prompt) reader_->release(held);
    else if (held) kept_.push_back(held);
  }

  const Manner manner_;
  std::unique_ptr<Writer> writer_;
  std::unique_ptr<Reader> reader_;
  std::vector<Held> kept_;
};

/// us that looking at the clock for `span_us` took
double look_at_clock(double span_us) {
  const int64_t begin = now_ns();
  double took = 0;
  do took = static_cast<double>(now_ns() - begin) * 1e-3;
  while (took < span_us);
  return took;
}

struct Measured {
  Samples all[kContestants];
  Pairs p50[std::size(kManners)];  ///< against prompt; its own stays empty
  uint64_t empty_loans = 0;
  std::string granted;
};

std::vector<PortPlan> ports() {
  std::vector<PortPlan> ports;
  for (const Manner manner : kManners)
    ports.push_back({"bench",
                     kNames[static_cast<size_t>(manner)],
                     &MessageType::of<Image>(),
                     {.width = 640, .height = 480, .channels = 3},
                     2,
                     2,
                     1});
  return ports;
}

/// us that publishing to the prompt reader takes (median)
double warm_up(std::span<const std::unique_ptr<Contestant>> contestants, int64_t& next_ns) {
  Samples prompt;
  for (int message = 0; message < kWarmUp; ++message)
    for (size_t i = 0; i < contestants.size(); ++i) {
      sleep_until(next_ns += kStepNs);
      const double took = contestants[i]->publish();
      if (kManners[i] == Manner::prompt) prompt.add(took);
    }
  return *prompt.quantile(0.5);
}

void measure(Transport& transport, int rounds, Measured& out) {
  Reservation fifo;
  fifo.policy = Policy::fixed;
  fifo.priority = kPriority;
  out.granted = granted_text(apply(fifo));
  std::vector<std::unique_ptr<Contestant>> contestants;
  for (size_t i = 0; i < std::size(kManners); ++i)
    contestants.push_back(std::make_unique<Contestant>(transport, i, kManners[i]));
  std::mt19937 random(1);
  int64_t next_ns = now_ns() + 20'000'000;
  const double span_us = warm_up(contestants, next_ns);
  size_t order[kContestants];
  std::iota(std::begin(order), std::end(order), 0);
  for (int round = 0; round < rounds; ++round) {
    Samples of_round[kContestants];
    for (int message = 0; message < kPerRound; ++message) {
      std::shuffle(std::begin(order), std::end(order), random);
      for (const size_t i : order) {
        sleep_until(next_ns += kStepNs);
        of_round[i].add(i == kMachine ? look_at_clock(span_us) : contestants[i]->publish());
      }
    }
    for (size_t i = 0; i < kContestants; ++i) {
      out.all[i].add(of_round[i].values());
      if (i == 0 || i == kMachine) continue;
      out.p50[i].add_a(*of_round[0].quantile(0.5));
      out.p50[i].add_b(*of_round[i].quantile(0.5));
    }
  }
  out.empty_loans = contestants[2]->empty_loans();
}

void run_on(const char* name, std::unique_ptr<Transport> (*make)(std::span<const PortPlan>), int rounds,
            std::vector<Row>& rows) {
  std::fprintf(stderr, "publish: %s\n", name);
  const auto transport = make(ports());
  Measured measured;
  std::exception_ptr failure;
  std::thread([&] {  // of its own: the policy must not outlast this
    try {
      measure(*transport, rounds, measured);
    } catch (...) {
      failure = std::current_exception();
    }
  })
      .join();
  if (failure) std::rethrow_exception(failure);
  const std::string base = std::string("publish/") + name + "/";
  const auto judge = [&](size_t i) {
    const double longest = measured.all[i].max().value_or(0);
    rows.push_back(
        {base + kNames[i] + "_max", "us", longest, {}, "limit", kLimitUs, longest / kLimitUs, measured.granted});
    const auto& all = measured.all[i].values();
    const auto over = std::count_if(all.begin(), all.end(), [](double us) { return us > kLimitUs; });
    rows.push_back(
        {base + kNames[i] + "_over_limit", "count", static_cast<double>(over), {}, {}, {}, {}, measured.granted});
  };
  const auto alone = [&](size_t i) {
    Row row{base + kNames[i], "us", 0, measured.all[i], {}, {}, {}, measured.granted};
    row.value = row.samples.quantile(0.5).value_or(0);
    rows.push_back(row);
    judge(i);
  };
  alone(0);
  for (size_t i = 1; i < std::size(kManners); ++i) {
    Row row{base + kNames[i], "us", 0, measured.all[i], kNames[0], {}, {}, measured.granted};
    if (const auto middle = measured.p50[i].middle()) {
      row.value = middle->value;
      row.reference_value = middle->reference;
      row.ratio = middle->ratio;
    }
    rows.push_back(row);
    judge(i);
  }
  alone(kMachine);
  rows.push_back({base + "keeping_reader_empty_loans",
                  "count",
                  static_cast<double>(measured.empty_loans),
                  {},
                  {},
                  {},
                  {},
                  measured.granted});
}

std::unique_ptr<Transport> make_local(std::span<const PortPlan> ports) { return make_local_transport(ports); }

}  // namespace

std::vector<Row> run_publish(const Options& options) {
  const int rounds = options.rounds_or(20);
  std::vector<Row> rows;
  run_on("local", make_local, rounds, rows);
  run_on("iceoryx", make_iceoryx_transport, rounds, rows);
  return rows;
}

}  // namespace takt::bench
