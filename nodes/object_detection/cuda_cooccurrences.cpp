// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/cuda_cooccurrences.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace takt::object_detection {
namespace {
constexpr int32_t kNone = -1;
}  // namespace

CudaCooccurrences::CudaCooccurrences(const SearchGrid& grid, const PairBins& bins,
                                     std::span<const PairReferences> objects, const cuda::CardUse& use)
    : grid_(grid), use_(use), trust_(use.card.name, use.bound_ns) {
  std::vector<cuda::CooccurrenceObject> of_object;
  for (const PairReferences& object : objects) {
    of_object.push_back({object.colours(), static_cast<int32_t>(object.count), object.colour_of_slot.data(),
                         object.rows.data(), static_cast<ptrdiff_t>(object.bins)});
    references_.push_back(object.count);
    most_references_ = std::max(most_references_, object.count);
  }
  const auto windows = static_cast<size_t>(grid.windows()), questions = windows * objects.size();
  windows_.reserve(windows);
  questions_.reserve(questions);
  window_at_.resize(windows, kNone);
  answer_at_.resize(questions, kNone);
  missing_.resize(questions * most_references_);
  const cuda::CooccurrenceShape shape{grid.image_width,
                                      grid.image_height,
                                      grid.window_px,
                                      bins.colours,
                                      bins.distances,
                                      grid.windows(),
                                      static_cast<int32_t>(objects.size()),
                                      of_object.data()};
  std::array<char, cuda::kWhyBytes> why{};
  on_card_ = use.card.cuda->make_cooccurrences(&shape, use.card.index, why.data());
  if (on_card_ == nullptr) throw std::runtime_error(use.card.name + ": " + why.data());
}

CudaCooccurrences::~CudaCooccurrences() { use_.card.cuda->free_cooccurrences(on_card_); }

bool CudaCooccurrences::find(ImageView<const uint8_t> bgr, std::span<const WindowOfObject> questions) {
  forget();
  if (!trust_.asks()) return false;
  for (const WindowOfObject& question : questions) {
    int32_t& at = window_at_[question.window];
    if (at == kNone) {
      const Placement place = grid_.window(question.window);
      at = static_cast<int32_t>(windows_.size());
      windows_.push_back({place.x, place.y});
    }
    answer_at_[question.window * references_.size() + question.object] = static_cast<int32_t>(questions_.size());
    questions_.push_back({at, static_cast<int32_t>(question.object)});
  }
  for (const WindowOfObject& question : questions) window_at_[question.window] = kNone;
  const cuda::CooccurrenceCall call{bgr.data,          bgr.stride,
                                    windows_.data(),   static_cast<int32_t>(windows_.size()),
                                    questions_.data(), static_cast<int32_t>(questions_.size()),
                                    missing_.data()};
  if (trust_.done(use_.card.cuda->find_missing(on_card_, &call, use_.bound_ns))) return true;
  forget();
  return false;
}

void CudaCooccurrences::forget() {
  if (questions_.empty()) return;
  std::fill(answer_at_.begin(), answer_at_.end(), kNone);
  windows_.clear();
  questions_.clear();
}

std::span<const uint32_t> CudaCooccurrences::missing(size_t window, size_t object) const {
  const int32_t at = answer_at_[window * references_.size() + object];
  if (at == kNone) return {};
  return std::span(missing_).subspan(static_cast<size_t>(at) * most_references_, references_[object]);
}

}  // namespace takt::object_detection
