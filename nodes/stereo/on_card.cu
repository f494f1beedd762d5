// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/on_card.cuh"

#include <cstring>
#include <type_traits>

#include "nodes/stereo/on_card_paths.cuh"
#include "nodes/stereo/on_card_windows.cuh"

namespace takt::cuda {
namespace {

constexpr int kThreads = 128;
constexpr size_t kBeside = 16;  // bytes around the planes of derivatives (four_from)

bool is_narrow(const StereoShape& s) {
  return (s.cost == kGradient || s.cost == kCensus) && s.c_max * s.n_square <= 255;
}

template <int kCost, class Lanes>
void sum_columns(const Work& w, bool of_right, cudaStream_t stream) {
  const dim3 grid(blocks(static_cast<size_t>(w.shape.width) * static_cast<size_t>(w.groups), kThreads),
                  blocks(static_cast<size_t>(w.shape.height), kStrip));
  const size_t ring = static_cast<size_t>(w.shape.n_square) * kThreads * sizeof(typename Lanes::Word);
  if (of_right) column_sums<kCost, Lanes, 1><<<grid, kThreads, ring, stream>>>(w);
  else column_sums<kCost, Lanes, -1><<<grid, kThreads, ring, stream>>>(w);
}

template <class Lanes>
void decide_rows(const Work& w, cudaStream_t stream) {
  const size_t runs = static_cast<size_t>(w.shape.height) * blocks(static_cast<size_t>(w.shape.width), kRun);
  const unsigned grid = blocks(runs, kThreads / kWarp);
  const int words = (w.groups + kWarp - 1) / kWarp;
  if (words == 1) decide<Lanes, 1><<<grid, kThreads, 0, stream>>>(w);
  else if (words == 2) decide<Lanes, 2><<<grid, kThreads, 0, stream>>>(w);
  else decide<Lanes, 4><<<grid, kThreads, 0, stream>>>(w);
}

template <int kSlots>
void go_paths(const Work& w, bool of_right, cudaStream_t stream) {
  const auto lines = static_cast<size_t>(2 * w.shape.height + w.shape.width);
  const unsigned grid = blocks(lines, kThreads / kWarp);
  if (of_right) paths<kSlots, 1><<<grid, kThreads, 0, stream>>>(w);
  else paths<kSlots, -1><<<grid, kThreads, 0, stream>>>(w);
}

void search_paths(const Work& w, bool of_right, cudaStream_t stream) {
  const int slots = (w.shape.disparities + kWarp - 1) / kWarp, words = (w.groups + kWarp - 1) / kWarp;
  if (slots <= 2) go_paths<2>(w, of_right, stream);
  else if (slots <= 5) go_paths<5>(w, of_right, stream);
  else if (slots <= 8) go_paths<8>(w, of_right, stream);
  else go_paths<16>(w, of_right, stream);
  const size_t runs = (static_cast<size_t>(w.shape.width) * static_cast<size_t>(w.shape.height) + kRun - 1) / kRun;
  const unsigned grid = blocks(runs, kThreads / kWarp);
  if (words == 1) decide_paths<1><<<grid, kThreads, 0, stream>>>(w);
  else if (words == 2) decide_paths<2><<<grid, kThreads, 0, stream>>>(w);
  else decide_paths<4><<<grid, kThreads, 0, stream>>>(w);
}

void search_windows(const Work& w, bool of_right, cudaStream_t stream) {
  const bool narrow = is_narrow(w.shape);
  const auto sum = [&](auto cost) {
    constexpr int kCost = decltype(cost)::value;
    if constexpr (kCost == kGradient || kCost == kCensus)
      if (narrow) return sum_columns<kCost, Narrow>(w, of_right, stream);
    sum_columns<kCost, Wide>(w, of_right, stream);
  };
  switch (w.shape.cost) {
    case kGradient: sum(std::integral_constant<int, kGradient>()); break;
    case kCensus: sum(std::integral_constant<int, kCensus>()); break;
    case kSsd: sum(std::integral_constant<int, kSsd>()); break;
    default: sum(std::integral_constant<int, kSad>()); break;
  }
  narrow ? decide_rows<Narrow>(w, stream) : decide_rows<Wide>(w, stream);
}

void search(const Work& w, bool of_right, cudaStream_t stream) {
  w.shape.semi_global ? search_paths(w, of_right, stream) : search_windows(w, of_right, stream);
  const dim3 grid(blocks(static_cast<size_t>(w.shape.width), kFilterWidth),
                  blocks(static_cast<size_t>(w.shape.height), kFilterHeight));
  filter<<<grid, dim3(kFilterWidth, kFilterHeight), 0, stream>>>(w, of_right);
}

}  // namespace

StereoOnCard::StereoOnCard(const StereoShape& shape, int card) : shape_(shape), captured_(card) {
  const auto pixels = static_cast<size_t>(shape.width) * static_cast<size_t>(shape.height);
  work_.shape = shape;
  work_.groups = (shape.disparities + kGroup - 1) / kGroup;
  for (Features* f : {&work_.left, &work_.right}) {
    f->pixels = card_memory_.take<uint8_t>(pixels * static_cast<size_t>(shape.channels));
    if (shape.cost == kGradient) f->bytes = card_memory_.take<uint8_t>(2 * pixels + 2 * kBeside) + kBeside;
    if (shape.cost == kCensus) f->census = card_memory_.take<uint64_t>(pixels);
  }
  const size_t word = shape.semi_global  ? kPaths * sizeof(Narrow::Word)
                      : is_narrow(shape) ? sizeof(Narrow::Word)
                                         : sizeof(Wide::Word);
  work_.volume = card_memory_.take<uint8_t>(pixels * static_cast<size_t>(work_.groups) * word);
  work_.keys = card_memory_.take<uint32_t>(pixels);
  work_.left_keys = card_memory_.take<uint32_t>(pixels);
  if (shape.left_right_check) work_.right_keys = card_memory_.take<uint32_t>(pixels);
  call_ = shared_memory_.take<StereoCall>(1);
  for (auto& image : staged_images_) image = shared_memory_.take<uint8_t>(pixels * static_cast<size_t>(shape.channels));
  staged_disparity_ = shared_memory_.take<int16_t>(pixels);
  staged_confidence_ = shared_memory_.take<uint8_t>(pixels);
  staged_fraction_ = shared_memory_.take<uint8_t>(pixels);
  work_.call = call_;
  work_.withdrawn = captured_.withdrawn();
  const dim3 rows(blocks(static_cast<size_t>(shape_.width), kThreads), static_cast<unsigned>(shape_.height), 2);
  captured_.capture([&](cudaStream_t stream) { enqueue(rows, stream); },
                    [&](cudaStream_t stream) { write<<<dim3(rows.x, rows.y), kThreads, 0, stream>>>(work_); });
  *call_ = own_call();
  captured_.rehearse();
}

void StereoOnCard::enqueue(const dim3& rows, cudaStream_t stream) const {
  load<<<dim3(blocks(static_cast<size_t>(shape_.width), 4 * kThreads), rows.y, 2), kThreads, 0, stream>>>(work_);
  if (shape_.cost == kGradient || shape_.cost == kCensus) make_features<<<rows, kThreads, 0, stream>>>(work_);
  search(work_, false, stream);
  if (shape_.left_right_check) search(work_, true, stream);
}

/// In and out of its own memory.
StereoCall StereoOnCard::own_call() const {
  const ptrdiff_t row = ptrdiff_t{shape_.width} * shape_.channels;
  StereoCall call{};
  call.left = staged_images_[0];
  call.right = staged_images_[1];
  call.left_stride = call.right_stride = row;
  call.disparity = staged_disparity_;
  call.confidence = staged_confidence_;
  call.fraction = staged_fraction_;
  call.disparity_stride = call.confidence_stride = call.fraction_stride = shape_.width;
  call.disparities = shape_.disparities;
  return call;
}

/// Images are read and results written where they lie, if their pages are registered; else by way of own memory.
Outcome StereoOnCard::match(const StereoCall& asked, int64_t bound_ns) {
  const int64_t until_ns = Captured::now_ns() + bound_ns;
  if (const Outcome before = captured_.settle(until_ns); before != Outcome::done) return before;
  StereoCall call = own_call();
  call.disparities = asked.disparities;
  call.min_confidence = asked.min_confidence;
  call.p1 = asked.p1;
  call.p2 = asked.p2;
  const size_t row = static_cast<size_t>(shape_.width) * static_cast<size_t>(shape_.channels);
  const auto take = [&](const uint8_t* image, ptrdiff_t stride, uint8_t* staged) {
    return seen_by_card({image, stride}, row, shape_.height, staged);
  };
  const ImageOnCard left = take(asked.left, asked.left_stride, staged_images_[0]),
                    right = take(asked.right, asked.right_stride, staged_images_[1]);
  call.left = left.pixels;
  call.left_stride = left.stride;
  call.right = right.pixels;
  call.right_stride = right.stride;
  const auto direct = [&](auto* wanted, ptrdiff_t stride, auto*& to, ptrdiff_t& to_stride) {
    void* seen = wanted == nullptr ? nullptr : registered().on_card(wanted);
    if (wanted != nullptr && seen == nullptr) return;
    to = static_cast<std::remove_reference_t<decltype(to)>>(seen);
    to_stride = stride;
  };
  direct(asked.disparity, asked.disparity_stride, call.disparity, call.disparity_stride);
  direct(asked.confidence, asked.confidence_stride, call.confidence, call.confidence_stride);
  direct(asked.fraction, asked.fraction_stride, call.fraction, call.fraction_stride);
  *call_ = call;
  if (const Outcome outcome = captured_.run(until_ns); outcome != Outcome::done) return outcome;
  const auto fetch = [&](auto* to, ptrdiff_t stride, const auto* used, const auto* staged) {
    const auto width = static_cast<size_t>(shape_.width);
    for (int y = 0; used == staged && y < shape_.height; ++y)
      std::memcpy(to + y * stride, staged + static_cast<size_t>(y) * width, width * sizeof *to);
  };
  fetch(asked.disparity, asked.disparity_stride, call.disparity, staged_disparity_);
  fetch(asked.confidence, asked.confidence_stride, call.confidence, staged_confidence_);
  fetch(asked.fraction, asked.fraction_stride, call.fraction, staged_fraction_);
  return Outcome::done;
}

}  // namespace takt::cuda
