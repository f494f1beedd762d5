// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <functional>

#include "rt/own_thread.hpp"
#include "rt/trace/rings.hpp"
#include "rt/trace/switch_source.hpp"

namespace takt::trace {

struct ThreadEvent {
  int32_t thread = 0;
  Event event;
};

/// All that a run noted, as it came.
struct Recording {
  Source source = Source::none;
  std::string source_note;  ///< why no better source
  std::vector<ThreadEvent> events;
  Switches switches;
  std::vector<Steal> steals;
  std::vector<ThreadFacts> threads;
  Losses losses;
  int64_t first_ns = 0, last_ns = 0;
  int64_t collector_cpu_ns = 0;  ///< what collecting cost, the kernel's part in each switch apart
};

/// Empties the rings of a run every 20 ms, and the kernel's record of switches with them, on an ordinary thread.
class Collector {
 public:
  struct Options {
    std::vector<int> cpus = {};       ///< whose switches are recorded
    Source best = Source::tracefs;    ///< nothing better is tried
    size_t records_kept = 4'000'000;  ///< of each kind, about 160 MB; beyond that the oldest go, counted
    bool by_caller =
        false;  ///< virtual time: events are taken in drain() only, on the caller's thread; no clock is read
    /// Hears every event as it is taken, with the number of its ring. A ring outlives its thread, and goes to the one
    /// that takes the place of a thread that died.
    std::function<void(int32_t, const Event&)> listener = {};
  };
  /// In the process that outlives the others, after they were forked. Opens the best source that is granted.
  Collector(Rings& rings, Options options);
  ~Collector();
  Collector(const Collector&) = delete;
  Collector& operator=(const Collector&) = delete;

  /// Empties the rings now. Only with `by_caller`.
  void drain();
  /// Who had a core, where nobody but a simulation knows. Only with `by_caller`.
  void add(const Slice& slice);
  /// Ends collecting. Once.
  Recording finish();

 private:
  void collect();
  void follow_new_threads();
  void read_steal(int64_t now_ns);
  void keep_within_limit();

  Rings& rings_;
  const Options options_;
  Recording recording_;
  std::vector<int32_t> writers_;  ///< by ring; what a dead thread noted in its last 20 ms is its successor's
  std::unique_ptr<SwitchSource> source_;
  std::vector<int64_t> steal_ticks_;  ///< per CPU of the options
  int64_t steal_read_ns_ = 0;
  std::atomic<bool> ended_{false};
  OwnThread thread_;
};

/// Jobs, slices and marks from what was noted: `tasks`, `ports`, policy, epoch and end are for the caller to add.
Trace assemble(const Recording& recording);

}  // namespace takt::trace
