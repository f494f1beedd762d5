// SPDX-License-Identifier: Apache-2.0
// The graph as Takt runs it in one process: one lane, nodes `on` their producer, back to back on one worker.
#pragma once
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "bench/peers/shape.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/grant.hpp"

namespace takt::bench {

class TaktExecutor {
 public:
  /// An executor of 15 Hz. The policy and CPU are those of `reservation`; the executor chooses priorities itself.
  TaktExecutor(const GraphShape& shape, uint32_t bytes, const Reservation& reservation);
  ~TaktExecutor();
  TaktExecutor(const TaktExecutor&) = delete;
  TaktExecutor& operator=(const TaktExecutor&) = delete;

  /// Starts its worker; returns the instant of the first frame. It keeps its own rate from then on.
  int64_t start();
  void stop();
  /// CPU time of its threads since start().
  int64_t cpu_ns() const;
  /// After stop(): source's stamp (just before it publishes) to the sink's job start, us, of the frames stamped in
  /// [from, to).
  std::vector<double> latencies_us(int64_t from_ns, int64_t to_ns) const;
  /// After stop().
  std::string granted() const;

 private:
  class GraphNode;
  struct Frame {
    int64_t sent_ns, arrived_ns;
    bool complete;
  };

  std::vector<Frame> frames_;
  std::vector<std::unique_ptr<GraphNode>> nodes_;
  std::unique_ptr<Transport> transport_;
  MonotonicClock clock_;
  std::unique_ptr<Executor> executor_;
  RunResult result_;
  std::thread thread_;
  std::vector<int> thread_ids_;
  std::atomic<int64_t> epoch_ns_{0};
};

}  // namespace takt::bench
