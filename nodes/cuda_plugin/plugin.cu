// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "nodes/cuda/table.hpp"
#include "nodes/object_detection/on_card.cuh"
#include "nodes/stereo/on_card.cuh"
#include "rt/abi.hpp"

namespace takt::cuda {
namespace {

void say(char* why, const char* text) { std::snprintf(why, kWhyBytes, "%s", text); }

int32_t cards(char* why) {
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error == cudaSuccess) return count;
  say(why, cudaGetErrorString(error));
  return -static_cast<int32_t>(error);
}

void card_name(int32_t card, char* name) {
  cudaDeviceProp properties{};
  say(name, cudaGetDeviceProperties(&properties, card) == cudaSuccess ? properties.name : "");
}

/// Null: `why`.
template <class OnCard, class Shape>
OnCard* make(const Shape* shape, int32_t card, char* why) {
  try {
    return new OnCard(*shape, card);
  } catch (const std::exception& error) {
    say(why, error.what());
    return nullptr;
  }
}

Outcome match(StereoOnCard* stereo, const StereoCall* call, int64_t bound_ns) { return stereo->match(*call, bound_ns); }
Outcome find_missing(CooccurrencesOnCard* cooccurrences, const CooccurrenceCall* call, int64_t bound_ns) {
  return cooccurrences->find(*call, bound_ns);
}
template <class OnCard>
void free_it(OnCard* on_card) {
  delete on_card;
}
bool register_memory(void* memory, size_t bytes) { return registered().add(memory, bytes); }
void forget_memory(void* memory) { registered().forget(memory); }

}  // namespace
}  // namespace takt::cuda

extern "C" __attribute__((visibility("default")))
const takt::cuda::Table takt_cuda{takt::kAbi,
                                  takt::cuda::cards,
                                  takt::cuda::card_name,
                                  takt::cuda::make<takt::cuda::StereoOnCard>,
                                  takt::cuda::match,
                                  takt::cuda::free_it<takt::cuda::StereoOnCard>,
                                  takt::cuda::make<takt::cuda::CooccurrencesOnCard>,
                                  takt::cuda::find_missing,
                                  takt::cuda::free_it<takt::cuda::CooccurrencesOnCard>,
                                  takt::cuda::register_memory,
                                  takt::cuda::forget_memory};
