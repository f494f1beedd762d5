// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "nodes/cuda/card.hpp"
#include "nodes/cuda/trust.hpp"
#include "nodes/object_detection/grid.hpp"
#include "nodes/object_detection/histogram.hpp"

namespace takt::object_detection {

/// A window of the grid, and the object that is looked for in it.
struct WindowOfObject {
  size_t window = 0, object = 0;
};

/// The references of an object, over those colours that any of them has.
struct PairReferences {
  std::vector<uint8_t> slot_of_colour;  ///< colours that no reference has come last
  std::vector<uint8_t> colour_of_slot;  ///< rising
  std::vector<uint32_t> rows;           ///< a reference each, in the order of pair_bin() of their slots
  size_t bins = 0;                      ///< of a row, padded
  size_t count = 0;
  int colours() const { return static_cast<int>(colour_of_slot.size()); }
};

/// What windows miss, for many of them at once on a card: bit for bit what CooccurrenceStage finds. Memory is taken by
/// the constructor. One thread at a time.
class CudaCooccurrences {
 public:
  /// Takes 0.2 s. Throws std::runtime_error if the card refuses.
  CudaCooccurrences(const SearchGrid& grid, const PairBins& bins, std::span<const PairReferences> objects,
                    const cuda::CardUse& use);
  ~CudaCooccurrences();
  CudaCooccurrences(const CudaCooccurrences&) = delete;
  CudaCooccurrences& operator=(const CudaCooccurrences&) = delete;

  /// False if the card was not asked, or not in time: missing() has nothing then. `bgr`: three channels, of the grid's
  /// image size; `questions`: each at most once. None at all is for a thread's first time: CUDA allocates then.
  [[nodiscard]] bool find(ImageView<const uint8_t> bgr, std::span<const WindowOfObject> questions);
  /// There is nothing any more.
  void forget();
  /// The missing mass of every reference of the object there; empty if find() was not asked for it.
  std::span<const uint32_t> missing(size_t window, size_t object) const;
  std::string_view trouble() const { return trust_.trouble(); }

 private:
  const SearchGrid grid_;
  const cuda::CardUse use_;
  cuda::Trust trust_;
  cuda::CooccurrencesOnCard* on_card_ = nullptr;
  std::vector<size_t> references_;  ///< of each object
  size_t most_references_ = 0;
  std::vector<cuda::CardWindow> windows_;
  std::vector<cuda::CardQuestion> questions_;
  std::vector<int32_t> window_at_;  ///< of each window of the grid: its place in windows_; -1: none
  std::vector<int32_t> answer_at_;  ///< of each window and object: its place in questions_; -1: none
  std::vector<uint32_t> missing_;
};

}  // namespace takt::object_detection
