// SPDX-License-Identifier: Apache-2.0
// Who had the CPUs: the kernel's record of context switches, in whatever form this machine grants it.
#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "rt/trace/trace.hpp"

namespace takt::trace {

/// A thread was woken and wants a CPU.
struct Waking {
  int64_t at_ns = 0;
  int32_t thread = 0;
};

/// What was drained. Slices of one thread, and those of one CPU, come in order.
struct Switches {
  std::vector<Slice> slices;
  std::vector<Waking> wakings;
  std::vector<std::string> names;  ///< of Slice::name
  /// Index of a name, which is added if it is new.
  uint32_t name(std::string_view text);
};

/// One thread at a time, not a real-time one.
class SwitchSource {
 public:
  virtual ~SwitchSource() = default;
  virtual Source kind() const = 0;
  /// From now on these threads are of interest, besides those told before.
  virtual void follow(std::span<const int32_t> threads) = 0;
  /// Adds what happened since the last call.
  virtual void drain(Switches& into) = 0;
  /// Closes what still runs: slices that end at `now_ns`, open.
  virtual void finish(int64_t now_ns, Switches& into) = 0;
  /// Records that the kernel dropped so far.
  virtual uint64_t lost() const = 0;
};

/// A private instance of tracefs with sched_switch and sched_waking of `cpus`, on CLOCK_MONOTONIC. Needs CAP_SYS_ADMIN
/// (a mount of its own, seen by nobody else) and process ids as the kernel numbers them. Tries by doing: its own thread
/// must appear in what is recorded. Null, and why, if not.
std::unique_ptr<SwitchSource> open_tracefs(std::span<const int> cpus, std::string& why_not);

/// PERF_RECORD_SWITCH of the threads followed. Needs perf_event_paranoid <= 2, or CAP_PERFMON. Null, and why, if not.
std::unique_ptr<SwitchSource> open_perf(std::string& why_not);

}  // namespace takt::trace
