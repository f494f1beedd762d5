// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ego_motion/allocation_counter.hpp"

#include <cstdlib>
#include <new>

namespace {
long count = 0;
}

long allocations() { return count; }

void* operator new(std::size_t bytes) {
  ++count;
  if (void* memory = std::malloc(bytes ? bytes : 1)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
