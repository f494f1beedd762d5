// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <memory>
#include <new>

namespace takt {

struct FreeAlignedBytes {
  void operator()(std::byte* memory) const { ::operator delete[](memory, std::align_val_t{64}); }
};
/// Memory for messages outside of the pools: aligned as they are there, to 64 bytes. Not filled.
using AlignedBytes = std::unique_ptr<std::byte[], FreeAlignedBytes>;
inline AlignedBytes aligned_bytes(size_t size) {
  return AlignedBytes(static_cast<std::byte*>(::operator new[](size, std::align_val_t{64})));
}

}  // namespace takt
