// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "nodes/cuda/captured.cuh"
#include "nodes/stereo/on_card_work.hpp"

namespace takt::cuda {

/// A matcher on a card, which reads from shared memory where the images of this match lie. Throws CardError when it is
/// made, and never after.
struct StereoOnCard {
 public:
  StereoOnCard(const StereoShape& shape, int card);
  StereoOnCard(const StereoOnCard&) = delete;
  StereoOnCard& operator=(const StereoOnCard&) = delete;
  Outcome match(const StereoCall& call, int64_t bound_ns);

 private:
  void enqueue(const dim3& rows, cudaStream_t stream) const;
  StereoCall own_call() const;

  const StereoShape shape_;
  Memory card_memory_{Memory::Place::card}, shared_memory_{Memory::Place::shared};
  Work work_{};
  StereoCall* call_ = nullptr;
  uint8_t *staged_images_[2] = {}, *staged_confidence_ = nullptr, *staged_fraction_ = nullptr;
  int16_t* staged_disparity_ = nullptr;
  Captured captured_;  ///< last: its end waits for the card, which uses the rest
};

}  // namespace takt::cuda
