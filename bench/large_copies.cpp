// SPDX-License-Identifier: Apache-2.0
#include "bench/large_copies.hpp"

#include <dlfcn.h>

#include <atomic>
#include <cstddef>

namespace {

constexpr size_t kLarge = 64 * 1024;
std::atomic<uint64_t> copies{0};

using Copy = void* (*)(void*, const void*, size_t);
std::atomic<Copy> next_memcpy{nullptr}, next_memmove{nullptr};

// Before the dynamic linker is done, and inside dlsym itself. volatile: the compiler must not make it a memmove.
void* bytewise(void* to, const void* from, size_t count) {
  auto* t = static_cast<volatile unsigned char*>(to);
  const auto* f = static_cast<const volatile unsigned char*>(from);
  if (to <= from)
    for (size_t i = 0; i < count; ++i) t[i] = f[i];
  else
    for (size_t i = count; i > 0; --i) t[i - 1] = f[i - 1];
  return to;
}

__attribute__((constructor)) void find_originals() {
  next_memcpy = reinterpret_cast<Copy>(dlsym(RTLD_NEXT, "memcpy"));
  next_memmove = reinterpret_cast<Copy>(dlsym(RTLD_NEXT, "memmove"));
}

void* counted(Copy original, void* to, const void* from, size_t count) {
  if (count > kLarge) copies.fetch_add(1, std::memory_order_relaxed);
  return original != nullptr ? original(to, from, count) : bytewise(to, from, count);
}

}  // namespace

extern "C" void* memcpy(void* to, const void* from, size_t count) {
  return counted(next_memcpy.load(std::memory_order_relaxed), to, from, count);
}
extern "C" void* memmove(void* to, const void* from, size_t count) {
  return counted(next_memmove.load(std::memory_order_relaxed), to, from, count);
}

namespace takt::bench {

uint64_t large_copies() { return copies.load(); }

}  // namespace takt::bench
