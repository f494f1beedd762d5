// SPDX-License-Identifier: Apache-2.0
// Load on the machine beside a run, in real time only: threads that use CPU time, memory that somebody else holds.
#pragma once
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "rt/faults/message_fault.hpp"

namespace takt::faults {

struct LoadFault {
  enum class Kind : uint8_t { cpu, memory };
  Kind kind = Kind::cpu;
  int64_t from_ns = 0, to_ns = kForever;  ///< since the epoch
  uint32_t threads = 1;                   ///< of cpu: each spins all the time
  bool fixed_priority = false;            ///< of cpu: SCHED_FIFO at its lowest priority instead of an ordinary thread
  uint64_t bytes = 0;                     ///< of memory: mapped, written to, held
};

/// What one load did: 1 per thread that ran, 1 for memory that was got. A load that the kernel refuses has struck 0.
using LoadCount = std::atomic<uint64_t>;

/// Loads from construction on, each within its window; destruction ends them and gives everything back.
class Loads {
 public:
  /// `epoch_ns` is an instant of CLOCK_MONOTONIC, 0 until the run has one. `struck`: one entry per fault. Both outlive
  /// this.
  Loads(std::vector<LoadFault> faults, const std::atomic<int64_t>& epoch_ns, std::vector<LoadCount*> struck);
  ~Loads();
  Loads(const Loads&) = delete;
  Loads& operator=(const Loads&) = delete;

 private:
  void run(const LoadFault& fault, LoadCount& struck);
  void spin(const LoadFault& fault, LoadCount& struck) const;
  void hold(const LoadFault& fault, LoadCount& struck);
  /// False if the loads are ended before that instant (since the epoch) has come.
  bool wait_until(int64_t since_epoch_ns);
  int64_t now_since_epoch_ns() const;

  const std::vector<LoadFault> faults_;
  const std::atomic<int64_t>& epoch_ns_;
  std::atomic<bool> ended_{false};
  std::mutex mutex_;
  std::condition_variable ending_;
  std::vector<std::thread> threads_;
};

}  // namespace takt::faults
