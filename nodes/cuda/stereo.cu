// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstring>

#include "nodes/cuda/memory.cuh"
#include "nodes/cuda/path_kernels.cuh"
#include "nodes/cuda/stereo.cuh"
#include "nodes/cuda/stereo_kernels.cuh"

namespace takt::cuda {
namespace {

constexpr int kRehearsals = 20;
constexpr int64_t kRehearsal_ns = 2'000'000'000;
constexpr int64_t kWriting_ns = 20'000'000;  // several time slices of other processes
constexpr int kThreads = 128;
constexpr size_t kBeside = 16;  // bytes around the planes of derivatives (four_from)

int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

unsigned blocks(size_t count, int threads) {
  return static_cast<unsigned>((count + static_cast<size_t>(threads) - 1) / static_cast<size_t>(threads));
}

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

StereoOnCard::StereoOnCard(const StereoShape& shape, int card) : shape_(shape), card_(card) {
  check(cudaSetDevice(card), "cudaSetDevice");
  check(cudaStreamCreateWithFlags(&stream_.handle, cudaStreamNonBlocking), "cudaStreamCreate");
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
  shared_ = shared_memory_.take<Shared>(1);
  for (auto& image : staged_images_) image = shared_memory_.take<uint8_t>(pixels * static_cast<size_t>(shape.channels));
  staged_disparity_ = shared_memory_.take<int16_t>(pixels);
  staged_confidence_ = shared_memory_.take<uint8_t>(pixels);
  staged_fraction_ = shared_memory_.take<uint8_t>(pixels);
  work_.call = &shared_->call;
  work_.turn = &shared_->turn;
  work_.withdrawn = card_memory_.take<bool>(1);
  capture();
  rehearse();
}

StereoOnCard::~StereoOnCard() {
  cudaSetDevice(card_);
  if (stream_.handle != nullptr) cudaStreamSynchronize(stream_.handle);
}

void StereoOnCard::enqueue(cudaStream_t stream) const {
  const dim3 rows(blocks(static_cast<size_t>(shape_.width), kThreads), static_cast<unsigned>(shape_.height), 2);
  load<<<dim3(blocks(static_cast<size_t>(shape_.width), 4 * kThreads), rows.y, 2), kThreads, 0, stream>>>(work_);
  if (shape_.cost == kGradient || shape_.cost == kCensus) make_features<<<rows, kThreads, 0, stream>>>(work_);
  search(work_, false, stream);
  if (shape_.left_right_check) search(work_, true, stream);
  begin_to_write<<<1, 1, 0, stream>>>(work_);
  write<<<dim3(rows.x, rows.y), kThreads, 0, stream>>>(work_);
  tell<<<1, 1, 0, stream>>>(work_);
}

void StereoOnCard::capture() {
  check(cudaStreamBeginCapture(stream_.handle, cudaStreamCaptureModeThreadLocal), "cudaStreamBeginCapture");
  enqueue(stream_.handle);
  check(cudaStreamEndCapture(stream_.handle, &graph_.handle), "cudaStreamEndCapture");
  check(cudaGraphInstantiate(&runs_.handle, graph_.handle, 0), "cudaGraphInstantiate");
  check(cudaGraphUpload(runs_.handle, stream_.handle), "cudaGraphUpload");
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

void StereoOnCard::rehearse() {
  for (int i = 0; i < kRehearsals; ++i) {
    if (run(own_call(), now_ns() + kRehearsal_ns) == Outcome::done) continue;
    check(cudaStreamSynchronize(stream_.handle), "the first match");
    throw CardError("the first match took longer than 2 s");
  }
}

/// The memory of both sides is the card's, too; no match is under way.
Outcome StereoOnCard::run(const StereoCall& call, int64_t until_ns) {
  shared_->call = call;
  ++volatile_turn().wanted;
  if (cudaGraphLaunch(runs_.handle, stream_.handle) != cudaSuccess) return Outcome::failed;
  const Outcome outcome = wait(until_ns);
  return outcome == Outcome::late ? withdraw() : outcome;
}

Outcome StereoOnCard::wait(int64_t until_ns) const {
  constexpr int kAskEvery = 4096;
  const volatile Turn& turn = volatile_turn();
  for (int looked = 1; turn.done != turn.wanted; ++looked) {
    if (now_ns() >= until_ns) return Outcome::late;
    if (looked % kAskEvery != 0) continue;
    const cudaError_t state = cudaStreamQuery(stream_.handle);
    if (state != cudaSuccess && state != cudaErrorNotReady) return Outcome::failed;
  }
  std::atomic_thread_fence(std::memory_order_acquire);
  return Outcome::done;
}

/// What is late writes nothing any more, or is waited for: it would write into a message of others.
Outcome StereoOnCard::withdraw() {
  volatile Turn& turn = volatile_turn();
  turn.withdrawn = turn.wanted;
  std::atomic_thread_fence(std::memory_order_seq_cst);
  if (turn.writing != turn.wanted) return Outcome::late;
  if (wait(now_ns() + kWriting_ns) != Outcome::done) return Outcome::failed;
  return turn.written == turn.wanted ? Outcome::done : Outcome::late;
}

/// Images are read and results written where they lie, if their pages are registered; else by way of own memory.
Outcome StereoOnCard::match(const StereoCall& asked, int64_t bound_ns) {
  if (cudaSetDevice(card_) != cudaSuccess) return Outcome::failed;
  // What was late before must be gone: it may still read what this would change.
  const int64_t until_ns = now_ns() + bound_ns;
  if (const Outcome before = wait(until_ns); before != Outcome::done) return before;
  StereoCall call = own_call();
  call.disparities = asked.disparities;
  call.min_confidence = asked.min_confidence;
  call.p1 = asked.p1;
  call.p2 = asked.p2;
  const size_t row = static_cast<size_t>(shape_.width) * static_cast<size_t>(shape_.channels);
  const auto take = [&](const uint8_t* image, ptrdiff_t stride, uint8_t* staged, const uint8_t*& to,
                        ptrdiff_t& to_stride) {
    if (const void* seen = registered().on_card(image)) {
      to = static_cast<const uint8_t*>(seen);
      to_stride = stride;
      return;
    }
    for (int y = 0; y < shape_.height; ++y) std::memcpy(staged + static_cast<size_t>(y) * row, image + y * stride, row);
  };
  take(asked.left, asked.left_stride, staged_images_[0], call.left, call.left_stride);
  take(asked.right, asked.right_stride, staged_images_[1], call.right, call.right_stride);
  const auto direct = [&](auto* wanted, ptrdiff_t stride, auto*& to, ptrdiff_t& to_stride) {
    void* seen = wanted == nullptr ? nullptr : registered().on_card(wanted);
    if (wanted != nullptr && seen == nullptr) return;
    to = static_cast<std::remove_reference_t<decltype(to)>>(seen);
    to_stride = stride;
  };
  direct(asked.disparity, asked.disparity_stride, call.disparity, call.disparity_stride);
  direct(asked.confidence, asked.confidence_stride, call.confidence, call.confidence_stride);
  direct(asked.fraction, asked.fraction_stride, call.fraction, call.fraction_stride);
  if (const Outcome outcome = run(call, until_ns); outcome != Outcome::done) return outcome;
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
