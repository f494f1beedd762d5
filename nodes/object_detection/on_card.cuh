// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "nodes/cuda/captured.cuh"
#include "nodes/object_detection/on_card_work.hpp"

namespace takt::cuda {

/// The third stage of the histogram cascade on a card, for many windows at once. Throws CardError when it is made, and
/// never after.
struct CooccurrencesOnCard {
 public:
  CooccurrencesOnCard(const CooccurrenceShape& shape, int card);
  CooccurrencesOnCard(const CooccurrencesOnCard&) = delete;
  CooccurrencesOnCard& operator=(const CooccurrencesOnCard&) = delete;
  Outcome find(const CooccurrenceCall& call, int64_t bound_ns);

 private:
  void take_references(const CooccurrenceShape& shape);
  void take_offsets(int distances);
  void share_out(int card);
  void enqueue(cudaStream_t stream) const;

  Memory card_memory_{Memory::Place::card}, shared_memory_{Memory::Place::shared};
  CooccurrenceWork work_{};
  CooccurrenceCall* call_ = nullptr;
  CardWindow* windows_ = nullptr;
  CardQuestion* questions_ = nullptr;
  uint8_t* staged_image_ = nullptr;
  uint32_t* missing_ = nullptr;
  unsigned counting_blocks_ = 1;
  size_t counting_bytes_ = 0;
  int longest_piece_ = 1;
  Captured captured_;  ///< last: its end waits for the card, which uses the rest
};

}  // namespace takt::cuda
