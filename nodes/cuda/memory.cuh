// SPDX-License-Identifier: Apache-2.0
// Internal: memory and handles of CUDA that are given back, and the pages of others that cards may use.
#pragma once
#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

namespace takt::cuda {

struct CardError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline void check(cudaError_t error, const char* what) {
  if (error != cudaSuccess) throw CardError(std::string(what) + ": " + cudaGetErrorString(error));
}

template <class T, cudaError_t (*kDestroy)(T)>
struct Handle {
  T handle = nullptr;
  Handle() = default;
  ~Handle() {
    if (handle != nullptr) kDestroy(handle);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
};

/// Blocks of one kind, zeroed, given back together.
class Memory {
 public:
  enum class Place { card, shared };  ///< shared: of the host, at the same address on the card
  explicit Memory(Place place) : place_(place) {}
  ~Memory() {
    for (void* block : blocks_) place_ == Place::card ? cudaFree(block) : cudaFreeHost(block);
  }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  template <class T>
  T* take(size_t count) {
    void* block = nullptr;
    const size_t bytes = count * sizeof(T);
    check(place_ == Place::card ? cudaMalloc(&block, bytes)
                                : cudaHostAlloc(&block, bytes, cudaHostAllocMapped | cudaHostAllocPortable),
          ("memory, " + std::to_string(bytes) + " bytes").c_str());
    blocks_.push_back(block);
    check(cudaMemset(block, 0, bytes), "cudaMemset");
    return static_cast<T*>(block);
  }

 private:
  const Place place_;
  std::vector<void*> blocks_;
};

/// Pages of the host that cards may use. Any thread; a job only looks.
class Registered {
 public:
  bool add(void* memory, size_t bytes) {
    if (cudaHostRegister(memory, bytes, cudaHostRegisterMapped | cudaHostRegisterPortable) != cudaSuccess) return false;
    void* on_card = nullptr;
    if (cudaHostGetDevicePointer(&on_card, memory, 0) != cudaSuccess) return cudaHostUnregister(memory), false;
    const std::lock_guard lock(mutex_);
    ranges_[reinterpret_cast<uintptr_t>(memory)] = {bytes, reinterpret_cast<uintptr_t>(on_card)};
    return true;
  }
  void forget(void* memory) {
    const std::lock_guard lock(mutex_);
    if (ranges_.erase(reinterpret_cast<uintptr_t>(memory)) > 0) cudaHostUnregister(memory);
  }
  /// Where a card sees this address; null: it does not.
  void* on_card(const void* memory) {
    const std::lock_guard lock(mutex_);
    const auto address = reinterpret_cast<uintptr_t>(memory);
    auto range = ranges_.upper_bound(address);
    if (range == ranges_.begin()) return nullptr;
    --range;
    const uintptr_t offset = address - range->first;
    return offset < range->second.bytes ? reinterpret_cast<void*>(range->second.on_card + offset) : nullptr;
  }

 private:
  struct Range {
    size_t bytes;
    uintptr_t on_card;
  };
  std::mutex mutex_;
  std::map<uintptr_t, Range> ranges_;
};

inline Registered& registered() {
  static Registered all;
  return all;
}

struct ImageOnCard {
  const uint8_t* pixels;
  ptrdiff_t stride;  ///< bytes
};
/// Where the card reads an image of the host, `row` bytes in each of its rows: where it lies, if its pages are
/// registered, else in `staged`, which both see and to which the CPU copies it row after row.
inline ImageOnCard seen_by_card(const ImageOnCard& image, size_t row, int rows, uint8_t* staged) {
  if (const void* there = registered().on_card(image.pixels)) return {static_cast<const uint8_t*>(there), image.stride};
  for (int y = 0; y < rows; ++y)
    std::memcpy(staged + static_cast<size_t>(y) * row, image.pixels + y * image.stride, row);
  return {staged, static_cast<ptrdiff_t>(row)};
}

}  // namespace takt::cuda
