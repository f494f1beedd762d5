// SPDX-License-Identifier: Apache-2.0
// Internal: work on a card that is captured once as a graph and done again and again, and how a job waits for it.
#pragma once
#include <cuda_runtime.h>

#include <atomic>
#include <chrono>

#include "nodes/cuda/memory.cuh"
#include "nodes/cuda/table.hpp"

namespace takt::cuda {

/// Between CPU and card, in memory that both see: numbers of runs.
struct Turn {
  uint32_t wanted;     ///< by the CPU
  uint32_t withdrawn;  ///< by the CPU: its result is not wanted any more
  uint32_t writing;    ///< by the card: what it was asked for begins to be written, unless it was withdrawn before
  uint32_t written;    ///< by the card: the last one that was not withdrawn
  uint32_t done;       ///< by the card
};

/// One thread at a time. Throws CardError until it is rehearsed, and never after.
class Captured {
 public:
  explicit Captured(int card);
  ~Captured();
  Captured(const Captured&) = delete;
  Captured& operator=(const Captured&) = delete;

  cudaStream_t stream() const { return stream_.handle; }
  /// `compute` and `write` are called with the stream and put kernels into it. Those of `write` write nothing where
  /// withdrawn() says so on the card.
  template <class Compute, class Write>
  void capture(Compute compute, Write write) {
    begin_capture();
    compute(stream());
    begin_to_write(stream());
    write(stream());
    end_capture();
  }
  const bool* withdrawn() const { return withdrawn_; }
  /// Twenty runs. A wait spins about as long as the longest of the last ten took, then it sleeps in between.
  void rehearse();

  /// Until the run before has ended, which may have been late: what it reads must not be changed earlier.
  Outcome settle(int64_t until_ns) const { return wait(until_ns); }
  /// What is late writes nothing any more, or is waited for, since it would write into what is others' by then.
  Outcome run(int64_t until_ns);
  /// As CPU and card see it here.
  static int64_t now_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }

 private:
  void begin_capture();
  void begin_to_write(cudaStream_t stream);
  void end_capture();
  Outcome wait(int64_t until_ns) const;
  Outcome withdraw();
  volatile Turn& turn() const { return *turn_; }

  const int card_;
  Memory card_memory_{Memory::Place::card}, shared_memory_{Memory::Place::shared};
  Handle<cudaStream_t, cudaStreamDestroy> stream_;
  Handle<cudaGraph_t, cudaGraphDestroy> graph_;
  Handle<cudaGraphExec_t, cudaGraphExecDestroy> runs_;
  Turn* turn_ = nullptr;
  bool* withdrawn_ = nullptr;
  int64_t spin_ns_ = 0;
};

inline unsigned blocks(size_t count, size_t threads) { return static_cast<unsigned>((count + threads - 1) / threads); }

}  // namespace takt::cuda
