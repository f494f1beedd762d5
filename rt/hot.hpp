// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>

/// Of functions between a release and the node's code: they lie next to one another in the program. A job comes to cold
/// caches, and each page of code that it enters costs it a miss.
#define TAKT_HOT [[gnu::hot]]

namespace takt {

/// What two threads write lies this far apart, so that neither waits for the other's cache. Bytes.
inline constexpr size_t kCacheLine = 64;

/// Asks for what lies there, without waiting for it.
inline void prefetch(const void* at, size_t bytes) {
  for (size_t offset = 0; offset < bytes; offset += kCacheLine)
    __builtin_prefetch(static_cast<const char*>(at) + offset);
}

}  // namespace takt
