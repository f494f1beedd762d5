// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <type_traits>

#include "nodes/cuda/memory.cuh"
#include "nodes/cuda/stereo_work.hpp"

namespace takt::cuda {

/// A matcher on a card. Its work is captured once as a graph, which reads from shared memory where the images of this
/// match lie. Throws CardError when it is made, and never after.
struct StereoOnCard {
 public:
  StereoOnCard(const StereoShape& shape, int card);
  ~StereoOnCard();
  StereoOnCard(const StereoOnCard&) = delete;
  StereoOnCard& operator=(const StereoOnCard&) = delete;
  Outcome match(const StereoCall& call, int64_t bound_ns);

 private:
  struct Shared {
    StereoCall call;
    Turn turn;
  };
  void enqueue(cudaStream_t stream) const;
  void capture();
  void rehearse();
  StereoCall own_call() const;
  Outcome run(const StereoCall& call, int64_t until_ns);
  Outcome wait(int64_t until_ns) const;
  Outcome withdraw();
  volatile Turn& volatile_turn() const { return shared_->turn; }

  const StereoShape shape_;
  const int card_;
  Memory card_memory_{Memory::Place::card}, shared_memory_{Memory::Place::shared};
  Handle<cudaStream_t, cudaStreamDestroy> stream_;
  Handle<cudaGraph_t, cudaGraphDestroy> graph_;
  Handle<cudaGraphExec_t, cudaGraphExecDestroy> runs_;
  Work work_{};
  Shared* shared_ = nullptr;
  uint8_t *staged_images_[2] = {}, *staged_confidence_ = nullptr, *staged_fraction_ = nullptr;
  int16_t* staged_disparity_ = nullptr;
};

}  // namespace takt::cuda
