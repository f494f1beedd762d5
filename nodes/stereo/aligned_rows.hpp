// SPDX-License-Identifier: Apache-2.0
// Internal: memory of the matchers, taken once.
#pragma once
#include <hwy/aligned_allocator.h>

#include <algorithm>
#include <cstddef>
#include <new>

#include "nodes/stereo/image_kernels.hpp"

namespace takt::stereo {

/// Filled (so that no page is touched for the first time in a job), cache-line aligned memory.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  explicit Buffer(size_t count, T value = T{}) : data_(hwy::AllocateAligned<T>(count)), count_(count) {
    if (!data_) throw std::bad_alloc();
    fill(value);
  }
  T* data() const { return data_.get(); }
  size_t size() const { return count_; }
  void fill(T value) { std::fill(data_.get(), data_.get() + count_, value); }

 private:
  hwy::AlignedFreeUniquePtr<T[]> data_;
  size_t count_ = 0;
};

/// Rows of equal length with kRowPadding elements before each and enough after it for vector accesses.
template <class T>
class Rows {
 public:
  Rows() = default;
  Rows(int height, int width, int after = 0, T value = T{})
      : width_(width),
        height_(height),
        stride_((static_cast<size_t>(kRowPadding + width + after + kRowPadding) + 63) / 64 * 64),
        buffer_(stride_ * static_cast<size_t>(height), value) {}
  T* row(int y) const { return buffer_.data() + static_cast<size_t>(y) * stride_ + kRowPadding; }
  ImageView<T> view() const { return {row(0), width_, height_, 1, static_cast<ptrdiff_t>(stride_)}; }

 private:
  int width_ = 0, height_ = 0;
  size_t stride_ = 0;
  Buffer<T> buffer_;
};

inline int round_up(int value, int unit) { return (value + unit - 1) / unit * unit; }

}  // namespace takt::stereo
