// SPDX-License-Identifier: Apache-2.0
// What a bad reader costs a writer: from asking for a chunk to the message being out, beside a reader that takes each
// message and gives it back (reference), one that never comes, and one that keeps all it gets until the pool is empty.
// All contestants of a transport take turns message by message, in an order drawn anew.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <random>
#include <thread>

#include "bench/instants.hpp"
#include "bench/suite.hpp"
#include "rt/msg/messages.hpp"
#include "rt/shm/transport.hpp"

namespace takt::bench {

std::vector<Row> run_publish(const Options& options);

namespace {

constexpr int kPerRound = 100;
constexpr int64_t kStepNs = 1'666'667;  // three contestants: 200 Hz each
constexpr int kPriority = 50;
constexpr double kLimitUs = 50;  ///< no publisher may be delayed for longer by its readers

enum class Manner { prompt, absent, keeping };
constexpr Manner kManners[] = {Manner::prompt, Manner::absent, Manner::keeping};
constexpr const char* kNames[] = {"prompt_reader", "absent_reader", "keeping_reader"};

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

struct Measured {
  Samples all[std::size(kManners)];
  Pairs p50[std::size(kManners)];  ///< against prompt; its own stays empty
  uint64_t empty_loans = 0;
  std::string granted;
};

std::vector<PortPlan> ports() {
  std::vector<PortPlan> ports;
  for (const char* name : kNames)
    ports.push_back({"bench", name, &MessageType::of<Image>(), {.width = 640, .height = 480, .channels = 3}, 2, 2, 1});
  return ports;
}

void measure(Transport& transport, int rounds, Measured& out) {
  Reservation fifo;
  fifo.policy = Policy::fixed;
  fifo.priority = kPriority;
  out.granted = granted_text(apply(fifo));
  std::vector<std::unique_ptr<Contestant>> contestants;
  std::vector<size_t> order;
  for (size_t i = 0; i < std::size(kManners); ++i) {
    contestants.push_back(std::make_unique<Contestant>(transport, i, kManners[i]));
    for (int warm_up = 0; warm_up < 20; ++warm_up) contestants[i]->publish();
    order.push_back(i);
  }
  std::mt19937 random(1);
  int64_t next_ns = now_ns() + 20'000'000;
  for (int round = 0; round < rounds; ++round) {
    Samples of_round[std::size(kManners)];
    for (int message = 0; message < kPerRound; ++message) {
      std::shuffle(order.begin(), order.end(), random);
      for (const size_t i : order) {
        sleep_until(next_ns += kStepNs);
        of_round[i].add(contestants[i]->publish());
      }
    }
    for (size_t i = 0; i < std::size(kManners); ++i) {
      out.all[i].add(of_round[i].values());
      if (i == 0) continue;
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
  Row prompt{base + kNames[0], "us", 0, measured.all[0], {}, {}, {}, measured.granted};
  prompt.value = prompt.samples.quantile(0.5).value_or(0);
  rows.push_back(prompt);
  judge(0);  // beside what the machine does to everybody
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
