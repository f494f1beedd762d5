// SPDX-License-Identifier: Apache-2.0
// XXH3 compiled in: whoever links Takt's libraries needs no library for it.
#pragma once
#define XXH_INLINE_ALL
#ifndef NDEBUG
#define XXH_NO_INLINE_HINTS 1  // its functions that must be inlined cannot be
#endif
#include <xxhash.h>
