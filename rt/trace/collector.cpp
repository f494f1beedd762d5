// SPDX-License-Identifier: Apache-2.0
#include "rt/trace/collector.hpp"

#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <sstream>
#include <utility>

#include "rt/capability.hpp"
#include "rt/time/clock.hpp"

namespace takt::trace {
namespace {

constexpr timespec kPause{0, 20'000'000};
constexpr int64_t kStealPeriodNs = 100'000'000;

int64_t now_ns() { return MonotonicClock().now_ns(); }

/// Column `steal` of the line "cpuN user nice system idle iowait irq softirq steal ..." of /proc/stat, in ticks.
std::vector<int64_t> steal_ticks(const std::vector<int>& cpus) {
  std::vector<int64_t> ticks(cpus.size(), 0);
  std::ifstream stat("/proc/stat");
  for (std::string line; std::getline(stat, line) && line.compare(0, 3, "cpu") == 0;) {
    std::istringstream words(line);
    std::string name;
    int64_t value = 0;
    words >> name;
    for (int column = 0; column < 8; ++column) words >> value;
    for (size_t i = 0; i < cpus.size(); ++i)
      if (name == "cpu" + std::to_string(cpus[i])) ticks[i] = value;
  }
  return ticks;
}

}  // namespace

Collector::Collector(Rings& rings, Options options) : rings_(rings), options_(std::move(options)) {
  std::string why_not;
  if (options_.best == Source::tracefs) source_ = open_tracefs(options_.cpus, why_not);
  if (!source_ && options_.best != Source::none) {
    std::string no_perf;
    source_ = open_perf(no_perf);
    if (!no_perf.empty()) why_not += (why_not.empty() ? "" : "; ") + no_perf;
  }
  recording_.source = source_ ? source_->kind() : Source::none;
  recording_.source_note = why_not;
  if (options_.by_caller) return;
  recording_.first_ns = steal_read_ns_ = now_ns();
  steal_ticks_ = steal_ticks(options_.cpus);
  thread_ = OwnThread([this] { collect(); });
}

Collector::~Collector() {
  ended_.store(true);
  if (thread_.joinable()) thread_.join();
}

Recording Collector::finish() {
  ended_.store(true);
  if (options_.by_caller) drain();
  else thread_.join();
  recording_.last_ns = now_ns();  // of a run in virtual time, whoever assembles it knows better
  if (source_) {
    source_->finish(recording_.last_ns, recording_.switches);
    recording_.losses.switches = source_->lost();
    source_.reset();
  }
  for (size_t i = 0; i < rings_.claimed(); ++i) recording_.losses.events += rings_.ring(i).lost();
  recording_.losses.threads = rings_.refused();
  return std::move(recording_);
}

void Collector::collect() {
  pthread_setname_np(pthread_self(), "takt-trace");
  if (options_.best == Source::none) keep_rights(Rights::none);  // perf opens a counter for each new thread
  while (!ended_.load()) {
    drain();
    nanosleep(&kPause, nullptr);
  }
  drain();
  read_steal(now_ns());
  recording_.collector_cpu_ns = thread_cpu_ns();
}

void Collector::drain() {
  follow_new_threads();
  for (size_t i = 0; i < writers_.size(); ++i)
    rings_.ring(i).drain([&, thread = writers_[i]](const Event& event) {
      if (options_.listener) options_.listener(static_cast<int32_t>(i), event);
      recording_.events.push_back({thread, event});
    });
  if (source_) source_->drain(recording_.switches);
  if (const int64_t now = options_.by_caller ? 0 : now_ns(); now - steal_read_ns_ >= kStealPeriodNs) read_steal(now);
  keep_within_limit();
}

void Collector::add(const Slice& slice) {
  recording_.source = Source::simulation;
  const auto thread = std::find_if(recording_.threads.begin(), recording_.threads.end(),
                                   [&](const ThreadFacts& t) { return t.id == slice.thread; });
  recording_.switches.slices.push_back(slice);
  recording_.switches.slices.back().name =
      recording_.switches.name(thread != recording_.threads.end() ? thread->name : "");
}

void Collector::follow_new_threads() {
  std::vector<int32_t> fresh;
  for (size_t i = 0; i < rings_.claimed(); ++i) {
    const int32_t writer = rings_.ring(i).writer.load(std::memory_order_acquire);
    if (writer == 0) break;  // it is being claimed
    if (i == writers_.size()) writers_.push_back(0);
    if (std::exchange(writers_[i], writer) == writer) continue;
    recording_.threads.push_back({writer, rings_.ring(i).name.data()});
    fresh.push_back(writer);
  }
  if (source_ && !fresh.empty()) source_->follow(fresh);
}

void Collector::read_steal(int64_t now_ns) {
  const std::vector<int64_t> ticks = steal_ticks(options_.cpus);
  const int64_t tick_ns = 1'000'000'000 / sysconf(_SC_CLK_TCK);
  for (size_t i = 0; i < ticks.size(); ++i)
    if (ticks[i] > steal_ticks_[i])
      recording_.steals.push_back({steal_read_ns_, now_ns, (ticks[i] - steal_ticks_[i]) * tick_ns, options_.cpus[i]});
  steal_ticks_ = ticks;
  steal_read_ns_ = now_ns;
}

void Collector::keep_within_limit() {
  const auto halve = [&](auto& records, auto instant) {
    if (records.size() <= options_.records_kept) return;
    const size_t count = records.size() / 2;
    recording_.first_ns = std::max(recording_.first_ns, instant(records[count]));
    recording_.losses.forgotten += count;
    records.erase(records.begin(), records.begin() + static_cast<ptrdiff_t>(count));
  };
  halve(recording_.events, [](const ThreadEvent& e) { return e.event.at_ns; });
  halve(recording_.switches.slices, [](const Slice& s) { return s.to_ns; });
  halve(recording_.switches.wakings, [](const Waking& w) { return w.at_ns; });
}

}  // namespace takt::trace
