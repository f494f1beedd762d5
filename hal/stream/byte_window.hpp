// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

namespace takt {

/// The bytes of a stream that a parser has not finished with, in one piece. Positions count from the first byte that
/// was ever pushed.
template <size_t Capacity>
class ByteWindow {
 public:
  /// Takes as many of the bytes as there is room for. Spans of bytes() end here.
  size_t push(std::span<const uint8_t> bytes) {
    if (bytes.size() > Capacity - end_) {
      std::copy(memory_.begin() + begin_, memory_.begin() + end_, memory_.begin());
      end_ -= begin_;
      begin_ = 0;
    }
    const size_t taken = std::min(bytes.size(), Capacity - end_);
    std::copy_n(bytes.begin(), taken, memory_.begin() + end_);
    end_ += taken;
    return taken;
  }
  std::span<const uint8_t> bytes() const { return {memory_.data() + begin_, end_ - begin_}; }
  uint64_t position() const { return position_; }  ///< of the first of bytes()
  /// Done with the first ones; count <= bytes().size().
  void drop(size_t count) {
    begin_ += count;
    position_ += count;
  }

 private:
  std::array<uint8_t, Capacity> memory_{};
  size_t begin_ = 0, end_ = 0;
  uint64_t position_ = 0;
};

}  // namespace takt
