// SPDX-License-Identifier: Apache-2.0
// One message from output to input: on one worker, between threads, between processes, at the graph's own rates (15 Hz,
// caches cold) and at 1 kHz. References: a bare futex wake, and iceoryx as its own users would call it. At 15 Hz the
// contestants take turns message by message, at 1 kHz in blocks of 100. Peers (bench/peers) have a pass
// of their own at 15 Hz, in an order drawn anew for each turn: they copy, and who comes next finds its caches empty.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <numeric>
#include <random>
#include <thread>

#include "bench/large_copies.hpp"
#include "bench/suite.hpp"
#include "bench/suites/hops.hpp"
#include "rt/msg/image.hpp"

namespace takt::bench {

std::vector<Row> run_transport(const Options& options);

namespace {

constexpr uint32_t kSizes[] = {128, 921'600, 3'686'400};
constexpr int kPerRound15 = 15, kPerRound1000 = 100;
constexpr int kWarmUp = 20;  // every chunk of every pool once, so that its pages are mapped

std::vector<HopPlan> contestants() {
  std::vector<HopPlan> hops{{Carrier::futex, Place::threads, 0, false},
                            {Carrier::futex, Place::threads, 0, true},
                            {Carrier::futex, Place::processes, 0, false},
                            {Carrier::futex, Place::processes, 0, true}};
  // Each reference twice, as its null pair.
  hops.push_back({Carrier::takt, Place::threads, kSizes[0], true});
  hops.push_back({Carrier::takt, Place::processes, kSizes[0], true});
  hops.push_back({Carrier::takt_local, Place::processes, kSizes[0], true});
  for (uint32_t bytes : kSizes) {
    hops.push_back({Carrier::takt, Place::same_worker, bytes, false});
    hops.push_back({Carrier::takt, Place::threads, bytes, false});
    hops.push_back({Carrier::takt, Place::processes, bytes, false});
    hops.push_back({Carrier::takt_local, Place::processes, bytes, false});
    for (bool second : {false, true}) hops.push_back({Carrier::iceoryx, Place::processes, bytes, second});
  }
  for (const Peer& peer : peers())
    for (uint32_t bytes : kSizes)
      if (peer.processes != nullptr) hops.push_back({Carrier::peer, Place::processes, bytes, false, peer});
  return hops;
}

/// Per contestant: all samples, and the median of each round (us).
struct Measured {
  std::vector<Samples> all;
  std::vector<std::vector<double>> rounds;
};

void close_round(Measured& out, std::vector<Samples>& round) {
  for (size_t i = 0; i < round.size(); ++i) {
    if (round[i].size() == 0) continue;  // not in this pass; or a peer that was given up, in no later round either
    out.all[i].add(round[i].values());
    out.rounds[i].push_back(*round[i].quantile(0.5));
    round[i].clear();
  }
}

/// Everybody at 15 Hz in turns, or each at 1 kHz for a block. The order of the turns is random: a
/// contestant that always followed one without a wake-up would find the kernel's code for it cold.
struct Pass {
  std::vector<size_t> hops;
  bool slow = true;
};

Measured measure(Course& course, Pass pass, int rounds) {
  std::vector<size_t>& order = pass.hops;
  const size_t all = course.hops().size();
  Measured out{std::vector<Samples>(all), std::vector<std::vector<double>>(all)};
  std::vector<Samples> round(all);
  for (int i = 0; i < kWarmUp; ++i)
    for (size_t hop : order) {
      course.send(hop);
      sleep_until(now_ns() + 500'000);
      course.taken_ns(hop);
    }
  std::mt19937 random(1);
  int64_t next = now_ns() + 20'000'000;
  const int64_t step = pass.slow ? 1'000'000'000 / 15 / static_cast<int64_t>(order.size()) : 1'000'000;
  const size_t outer_count = pass.slow ? kPerRound15 : order.size();
  const size_t inner_count = pass.slow ? order.size() : kPerRound1000;
  for (int r = 0; r < rounds; ++r) {
    if (!pass.slow) std::shuffle(order.begin(), order.end(), random);
    for (size_t outer = 0; outer < outer_count; ++outer) {
      if (pass.slow) std::shuffle(order.begin(), order.end(), random);
      for (size_t inner = 0; inner < inner_count; ++inner) {
        const size_t hop = order[pass.slow ? inner : outer];
        sleep_until(next);
        course.send(hop);
        next = std::max(next, now_ns() - step) + step;  // a late answer moves the rest
        sleep_until(next - step / 4);
        if (const auto taken = course.taken_ns(hop)) round[hop].add(static_cast<double>(*taken) * 1e-3);
      }
    }
    close_round(out, round);
  }
  return out;
}

size_t find(const std::vector<HopPlan>& hops, Carrier carrier, Place place, uint32_t bytes, bool second = false) {
  const auto at = std::find_if(hops.begin(), hops.end(), [&](const HopPlan& h) {
    return h.carrier == carrier && h.place == place && h.bytes == bytes && h.second == second;
  });
  return static_cast<size_t>(at - hops.begin());
}

std::vector<size_t> own_hops(const Course& course) {
  std::vector<size_t> hops(course.own());
  std::iota(hops.begin(), hops.end(), size_t{0});
  return hops;
}

/// The peers, Takt, and the reference of both.
std::vector<size_t> beside_peers(const Course& course) {
  std::vector<size_t> hops{find(course.hops(), Carrier::futex, Place::processes, 0)};
  for (uint32_t bytes : kSizes) hops.push_back(find(course.hops(), Carrier::takt, Place::processes, bytes));
  for (size_t hop = course.own(); hop < course.hops().size(); ++hop) hops.push_back(hop);
  return hops;
}

class Table {
 public:
  Table(const Course& course, const Measured& measured, std::string variant, std::string granted,
        std::vector<Row>& rows)
      : course_(course),
        hops_(course.hops()),
        measured_(measured),
        variant_(std::move(variant)),
        granted_(std::move(granted)),
        rows_(rows) {}

  void compare(const std::string& what, size_t hop, size_t reference) {
    const std::string granted = hop < course_.own() ? granted_ : course_.granted(hop);
    Row row{"transport/" + what + "/" + variant_, "us", 0, measured_.all[hop], {}, {}, {}, granted};
    Pairs pairs;
    const std::vector<double>&a = measured_.rounds[reference], &b = measured_.rounds[hop];
    for (size_t round = 0; round < a.size() && round < b.size(); ++round) {
      pairs.add_a(a[round]);
      pairs.add_b(b[round]);
    }
    add_pair(rows_, std::move(row), hops_[reference].name(), pairs);
  }

  void add_all() {
    const size_t threads = find(hops_, Carrier::futex, Place::threads, 0);
    const size_t processes = find(hops_, Carrier::futex, Place::processes, 0);
    compare("futex_threads_null", find(hops_, Carrier::futex, Place::threads, 0, true), threads);
    compare("futex_processes_null", find(hops_, Carrier::futex, Place::processes, 0, true), processes);
    for (uint32_t bytes : kSizes) {
      const std::string size = std::to_string(bytes);
      const size_t across = find(hops_, Carrier::takt, Place::processes, bytes);
      const size_t raw = find(hops_, Carrier::iceoryx, Place::processes, bytes);
      compare("same_worker_" + size, find(hops_, Carrier::takt, Place::same_worker, bytes), threads);
      compare("threads_" + size, find(hops_, Carrier::takt, Place::threads, bytes), threads);
      compare("processes_" + size, across, processes);
      compare("processes_local_" + size, find(hops_, Carrier::takt_local, Place::processes, bytes), processes);
      compare("processes_" + size + "_to_iceoryx", across, raw);
      compare("iceoryx_processes_" + size, raw, processes);
      compare("iceoryx_processes_" + size + "_null", find(hops_, Carrier::iceoryx, Place::processes, bytes, true), raw);
    }
    to_smallest("processes", Carrier::takt, Place::processes);
    to_smallest("processes_local", Carrier::takt_local, Place::processes);
    to_smallest("threads", Carrier::takt, Place::threads);
  }

  void to_smallest(const std::string& what, Carrier carrier, Place place) {
    const size_t smallest = find(hops_, carrier, place, kSizes[0]);
    compare(what + "_largest_to_smallest", find(hops_, carrier, place, kSizes[2]), smallest);
    compare(what + "_smallest_null", find(hops_, carrier, place, kSizes[0], true), smallest);
  }

  void add_peers() {
    const size_t processes = find(hops_, Carrier::futex, Place::processes, 0);
    for (uint32_t bytes : kSizes)
      compare("processes_" + std::to_string(bytes) + "_beside_peers",
              find(hops_, Carrier::takt, Place::processes, bytes), processes);
    for (size_t hop = course_.own(); hop < hops_.size(); ++hop) compare(hops_[hop].name(), hop, processes);
  }

 private:
  const Course& course_;
  const std::vector<HopPlan>& hops_;
  const Measured& measured_;
  const std::string variant_, granted_;
  std::vector<Row>& rows_;
};

Row count_row(const std::string& name, uint64_t count, const std::string& granted) {
  return {"transport/" + name, "count", static_cast<double>(count), {}, {}, {}, {}, granted};
}

void run_conditions(const Conditions& conditions, int rounds, std::vector<Row>& rows) {
  std::fprintf(stderr, "transport: %s\n", conditions.name.c_str());
  Course course(contestants(), conditions);
  const uint64_t copies_before = large_copies();
  // A thread of its own: the policy must not outlast the course.
  std::exception_ptr failure;
  std::thread([&] {
    try {
      const std::string granted = granted_text(apply(conditions.reservation));
      for (bool slow : {true, false}) {
        const Measured measured = measure(course, {own_hops(course), slow}, rounds);
        Table(course, measured, (slow ? "15hz_" : "1khz_") + conditions.name, granted, rows).add_all();
      }
      if (course.own() < course.hops().size()) {
        const Measured measured = measure(course, {beside_peers(course), true}, rounds);
        Table(course, measured, "15hz_" + conditions.name, granted, rows).add_peers();
      }
      rows.push_back(count_row("copies_above_64_KiB/" + conditions.name, large_copies() - copies_before, granted));
    } catch (...) {
      failure = std::current_exception();
    }
  }).join();
  if (failure) std::rethrow_exception(failure);
}

/// From nothing to the first message in the reader's hands.
Row start_row(const char* name, std::unique_ptr<Transport> (*make)(std::span<const PortPlan>), int times) {
  Row row{std::string("transport/start_to_first_message/") + name, "ms", 0, {}, {}, {}, {}, {}};
  for (int i = 0; i < times; ++i) {
    const std::vector<PortPlan> ports{
        {"bench", "start", &MessageType::of<Image>(), {.width = 640, .height = 480, .channels = 3}, 2, 1, 1}};
    const int64_t begin = now_ns();
    const auto transport = make(ports);
    const auto writer = transport->make_writer(0);
    const auto reader = transport->make_reader(0);
    writer->loan();
    writer->publish(0, 0, 0);
    Candidate candidate;
    if (reader->list(0, {&candidate, 1}) != 1) throw CannotRun("the first message did not arrive");
    Held held = reader->take(candidate.sequence);
    row.samples.add(static_cast<double>(now_ns() - begin) * 1e-6);
    reader->release(held);
  }
  row.value = row.samples.quantile(0.5).value_or(0);
  return row;
}

std::unique_ptr<Transport> make_local(std::span<const PortPlan> ports) { return make_local_transport(ports); }

}  // namespace

std::vector<Row> run_transport(const Options& options) {
  const int rounds = options.rounds_or(8);
  std::vector<Row> rows{start_row("local", make_local, rounds), start_row("iceoryx", make_iceoryx_transport, rounds)};
  const auto fifo = [](int core) {
    Reservation r;
    r.policy = Policy::fixed;
    r.priority = 50;
    r.core = core;
    return r;
  };
  run_conditions({"fifo_one_cpu", fifo(0)}, rounds, rows);
  run_conditions({"fifo", fifo(-1)}, rounds, rows);
  run_conditions({"default", {}}, rounds, rows);
  return rows;
}

}  // namespace takt::bench
