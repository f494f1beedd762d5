// SPDX-License-Identifier: Apache-2.0
// The functions of malloc through volatile pointers: the compiler may otherwise drop an allocation it sees to be
// unused.
#pragma once
#include <cstdlib>

namespace takt::test {

inline void* (*volatile call_malloc)(size_t) = std::malloc;
inline void* (*volatile call_calloc)(size_t, size_t) = std::calloc;
inline void* (*volatile call_realloc)(void*, size_t) = std::realloc;
inline void (*volatile call_free)(void*) = std::free;

}  // namespace takt::test
