// SPDX-License-Identifier: Apache-2.0
// Third stage of the histogram cascade: colour co-occurrences of the windows that passed the first two (thesis Sec.
// 3.4.2; ).
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "nodes/object_detection/cuda_cooccurrences.hpp"
#include "nodes/object_detection/grid.hpp"
#include "nodes/object_detection/histogram.hpp"
#include "rt/time/clock.hpp"

namespace takt::object_detection {

/// Equal, bit for bit, to counting all pairs of a window and comparing all bins. Pairs with a colour that no reference
/// of the object has cannot add to its error: only the others are counted. Windows are independent of one another.
/// Memory is taken by the constructor; the rest allocates nothing. One thread at a time.
class CooccurrenceStage {
 public:
  /// `objects`: per object the histograms of its views.
  CooccurrenceStage(const SearchGrid& grid, const PairBins& bins, std::span<const std::vector<Histogram>> objects);

  /// From now on count_ahead() asks a card. Takes 0.2 s. Throws std::runtime_error if it refuses.
  void use(const cuda::CardUse& card);
  void leave_card() { card_.reset(); }
  bool uses_card() const { return card_ != nullptr; }
  std::span<const PairReferences> references() const { return objects_; }
  /// Whether the card, which there must be, counts faster in some windows of noise than the CPU, by that clock.
  bool card_is_quicker(const Clock& clock);
  /// Why the CPU counts in place of the card, if there is one; empty: it does not.
  std::string_view trouble() const { return card_ ? card_->trouble() : std::string_view(); }
  /// With a card: what missing() will be asked for, each at most once, and nothing before that. `bgr`: as there.
  void count_ahead(ImageView<const uint8_t> bgr, std::span<const WindowOfObject> questions);

  /// The missing mass of every reference of the object in window 0 .. windows - 1 of the image; valid until the next
  /// call. `bgr`: three channels, of the grid's image size (not checked).
  std::span<const uint32_t> missing(ImageView<const uint8_t> bgr, size_t window, size_t object);

 private:
  std::span<const uint32_t> count(ImageView<const uint8_t> bgr, size_t window, size_t object);
  PairReferences gather(const std::vector<Histogram>& views) const;

  SearchGrid grid_;
  PairBins bins_;
  std::vector<PairReferences> objects_;
  std::unique_ptr<CudaCooccurrences> card_;
  CooccurrenceCounter counter_;
  std::vector<uint8_t> colours_;
  std::vector<uint32_t> count_, missing_;
};

}  // namespace takt::object_detection
